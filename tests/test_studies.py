"""The static runs and what is stored of them, against the elastica."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from scipy.interpolate import CubicSpline

from stripfold import elastica
from stripfold.ask.critical import find
from stripfold.ask.inputs import Scene
from stripfold.base.errors import InvalidInputError, NewtonError, SolveError, StripfoldError
from stripfold.base.material import Material
from stripfold.follow import static
from stripfold.follow.collapse import node_weights
from stripfold.follow.contact_events import clearance
from stripfold.follow.static import End, StripModel
from stripfold.solve import newton
from stripfold.strip.problem import AlongX, StripProblem
from studies import branches
from tasks import x_axis as xaxis
from tasks.branch_checks import check_branch
from tasks.diagnostics import record

THIN = StripModel(16.0, 0.02)


@pytest.fixture(scope="module")
def run() -> static.XRun:
    """A thin strip at z = 3 L*, followed past its critical point."""
    return static.solve_height(THIN, 3.0, past=1.0)


@pytest.fixture(scope="module")
def stored() -> xr.Dataset:
    """The x-axis study of one material at a height that snaps and one at which the sag lands first."""
    return xaxis.run(Material(3780.0), 0.6, [1.2, 3.0], 1.0)


def test_critical_point_is_the_elasticas(run: static.XRun) -> None:
    # What the thickness does to lambda_c is -6 (h/L*)^2; the mesh may add 2e-4.
    assert run.end is End.SNAP
    assert run.critical is not None
    assert run.critical.agree
    shift = run.lam - elastica.critical(3.0).advance
    assert shift == pytest.approx(-6.0 * THIN.thickness**2, abs=3e-4)
    assert run.free_length == pytest.approx(elastica.critical(3.0).length, abs=0.05)


def test_bracket_is_within_the_tolerance(run: static.XRun) -> None:
    assert run.critical is not None
    assert 0.0 <= run.critical.width <= static.LAMBDA_TOLERANCE
    assert run.critical.lower == run.critical.lam
    assert run.critical.eigenvalue_lam == pytest.approx(run.critical.lam, abs=2e-4)


def test_stable_before_and_unstable_after(run: static.XRun) -> None:
    index = run.points.index(run.last)
    points = [at.point for at in run.points]
    assert all(p.negatives == 0 and p.eigenvalues[0] > 0.0 for p in points[: index + 1])
    assert all(p.negatives == 1 for p in points[index + 1 :])
    assert points[-1].eigenvalues[0] < 0.0
    # The unstable branch is followed until the sag touches the lower layer.
    assert points[-1].lam < points[index].lam - 1e-3


def test_instability_is_weak_as_the_elasticas(run: static.XRun) -> None:
    # docs/physics.md, section 5: past the fold the negative eigenvalue is about 1 % of the next one.
    low, high = run.points[-1].point.eigenvalues
    assert -0.05 < low / high < -0.001


def test_lifted_state_is_the_elasticas() -> None:
    heights = [0.5, 1.5, 3.0]
    for height, at in static.lift(StripModel(12.0, 0.01).contact_mesh(), heights):
        model = at.model
        truth = elastica.state_no_horizontal_force(height)
        assert at.u[model.middle[0]] == pytest.approx([truth.advance, height], abs=2e-3)
        shape = model.mid_surface(at.u)
        free = model.s < truth.length
        distance = truth.at(truth.length - model.s[free])
        # The elastica's X runs from the lift-off towards the gripper.
        x = model.length / 2.0 - (model.length - truth.length) - np.asarray(distance.x)
        assert np.abs(shape[free, 1] - distance.z).max() < 3e-3
        assert np.abs(shape[free, 0] - x).max() < 3e-3


def test_no_penetration_and_first_integral(run: static.XRun) -> None:
    for point in run.points:
        entry = record(point)
        assert entry.minimal_gap >= -1e-12
        assert abs(entry.first_integral_error) < 5e-3
        assert np.isfinite([entry.elastic_energy, entry.gravity_energy, entry.force_x, entry.force_z]).all()
    start = record(run.points[0])
    assert start.force_x == pytest.approx(0.0, abs=1e-6)
    truth = elastica.state_no_horizontal_force(3.0)
    assert start.force_z == pytest.approx(truth.length - truth.reaction, abs=0.02)


def test_gripper_force_at_the_critical_point(run: static.XRun) -> None:
    truth = elastica.critical(3.0).state
    assert truth is not None
    # The elastica's X axis points along -x.
    assert record(run.last).force_x == pytest.approx(-truth.force_x, abs=0.02)


def test_energy_is_what_the_gripper_did(run: static.XRun) -> None:
    """A second way: along a branch dW = F_x dlambda."""
    entries = [record(p) for p in run.points[: run.points.index(run.last) + 1]]
    energy = np.array([e.elastic_energy + e.gravity_energy for e in entries])
    # Over the root of the distance from lambda_c, u: towards it the force's slope in lambda has no bound.
    u = np.sqrt([run.lam + 1e-9 - e.lam for e in entries])[::-1]
    work = CubicSpline(u, 2.0 * u * [e.force_x for e in entries][::-1]).integrate(u[0], u[-1])
    assert energy[-1] - energy[0] == pytest.approx(work, abs=2e-3)


def test_low_gripper_lays_the_sag_down() -> None:
    low = static.solve_height(StripModel(16.0, 0.02), 1.2)
    truth = elastica.critical(1.2).state
    assert truth.sag is not None
    assert low.end is End.TOUCH
    assert low.critical is None
    assert low.lam == pytest.approx(truth.advance, abs=5e-3)
    height, place = clearance(low.last.problem, low.last.point.q)
    assert height == pytest.approx(0.0, abs=1e-4)
    assert place == pytest.approx(truth.length - truth.sag.s, abs=0.02)


def test_short_strip_is_lifted_whole() -> None:
    assert static.solve_height(StripModel(7.0, 0.02), 3.0).end is End.LIFTED


def test_fixed_lambda_steps_end_at_the_fold_and_continuation_does_not(run: static.XRun) -> None:
    """Past the fold Newton's method at fixed lambda does not converge; before it, it does."""
    assert run.critical is not None
    before, problem = run.critical.before, run.last.problem
    with pytest.raises(NewtonError):
        newton.solve(problem, before.q, before.lam + 0.05, before.state.active)
    assert newton.solve(problem, before.q, before.lam - 0.05, before.state.active).residuals[-1] < 1e-8
    assert max(at.point.lam for at in run.points) <= run.critical.upper + 1e-9


@pytest.mark.slow
def test_branch_study_detects_a_wrong_result(monkeypatch: pytest.MonkeyPatch) -> None:
    right = branches.run(2, 1, 7, 2.0, 1e-3, threads=2)
    assert right["verdict"].values.tolist() == [branches.RIGHT, branches.RIGHT]
    assert right.attrs["seed"] == 7
    low = static.solve_height(THIN, 1.2, 2.0)

    def other(*_: object, **__: object) -> static.XRun:
        return low

    def fails(*_: object, **__: object) -> None:
        raise SolveError("planted")

    for planted, verdict in ((other, branches.WRONG), (fails, branches.FAILED)):
        monkeypatch.setattr(branches, "solve_height", planted)
        assert branches.run(1, 0, 7, 2.0, 1e-3)["verdict"].item() == verdict


def test_the_papers_samples_are_held_back() -> None:
    """No test and no quick run uses their seeds: what was tuned on a sample is not reported on it."""
    config = Path(__file__).parents[1] / "workflow" / "config"
    paper, quick = (yaml.safe_load((config / f"{name}.yaml").read_text())["studies"] for name in ("paper", "quick"))
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("**/*.py"))
    for name in ("branches", "estimates", "random_paths", "low_paths", "recordings_accuracy"):
        seed = paper[name]["seed"]
        assert seed != (quick[name] or {}).get("seed"), name
        assert str(seed) not in tests, name


def test_dataset_is_complete(stored: xr.Dataset) -> None:
    for name, variable in stored.variables.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    unit = stored.attrs["gravity_length"]
    assert stored["snap"].values.tolist() == [0, 1]
    assert np.isnan(stored["lambda_c"].values[0])
    assert "touches" in str(stored["reason"].values[0])
    assert stored["lambda_c"].values[1] / unit == pytest.approx(9.8363, abs=2e-3)
    assert stored["lambda_error"].values[1] / unit < 0.05
    np.testing.assert_allclose(stored["z"].values[:, 0, 0], stored["gripper_height"].values, rtol=1e-12)
    # The gripper's place and lambda are the same thing.
    np.testing.assert_allclose(stored["x"].values[:, :, 0] + 0.3, stored["advance"].values, atol=1e-12)


def test_sound_branches_pass(stored: xr.Dataset) -> None:
    check_branch(stored)


@pytest.mark.parametrize(
    ("name", "index", "value", "says"),
    [
        ("minimal_gap", (1, 3), -1e-6, "penetrated"),
        ("residual", (1, 3), 1.0, "equilibrium"),
        ("residual", (1, 3), np.nan, "missing"),
        ("negatives", (1, 0), 1.0, "starts unstable"),
        ("negatives", (1, slice(None)), 0.0, "no unstable point"),
        ("lambda_c_upper", (1,), 1.0, "bracket"),
        ("lambda_c_upper", (1,), 0.0, "bracket"),
        ("lambda_c_lower", (1,), 1.0, "bracket"),
        ("advance", (1, 5), 1.0, "exceeds lambda_c"),
        ("lambda_c", (0,), 0.2, "without a snap"),
    ],
)
def test_broken_branches_are_refused(stored: xr.Dataset, name: str, index: tuple, value: float, says: str) -> None:
    broken = stored.copy(deep=True)
    broken[name].values[index] = value
    with pytest.raises(StripfoldError, match=says):
        check_branch(broken)


def test_unbalanced_forces_are_judged_at_the_runs_own_gravity(stored: xr.Dataset) -> None:
    changed = stored.copy(deep=True)
    changed["residual"].values[1, 3] = 5e-5 * stored.attrs["rho_a"] * 9.81 * stored.attrs["gravity_length"]
    check_branch(changed)
    with pytest.raises(StripfoldError, match="equilibrium"):
        check_branch(changed.assign_attrs(gravity=1.62))


@pytest.mark.parametrize("model", ["solid", "elastica"])
def test_find(model: str) -> None:
    found = find(Scene(length=0.6, height=0.09, eta_b=3780.0, model=model, accuracy=5e-3))
    truth = {"solid": 0.2950006, "elastica": 0.29562219}[model]  # the solid's on a mesh six times finer
    assert found.snap
    assert abs(found.lambda_c - truth) <= found.error + 1e-8
    assert found.error <= 5e-3 * found.lambda_c
    assert found.x_c == pytest.approx(found.lambda_c - 0.3)
    assert found.lambda_c_lower <= found.lambda_c <= found.lambda_c_upper


@pytest.mark.parametrize("height", [1.5, 1.7])
def test_find_far_above_the_touch_limit(height: float) -> None:
    """The elastica's value, from which the solid's differs by the stretch under its own weight."""
    asked = Scene(length=4.02, height=height, eta_b=3780.0, eta_m=1e-5, model="solid")
    found, truth = find(asked), elastica.critical(asked.height_star).advance * asked.material.gravity_length
    stretch = asked.eta_m * asked.gravity * height**2 / 2.0
    assert abs(found.lambda_c - truth) < found.error + stretch


@pytest.mark.parametrize("model", ["solid", "elastica"])
def test_find_says_why_there_is_no_snap(model: str) -> None:
    low = find(Scene(length=0.6, height=0.036, eta_b=3780.0, model=model, accuracy=5e-3))
    assert not low.snap
    assert np.isnan(low.lambda_c)
    assert "touches" in low.reason
    short = find(Scene(length=0.2, height=0.09, eta_b=3780.0, model=model, accuracy=5e-3))
    assert not short.snap
    assert np.isnan(short.lambda_c)
    assert "too short" in short.reason


@pytest.mark.slow
def test_printed_law_cannot_hold_an_upright_strip() -> None:
    """docs/physics.md, section 2: its bending stiffness goes with the square of the cosine of the slope."""
    with pytest.raises(SolveError):
        static.solve_height(StripModel(12.0, 0.05, law="printed"), 3.0, 1.0)


def test_unusable_mesh_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="order"):
        StripModel(10.0, 0.05, order=3).model(20)
    with pytest.raises(InvalidInputError, match="elements_across"):
        StripModel(10.0, 0.05, order=1, across=1).model(20)
    with pytest.raises(InvalidInputError, match="elements"):
        StripModel(10.0, 0.05).model(np.array([0.0, 2.0, 1.0, 10.0]))


def test_gripper_motion_is_prescribed(run: static.XRun) -> None:
    problem = StripProblem(run.last.model, AlongX(3.0))
    assert problem.prescribed_values(2.5).tolist() == [2.5, 3.0, 0.0, 0.0]
    assert problem.prescribed_rates(2.5).tolist() == [1.0, 0.0, 0.0, 0.0]


def test_node_weights_integrate() -> None:
    s = np.array([0.0, 1.0, 3.0, 3.5])
    assert node_weights(s) == pytest.approx([0.5, 1.5, 1.25, 0.25])
    assert node_weights(s) @ (2.0 + 3.0 * s) == pytest.approx(2.0 * 3.5 + 1.5 * 3.5**2)

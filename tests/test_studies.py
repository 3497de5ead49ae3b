"""The static runs and what is stored of them, against the elastica."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml
from scipy.interpolate import CubicSpline

from stripfold import elastica
from stripfold.analysis import critical_point, static
from stripfold.analysis import x_axis as xaxis
from stripfold.analysis.checks import check_branch
from stripfold.analysis.contact import contact_positions
from stripfold.analysis.critical_point import find
from stripfold.analysis.diagnostics import node_weights, record
from stripfold.analysis.planning import Sweep, boundaries, lift_off_sweep
from stripfold.analysis.static import End, StripModel
from stripfold.errors import CoarseMeshError, InvalidInputError, NewtonError, SolveError, StripfoldError
from stripfold.inputs import Scene
from stripfold.material import Material
from stripfold.problem import AlongX, StripProblem
from stripfold.solve import newton
from studies import branches, order

THIN = StripModel(16.0, 0.02)


@pytest.fixture(scope="module")
def run() -> static.XRun:
    """A thin strip at z = 3 L*, followed past its critical point."""
    return static.solve_height(THIN, 3.0, 1.0)


@pytest.fixture(scope="module")
def stored() -> xr.Dataset:
    """The x-axis study of one material at a height that snaps and one at which the sag lands first."""
    return xaxis.run(Material(3780.0), 0.6, [1.2, 3.0], 2.0)


def test_critical_point_is_the_elasticas(run: static.XRun) -> None:
    # What the thickness does to lambda_c is -6 (h/L*)^2; the mesh may add 2e-4.
    assert run.end is End.SNAP
    assert run.critical is not None
    assert run.critical.agree
    shift = run.last.lam - elastica.critical(3.0).advance
    assert shift == pytest.approx(-6.0 * THIN.thickness**2, abs=3e-4)
    assert run.free_length == pytest.approx(elastica.critical(3.0).length, abs=0.05)


def test_bracket_is_within_the_tolerance(run: static.XRun) -> None:
    assert run.critical is not None
    assert 0.0 <= run.critical.width <= static.LAMBDA_TOLERANCE
    assert run.critical.lower == run.critical.lam
    assert run.critical.eigenvalue_lam == pytest.approx(run.critical.lam, abs=1e-6)


def test_stable_before_and_unstable_after(run: static.XRun) -> None:
    index = run.points.index(run.last)
    assert all(p.negatives == 0 and p.eigenvalues[0] > 0.0 for p in run.points[: index + 1])
    after = run.points[index + 1 :]
    # The sag touches the lower layer 0.2 L* of arc behind the maximum; the branch is followed up to there.
    assert after[-1].arc - run.last.arc == pytest.approx(0.2, abs=0.05)
    assert all(p.negatives == 1 and p.eigenvalues[0] < 0.0 for p in after)


def test_instability_is_weak_as_the_elasticas(run: static.XRun) -> None:
    # docs/physics.md, section 5: past the fold the negative eigenvalue is about 1 % of the next one.
    low, high = run.points[-1].eigenvalues
    assert -0.05 < low / high < -0.001


def test_lifted_state_is_the_elasticas() -> None:
    heights = [0.5, 1.5, 3.0]
    for height, model, state in static.lift(StripModel(12.0, 0.01), heights):
        truth = elastica.state_no_horizontal_force(height)
        assert state.q[model.middle[0]] == pytest.approx([truth.advance, height], abs=2e-3)
        shape = model.mid_surface(state.q)
        free = model.s < truth.length
        distance = truth.at(truth.length - model.s[free])
        # The elastica's X runs from the lift-off towards the gripper.
        x = model.length / 2.0 - (model.length - truth.length) - np.asarray(distance.x)
        assert np.abs(shape[free, 1] - distance.z).max() < 3e-3
        assert np.abs(shape[free, 0] - x).max() < 3e-3


def test_no_penetration_and_first_integral(run: static.XRun) -> None:
    for point in run.points:
        entry = record(run.problem, point)
        assert entry.minimal_gap >= -1e-12
        assert abs(entry.first_integral_error) < 5e-3
        assert np.isfinite([entry.elastic_energy, entry.gravity_energy, entry.force_x, entry.force_z]).all()
    start = record(run.problem, run.points[0])
    assert start.force_x == pytest.approx(0.0, abs=1e-6)
    truth = elastica.state_no_horizontal_force(3.0)
    assert start.force_z == pytest.approx(truth.length - truth.reaction, abs=0.02)


def test_gripper_force_at_the_critical_point(run: static.XRun) -> None:
    truth = elastica.critical(3.0).state
    assert truth is not None
    # The elastica's X axis points along -x.
    assert record(run.problem, run.last).force_x == pytest.approx(-truth.force_x, abs=0.02)


def test_energy_is_what_the_gripper_did(run: static.XRun) -> None:
    """A second way: along a branch dW = F_x dlambda."""
    entries = [record(run.problem, p) for p in run.points[: run.points.index(run.last) + 1]]
    energy = np.array([e.elastic_energy + e.gravity_energy for e in entries])
    lam = [e.lam for e in entries]
    work = CubicSpline(lam, [e.force_x for e in entries]).integrate(lam[0], lam[-1])
    assert energy[-1] - energy[0] == pytest.approx(work, abs=2e-3)


def test_low_gripper_lays_the_sag_down() -> None:
    low = static.solve_height(StripModel(16.0, 0.02), 1.2, 2.0)
    truth = elastica.critical(1.2).state
    assert truth.sag is not None
    assert low.end is End.TOUCH
    assert low.critical is None
    assert low.last.lam == pytest.approx(truth.advance, abs=0.02)
    assert min(contact_positions(low.problem.model, low.last)) == pytest.approx(truth.length - truth.sag.s, abs=0.2)


def test_short_strip_is_lifted_whole() -> None:
    assert static.solve_height(StripModel(7.0, 0.02), 3.0, 2.0).end is End.LIFTED


def test_fixed_lambda_steps_end_at_the_fold_and_continuation_does_not(run: static.XRun) -> None:
    """Past the fold Newton's method at fixed lambda does not converge; before it, it does."""
    assert run.critical is not None
    before = run.critical.before
    problem = run.problem
    with pytest.raises(NewtonError, match="did not converge"):
        newton.solve(problem, before.q, before.lam + 0.05, before.state.active)
    assert newton.solve(problem, before.q, before.lam - 0.05, before.state.active).residuals[-1] < 1e-8
    assert max(p.lam for p in run.points) <= run.critical.upper + 1e-4


@pytest.mark.slow
def test_branch_study_detects_a_wrong_result(monkeypatch: pytest.MonkeyPatch) -> None:
    right = branches.run(2, 7, 2.0, 1e-3, threads=2)
    assert right["verdict"].values.tolist() == [branches.RIGHT, branches.RIGHT]
    assert right.attrs["seed"] == 7
    low = static.solve_height(THIN, 1.2, 2.0)

    def other(*_: object, **__: object) -> static.XRun:
        return low

    def fails(*_: object, **__: object) -> None:
        raise SolveError("planted")

    for planted, verdict in ((other, branches.WRONG), (fails, branches.FAILED)):
        monkeypatch.setattr(branches, "solve_height", planted)
        assert branches.run(1, 7, 2.0, 1e-3)["verdict"].item() == verdict


def test_the_papers_samples_are_held_back() -> None:
    """No test and no quick run uses their seeds: what was tuned on a sample is not reported on it."""
    config = Path(__file__).parents[1] / "workflow" / "config"
    paper, quick = (yaml.safe_load((config / f"{name}.yaml").read_text())["studies"] for name in ("paper", "quick"))
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("**/*.py"))
    for name in ("branches", "estimates", "random_paths"):
        seed = paper[name]["seed"]
        assert seed != quick[name]["seed"], name
        assert str(seed) not in tests, name


@pytest.mark.slow
def test_order_of_lambda_c() -> None:
    """Uniform meshes; the study that is stored goes on to finer ones."""
    data = order.run(12.0, 0.0594, 3.0, (0.1, 0.05), 2, 1.0)
    print(f"observed order {float(data['order']):.2f}, errors {data['error'].values}")
    assert float(data["order"]) > 1.3
    assert float(data["error"][-1]) < 1e-2


def test_planned_mesh() -> None:
    ends = boundaries(20.0, Sweep(4.0, 7.1), 1.0)
    sizes = np.diff(ends)
    assert ends[0] == 0.0
    assert ends[-1] == pytest.approx(20.0)
    assert np.all(sizes > 0.0)
    assert np.min(np.abs(ends - 7.1)) < 1e-12
    assert sizes[np.abs(ends[:-1] - 7.1) < 0.2].max() < 0.011
    assert len(boundaries(20.0, Sweep(4.0, 7.1), 0.5)) > 1.8 * len(ends)
    sweep = lift_off_sweep(3.0)
    assert (sweep.first, sweep.critical) == (pytest.approx(3.9587, abs=3e-2), pytest.approx(7.133077, abs=1e-5))


def test_transfer_keeps_the_shape(run: static.XRun) -> None:
    model = run.problem.model
    other = THIN.model(120)
    there = static.transfer(model, run.last.q, other)
    back = static.transfer(other, there, model)
    assert np.abs(model.mid_surface(back) - model.mid_surface(run.last.q)).max() < 2e-3


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
    np.testing.assert_allclose(stored["z"].values[:, 0, 0], stored["height"].values, rtol=1e-12)
    # The gripper's place and lambda are the same thing.
    np.testing.assert_allclose(stored["x"].values[:, :, 0] + 0.3, stored["lambda"].values, atol=1e-12)


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
        ("lambda", (1, 5), 1.0, "exceeds lambda_c"),
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


@pytest.mark.parametrize(("height", "end"), [(0.036, End.SNAP), (0.09, End.TOUCH)])
def test_an_end_that_the_elastica_rules_out_is_refused(
    monkeypatch: pytest.MonkeyPatch, height: float, end: End
) -> None:
    """A snap at 1.2 L*, a touch at 3 L*: the solver's run is as it is, the answer to a user is cross-checked."""
    monkeypatch.setattr(critical_point, "_find", lambda *_: critical_point._Found(end, 0.1, 5.0, np.empty((0, 2)), 8.4))
    with pytest.raises(CoarseMeshError, match=f"ends in a {end.value}"):
        find(Scene(length=0.6, height=height, eta_b=3780.0, model="solid"))


def test_printed_law_cannot_hold_an_upright_strip() -> None:
    """docs/physics.md, section 2: its bending stiffness goes with the square of the cosine of the slope."""
    with pytest.raises(SolveError, match="eigenvalues"):
        static.solve_height(StripModel(12.0, 0.05, law="printed"), 3.0, 1.0)


def test_unusable_mesh_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="order"):
        StripModel(10.0, 0.05, order=3).model(20)
    with pytest.raises(InvalidInputError, match="elements_across"):
        StripModel(10.0, 0.05, order=1, across=1).model(20)
    with pytest.raises(InvalidInputError, match="elements"):
        StripModel(10.0, 0.05).model(np.array([0.0, 2.0, 1.0, 10.0]))


def test_gripper_motion_is_prescribed(run: static.XRun) -> None:
    problem = StripProblem(run.problem.model, AlongX(3.0))
    assert problem.prescribed_values(2.5).tolist() == [2.5, 3.0, 0.0, 0.0]
    assert problem.prescribed_rates(2.5).tolist() == [1.0, 0.0, 0.0, 0.0]


def test_node_weights_integrate() -> None:
    s = np.array([0.0, 1.0, 3.0, 3.5])
    assert node_weights(s) == pytest.approx([0.5, 1.5, 1.25, 0.25])
    assert node_weights(s) @ (2.0 + 3.0 * s) == pytest.approx(2.0 * 3.5 + 1.5 * 3.5**2)

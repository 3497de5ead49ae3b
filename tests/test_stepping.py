"""Fixed steps with friction that remembers, and the smallest friction with which an R-path is followed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest
import xarray as xr

from stripfold.analysis import friction, path_friction, path_statics
from stripfold.analysis.assess import mesh_for
from stripfold.analysis.contact import touches
from stripfold.analysis.friction import Run
from stripfold.analysis.path_friction import Step, load_incrementally, steps_on
from stripfold.analysis.static import StripModel
from stripfold.effects import Effect, Hysteresis, Pull
from stripfold.errors import InvalidInputError, LostStabilityError, NewtonError, SolveError
from stripfold.material import Material
from stripfold.models.solid import Solid
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.geometric import triangular
from stripfold.paths.rpath import plan_r_path
from stripfold.problem import AlongPiece, StripProblem
from stripfold.solve import continuation, newton
from stripfold.solve.problem import Point

STRIP = StripModel(12.0, 0.06)
CORNERS = [(-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2), (6.0, 0.0)]
STEP = 0.5
MATERIAL = Material(3780.0)
OTHER = Material(8.0 * 3780.0, eta_m=2e-3, rho_a=3.0)
"""L* half as long, and the same thickness / L*: in solver units the same strip."""
LENGTH = 14.0


def polygon(*corners: tuple[float, float]) -> GripperPath:
    """Straight from corner to corner."""
    pieces: list[Piece] = []
    for ends in pairwise(corners):
        pieces.append(Piece.through(np.array(ends), pieces[-1].end if pieces else 0.0, "side"))
    return GripperPath("polygon", tuple(pieces))


LOW = polygon(*CORNERS)
"""A path without a snap."""


def none(model: Solid, q: np.ndarray) -> tuple[Effect, ...]:
    """No effects."""
    return ()


def both(model: Solid, q: np.ndarray) -> tuple[Effect, ...]:
    """Both laws at once."""
    return Pull(model, 0.05, q), Hysteresis.of(model, 0.02, slack=q)


def without_friction(step: Step) -> Point:
    """The equilibrium without friction near a step's, stable or not."""
    bare = StripProblem(step.problem.model, step.problem.motion)
    return continuation.start(bare, step.point.q, step.point.lam, step.point.active, 1.0, path_statics.ROBUST_STEPS)


@pytest.fixture(scope="module")
def low_model() -> Solid:
    return mesh_for(STRIP, LOW, 2.0)


@pytest.fixture(scope="module")
def low_steps(low_model: Solid) -> list[Step]:
    """The low path with both laws, as far as the second corner."""
    return list(load_incrementally(low_model, replace(LOW, pieces=LOW.pieces[:2]), both, 0.4))


@pytest.fixture(scope="module")
def stored() -> tuple[xr.Dataset, list[Run]]:
    """What friction an R-path needs, and the runs that were stored."""
    runs: list[Run] = []
    follow = friction.follow

    def keep(*given: object, **more: object) -> Run:
        run = follow(*given, **more)  # type: ignore[arg-type]
        if more.get("to_end"):
            runs.append(run)
        return run

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "follow", keep)
        return friction.run(MATERIAL, LENGTH * MATERIAL.gravity_length, STEP, 3.0), runs


class TestSteps:
    """Where the steps are."""

    def test_they_are_equal_within_a_piece_and_end_at_corners(self):
        path = polygon((0.0, 0.0), (0.0, 1.2), (2.5, 1.2))
        found = list(steps_on(path, 0.1))
        assert [piece for piece, _ in found] == [0] * 12 + [1] * 25
        np.testing.assert_allclose([s for _, s in found], np.arange(1, 38) * 0.1, atol=1e-12)
        uneven = list(steps_on(path, 0.5))
        assert [s for _, s in uneven] == pytest.approx([0.4, 0.8, 1.2, 1.7, 2.2, 2.7, 3.2, 3.7])
        assert uneven[2] == (0, 1.2)
        assert list(steps_on(path, 10.0)) == [(0, 1.2), (1, pytest.approx(3.7))]

    @pytest.mark.parametrize("size", [0.0, -0.1, LOW.length * 1.01, float("nan"), inf])
    def test_a_step_that_is_none(self, low_model: Solid, size: float):
        with pytest.raises(InvalidInputError, match="step"):
            next(load_incrementally(low_model, LOW, none, size))


class TestLoadingIncrementally:
    """The states."""

    def test_without_effects_it_is_the_arc_length_result(self, low_model: Solid):
        """Truth: the same states, found by continuation; at every corner, and at the end."""
        segment = path_statics.follow(low_model, LOW)
        steps = list(load_incrementally(low_model, LOW, none, 0.7))
        for s in (*LOW.corners, LOW.length):
            a = next(p for p in segment.points if p.lam == s)
            b = next(x.point for x in steps if x.point.lam == s)
            assert np.abs((a.q - b.q)[low_model.middle]).max() < 1e-6
        assert [step.piece for step in steps] == [piece for piece, _ in steps_on(LOW, 0.7)]
        assert friction.effects_of("pull", 0.0)(low_model, steps[0].point.q) == ()
        weak = load_incrementally(low_model, LOW, lambda model, q: (Pull(model, 0.0, q),), 0.7)
        for step, other in zip(steps[:6], weak, strict=False):
            np.testing.assert_allclose(step.point.q, other.point.q, atol=1e-9)

    def test_each_step_is_an_equilibrium_with_its_friction(self, low_steps: list[Step], low_model: Solid):
        for step in low_steps:
            residual = step.problem.residual(step.point.q, step.point.lam)
            assert residual[step.point.active].min() > -1e-7
            residual[step.problem.prescribed] = residual[step.point.active] = 0.0
            assert np.abs(residual).max() < 1e-7
            place = step.point.q[low_model.middle[0]] - [STRIP.length / 2.0, 0.0]
            np.testing.assert_allclose(place, LOW.position(step.point.lam), atol=1e-9)
            assert step.point.negatives == 0

    def test_effects_remember_the_step_before(self, low_steps: list[Step], low_model: Solid):
        first = path_statics.from_flat(low_model, LOW)
        np.testing.assert_array_equal(low_steps[0].problem.effects[0].q_prev, first.q)
        for before, step in pairwise(low_steps):
            pull, hysteresis = step.problem.effects
            np.testing.assert_array_equal(pull.q_prev, before.point.q)
            way = np.linalg.norm((step.point.q - before.point.q)[low_model.middle], axis=1).max()
            assert step.moved == pytest.approx(way)
            lost = before.problem.effects[1].dissipation(before.point.q)
            assert hysteresis.dissipated == pytest.approx(before.problem.effects[1].dissipated + lost)
        assert low_steps[-1].problem.effects[1].dissipated > 1e-3
        # What is reported of a step's stability is with the friction: without it the eigenvalue is lower by k_f.
        step = low_steps[len(low_steps) // 2]
        bare = without_friction(step)
        assert step.point.eigenvalues[0] > bare.eigenvalues[0] + 0.04

    def test_a_state_is_found_in_several_substeps(
        self, low_model: Solid, low_steps: list[Step], monkeypatch: pytest.MonkeyPatch
    ):
        """The memory is kept on it: the state is the same as by one solve."""
        before, step = low_steps[-3:-1]
        whole = step.point.lam - before.point.lam
        solve, tried = newton.solve, []

        def near(problem, q, lam, *rest, **more):  # type: ignore[no-untyped-def]
            tried.append((lam - before.point.lam) / whole)
            if np.linalg.norm((q - before.point.q)[low_model.middle], axis=1).max() == 0.0 and tried[-1] > 0.3:
                raise NewtonError("planted")
            return solve(problem, q, lam, *rest, **more)

        monkeypatch.setattr(path_friction.newton, "solve", near)
        there = path_friction._step(step.problem, before.point.state, before.point.q, step.point.lam)
        assert tried[:3] == pytest.approx([1.0, 0.5, 0.25])
        assert tried[-1] == 1.0
        assert there.lam == step.point.lam
        np.testing.assert_allclose(there.q, step.point.q, atol=1e-7)

    def test_no_state_is_an_error(self, low_steps: list[Step], monkeypatch: pytest.MonkeyPatch):
        before, step = low_steps[-3:-1]
        shortest = []

        def fails(problem, q, lam, *rest, **more):  # type: ignore[no-untyped-def]
            shortest.append(lam - before.point.lam)
            raise NewtonError("planted")

        monkeypatch.setattr(path_friction.newton, "solve", fails)
        with pytest.raises(LostStabilityError, match="planted") as caught:
            path_friction._step(step.problem, before.point.state, before.point.q, step.point.lam)
        assert caught.value.parameter == before.point.lam
        assert min(shortest) == pytest.approx((step.point.lam - before.point.lam) / 64.0)

    def test_a_strip_that_snaps_is_lost(self):
        """Too little friction is none; the steps up to the snap have been handed out."""
        strip, path = StripModel(20.0, 0.0594), triangular(20.0)
        critical = np.sqrt(2.0) * (10.0 + 3.392)  # found by continuation
        handed_out: list[Step] = []

        def go() -> None:
            for step in load_incrementally(mesh_for(strip, path, 2.0), path, friction.effects_of("pull", 1e-4), 0.1):
                handed_out.append(step)

        with pytest.raises(LostStabilityError, match="does not follow") as caught:
            go()
        assert critical - 0.02 < caught.value.parameter < critical + 0.12
        assert 0.0 < caught.value.parameter - handed_out[-1].point.lam < 0.1 + 2e-3
        assert max(step.moved for step in handed_out) < 1.0

    @pytest.mark.parametrize("found", [True, False])
    @pytest.mark.parametrize(
        ("moved", "negatives", "lost"), [(1.4, 0, False), (4.9, 0, False), (5.2, 0, True), (0.1, 1, True)]
    )
    def test_what_counts_as_lost(
        self, low_model: Solid, monkeypatch: pytest.MonkeyPatch, moved: float, negatives: int, lost: bool, found: bool
    ):
        """Not stable; or ten times the step of 0.5 L*, and no states between that show how it went there."""
        step, closely = path_friction._step, path_friction._in_substeps

        def planted(problem, before, guess, travelled):  # type: ignore[no-untyped-def]
            point = step(problem, before, guess, travelled)
            if travelled < 6.0:
                return point
            q = before.q.copy()
            q[low_model.middle[5, 1]] += moved
            return replace(point, state=replace(point.state, q=q), negatives=negatives)

        monkeypatch.setattr(path_friction, "_step", planted)
        looked: list[float] = []

        def look(problem, before, travelled):  # type: ignore[no-untyped-def]
            looked.append(travelled)
            return closely(problem, before, travelled) if found else None

        monkeypatch.setattr(path_friction, "_in_substeps", look)
        path = polygon((-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2))
        size = 10.2 / 20
        steps = load_incrementally(low_model, path, none, size)
        while (new := next(steps)).point.lam < 6.0 - size:
            pass
        assert not looked
        if negatives or (lost and not found):
            with pytest.raises(LostStabilityError, match="does not follow"):
                next(steps)
        else:
            # Where states between were found, the last of them counts.
            expected = moved if not looked_at(moved, size) or not found else None
            moved_on = next(steps).moved
            assert moved_on == pytest.approx(expected) if expected else moved_on < path_friction.RATIO_TO_CHECK * size
        assert bool(looked) == looked_at(moved, size)
        assert new.moved < 5.0

    def test_intermediate_states_distinguish_fast_motion_from_a_jump(
        self, low_model: Solid, monkeypatch: pytest.MonkeyPatch
    ):
        """Equal ways to all of them are haste; one far from the last is a jump, wherever in the step it is."""
        path = polygon((-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2))
        before = next(load_incrementally(low_model, path, none, 0.5)).point.state
        problem = StripProblem(low_model, AlongPiece(path.pieces[0], low_model.length))
        place = low_model.middle[5, 1]

        def solving(ways):  # type: ignore[no-untyped-def]
            left = iter(ways)
            height = [before.q[place]]

            def solve(problem, q, lam, active, options):  # type: ignore[no-untyped-def]
                height[0] += next(left)
                q = before.q.copy()
                q[place] = height[0]
                return replace(before, q=q, lam=lam)

            return solve

        count, way = path_friction.SUBSTEPS, 0.5 / path_friction.SUBSTEPS
        for ways, lost in (
            ([9.0 * way] * count, False),
            ([*[way] * 8, 11.0 * way, *[way] * 7], True),
            ([1.4, *[way] * (count - 1)], False),
            ([1.6, *[way] * (count - 1)], True),
        ):
            monkeypatch.setattr(path_friction.newton, "solve", solving(ways))
            if lost:
                with pytest.raises(LostStabilityError, match="it snaps"):
                    path_friction._in_substeps(problem, before, before.lam + 0.5)
            else:
                assert path_friction._in_substeps(problem, before, before.lam + 0.5).lam == pytest.approx(
                    before.lam + 0.5
                )


def looked_at(moved: float, size: float) -> bool:
    """Whether a step of this way is looked at again."""
    return moved > path_friction.RATIO_TO_CHECK * size


class TestFriction:
    """The smallest that suffices."""

    @pytest.mark.parametrize("threshold", [1e-4, 0.01, 0.0101, 0.3, 20.0])
    @pytest.mark.parametrize("law", friction.LAWS)
    def test_the_search_brackets_any_threshold(self, monkeypatch: pytest.MonkeyPatch, law: str, threshold: float):
        plan = plan_r_path(LENGTH)
        tried: list[float] = []

        def follow(model, plan, law, strength, step):  # type: ignore[no-untyped-def]
            tried.append(strength)
            x = plan.first_touch + (0.09 if strength >= threshold else -0.11)
            return Run(law, strength, step, (), 0, x, "")

        monkeypatch.setattr(friction, "follow", follow)
        fails, suffices = friction.smallest(None, plan, law, 0.25)  # type: ignore[arg-type]
        assert fails < threshold <= suffices
        assert suffices <= friction.NARROW * fails
        assert tried[0] == (0.04 if law == "pull" else 0.01)
        assert len(tried) < 20
        assert {fails, suffices} <= set(tried)

    @pytest.mark.parametrize("x", [float("nan"), 5.0])
    def test_none_suffices(self, monkeypatch: pytest.MonkeyPatch, x: float):
        plan = plan_r_path(LENGTH)
        monkeypatch.setattr(friction, "follow", lambda m, p, law, k, step: Run(law, k, step, (), None, x, ""))
        with pytest.raises(SolveError, match="pull friction"):
            friction.smallest(None, plan, "pull", 0.25)  # type: ignore[arg-type]

    def test_bracket(self, stored: tuple[xr.Dataset, list[Run]]):
        """Truth: the strip followed with either end, to the planned touch or elsewhere."""
        data, runs = stored
        plan = plan_r_path(LENGTH)
        model = runs[0].steps[0].problem.model
        for law in friction.LAWS:
            fails, suffices = (float(data[name].sel(law=law)) for name in ("fails", "suffices"))
            assert fails < suffices <= 1.1 * fails
            for strength, expected in ((fails, False), (suffices, True)):
                run = friction.follow(model, plan, law, strength, STEP)
                assert run.followed(plan) is expected
                assert run.touch == len(run.steps) - 1
                assert [touches(model, step.point) for step in run.steps] == [False] * run.touch + [True]

    def test_the_pull_goes_by_force_times_step(self):
        """k_f times the step is what counts; the unit of a pull is the mass times the way."""
        plan = plan_r_path(20.0)
        model = friction.model_for(StripModel(20.0, 0.0594), plan, 2.0)
        for strength, expected in ((0.0055, False), (0.012, True)):
            run = friction.follow(model, plan, "pull", strength / 0.4, 0.4)
            assert run.followed(plan) is expected
            assert (run.law, run.strength, run.step, run.lost) == ("pull", strength / 0.4, 0.4, "")

    def test_a_lost_strip_says_so(self, monkeypatch: pytest.MonkeyPatch, stored: tuple[xr.Dataset, list[Run]]):
        _, runs = stored

        def stops(*_: object):  # type: ignore[no-untyped-def]
            yield runs[0].steps[0]
            raise LostStabilityError("planted")

        monkeypatch.setattr(friction, "load_incrementally", stops)
        model, plan = runs[0].steps[0].problem.model, plan_r_path(LENGTH)
        run = friction.follow(model, plan, "pull", 1.0, STEP)
        assert (run.lost, run.touch, len(run.steps)) == ("planted", None, 1)
        assert np.isnan(run.touch_x)
        assert not run.followed(plan)
        monkeypatch.setattr(friction, "follow", lambda *_, **__: run)
        monkeypatch.setattr(friction, "smallest", lambda *_: (0.1, 0.2))
        with pytest.raises(SolveError, match="planted"):
            friction.run(MATERIAL, LENGTH * MATERIAL.gravity_length, STEP, 3.0)

    def test_laws(self, low_model: Solid):
        q = path_statics.from_flat(low_model, LOW).q
        (pull,) = friction.effects_of("pull", 0.3)(low_model, q)
        assert isinstance(pull, Pull)
        assert pull.k_f == 0.3
        (hysteresis,) = friction.effects_of("hysteresis", 0.3)(low_model, q)
        assert isinstance(hysteresis, Hysteresis)
        assert hysteresis.moment == 0.3
        for effect in (pull, hysteresis):
            assert np.abs(effect.force(q)).max() < 1e-12

    def test_without_friction(self, stored: tuple[xr.Dataset, list[Run]]):
        """The planned state itself is not stable where friction holds it."""
        _, runs = stored
        bare = [without_friction(step) for run in runs for step in run.steps[run.touch - 6 : run.touch]]
        held = [step for run in runs for step in run.steps[run.touch - 6 : run.touch]]
        for point, step in zip(bare, held, strict=True):
            assert point.lam == step.point.lam
            problem = StripProblem(step.problem.model, step.problem.motion)
            residual = problem.residual(point.q, point.lam)
            residual[problem.prescribed] = residual[point.active] = 0.0
            assert np.abs(residual).max() < 1e-7
            middle = problem.model.mid_surface
            assert 0.01 < np.abs(middle(point.q) - middle(step.point.q)).max() < 1.0
        assert max(point.negatives for point in bare) == 1
        assert max(step.point.negatives for step in held) == 0


class TestFrictionData:
    """What is stored, in SI."""

    def test_numbers_are_those_of_the_runs(self, stored: tuple[xr.Dataset, list[Run]]):
        data, runs = stored
        unit, plan = MATERIAL.gravity_length, plan_r_path(LENGTH)
        for name, variable in data.variables.items():
            assert variable.attrs["units"], name
            assert variable.attrs["long_name"], name
        assert data.attrs["relative_length"] == pytest.approx(LENGTH)
        assert data.attrs["step"] == pytest.approx(STEP * unit)
        assert data.attrs["k_f"] == pytest.approx(float(data["suffices"][0]) * 9.81 / unit)
        # M_0 as a share of the bending stiffness D = rho_a / eta_b times 1/L*.
        stiffness = MATERIAL.rho_a / MATERIAL.eta_b
        assert data.attrs["M_0"] == pytest.approx(float(data["suffices"][1]) * stiffness / unit)
        assert data.attrs["planned_touch_x"] == pytest.approx(plan.first_touch * unit)
        assert data.attrs["landing_x"] == pytest.approx(plan.landing * unit)
        for law, run in zip(friction.LAWS, runs, strict=True):
            chosen = data.sel(law=law)
            assert run.law == law
            assert run.strength == float(chosen["suffices"])
            assert float(chosen["touch_x"]) == pytest.approx(data.attrs["planned_touch_x"], abs=0.1 * unit)
            i = int(chosen["touch_step"])
            assert i == run.touch
            z, x = chosen["z"].values, chosen["x"].values
            came = np.flatnonzero((z[i] == 0.0) & (z[i - 1] > 0.0))
            assert np.abs(x[i, came] - float(chosen["touch_x"])).min() < 0.3 * unit
            travelled = chosen["travelled"].values
            assert travelled[-1] == pytest.approx(plan.path.length * unit)
            assert chosen["pseudo_time"].values == pytest.approx(travelled / travelled[-1])
            place = np.array([plan.path.position(s / unit) for s in travelled]) * unit
            np.testing.assert_allclose(np.stack([x[:, 0], z[:, 0]], axis=1), place, atol=1e-9)

    def test_forces_and_deviation_by_what_is_stored(self, stored: tuple[xr.Dataset, list[Run]]):
        """The pull from the stored shapes: k_f times the weight that was moved; the deviation from the plan."""
        data, _ = stored
        pull = data.sel(law="pull")
        x, z, arc = (pull[name].values for name in ("x", "z", "arc"))
        way = np.hypot(np.diff(x, axis=0), np.diff(z, axis=0))
        force = data.attrs["k_f"] * MATERIAL.rho_a * np.trapezoid(way, arc, axis=1)
        np.testing.assert_allclose(pull["pulling_force"].values[1:], force, rtol=0.02)
        np.testing.assert_allclose(pull["ratio"], pull["pulling_force"] / pull["gripper_force"])
        assert np.all(data["pulling_force"].sel(law="hysteresis") == 0.0)
        plan, unit = plan_r_path(LENGTH), MATERIAL.gravity_length
        for i in (5, len(x) // 2, len(x) - 1):
            planned = unit * plan.mid_surface(pull["travelled"].values[i] / unit, arc / unit)
            away = np.hypot(x[i] - planned[:, 0], z[i] - planned[:, 1]).max()
            assert float(pull["deviation"][i]) == pytest.approx(away, rel=1e-6)
        # Lifted without a horizontal force the gripper carries no more than what hangs from it.
        lifted = float(pull["gripper_force"][5])
        weight = MATERIAL.rho_a * 9.81 * np.trapezoid((z[5] > 1e-3 * unit).astype(float), arc)
        assert 0.5 * weight < lifted < weight

    def test_eigenvalue_is_without_friction(self, stored: tuple[xr.Dataset, list[Run]]):
        data, runs = stored
        seconds = np.sqrt(MATERIAL.gravity_length / 9.81)
        for law, run in zip(friction.LAWS, runs, strict=True):
            before = data["eigenvalue"].sel(law=law).values[: run.touch]
            assert before[:10].min() > 0.0
            assert before[-1] < 0.0
            step = run.steps[run.touch - 2]
            bare = StripProblem(step.problem.model, step.problem.motion)
            assert isinstance(step.problem.motion, AlongPiece)
            towards = step.point.tangent
            expected = continuation.evaluate(bare, step.point.state, towards).eigenvalues[0]
            assert before[run.touch - 2] * seconds**2 == pytest.approx(expected, rel=1e-6)

    def test_another_material_of_the_same_ratios(
        self, stored: tuple[xr.Dataset, list[Run]], monkeypatch: pytest.MonkeyPatch
    ):
        """The same numbers of another size: by hand L* is half, rho_a g L* is 3/2, a second 1/sqrt(2)."""
        data, runs = stored
        brackets = {law: tuple(float(data[n].sel(law=law)) for n in ("fails", "suffices")) for law in friction.LAWS}
        seen: list[tuple[float, float]] = []

        def smallest(model, plan, law, step):  # type: ignore[no-untyped-def]
            seen.append((model.length, model.thickness if hasattr(model, "thickness") else 0.0))
            return brackets[law]

        monkeypatch.setattr(friction, "smallest", smallest)
        by_law = {run.law: run for run in runs}
        monkeypatch.setattr(friction, "follow", lambda m, p, law, *_, **__: by_law[law])
        other = friction.run(OTHER, LENGTH * OTHER.gravity_length, STEP, 3.0)
        assert seen[0][0] == pytest.approx(LENGTH)
        factors = {
            "m": 0.5,
            "N m-1": 1.5,
            "s-2": 2.0,
            "1": 1.0,
        }
        for name, variable in data.data_vars.items():
            factor = factors[variable.attrs["units"]]
            np.testing.assert_allclose(other[name], factor * variable, rtol=1e-9, atol=1e-12, err_msg=str(name))
        assert other.attrs["k_f"] == pytest.approx(2.0 * data.attrs["k_f"])
        assert other.attrs["M_0"] == pytest.approx(0.75 * data.attrs["M_0"])
        assert other.attrs["step"] == pytest.approx(0.5 * data.attrs["step"])
        assert other.attrs["rho_a"] == 3.0

        nan = float("nan")
        ways = {"a": xr.Dataset(attrs={"touch_x": [nan, 0.08]}), "b": xr.Dataset(attrs={"touch_x": [0.08, 0.07]})}
        table = friction.table({"b": other, "a": data}, ways, {"a": "A", "b": "B"})
        assert table["two_ways"].values.tolist() == [1.0, 0.0]
        ways["a"] = xr.Dataset(attrs={"reason": "there is none"})
        table = friction.table({"b": other, "a": data}, ways, {"a": "A", "b": "B"})
        assert table["two_ways"].values.tolist() == [0.0, 0.0]
        assert table["material"].values.tolist() == ["a", "b"]
        assert table["label"].values.tolist() == ["A", "B"]
        assert all(v.attrs["units"] and v.attrs["long_name"] for v in table.variables.values())
        for material, source in (("a", data), ("b", other)):
            row = table.sel(material=material)
            for name in ("eta_b", "gravity_length", "relative_length", "step", "k_f", "M_0", "planned_touch_x"):
                assert float(row[name]) == source.attrs[name]
            for law, run in by_law.items():
                one, cell = source.sel(law=law), row.sel(law=law)
                until = slice(0, run.touch + 1)
                for name in ("fails", "suffices", "touch_x"):
                    assert float(cell[name]) == float(one[name])
                assert float(cell["ratio_max"]) == one["ratio"].values[until].max()
                assert float(cell["ratio_median"]) == np.median(one["ratio"].values[until])
                assert float(cell["eigenvalue_min"]) == one["eigenvalue"].values[until].min()
                assert float(cell["deviation_max"]) == one["deviation"].values.max()
                assert float(cell["deviation_end"]) == one["deviation"].values[-1]

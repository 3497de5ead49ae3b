"""Steps with friction that remembers, and the smallest friction with which an R-path is followed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import inf, nan

import numpy as np
import pytest
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, LostStabilityError, SolveError
from stripfold.base.material import Material
from stripfold.follow import contact_branch, contact_events, path_friction
from stripfold.follow.assess import shape_error
from stripfold.follow.contact_branch import BranchCrossing, BranchPoint
from stripfold.follow.path_friction import (
    Step,
    effects_of,
    load_incrementally,
    load_incrementally_from,
    steps_on,
    with_effects,
)
from stripfold.follow.static import StripModel, lift, solve_height
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.geometric import triangular
from stripfold.paths.rpath import half_fold, plan_r_path
from stripfold.solve import continuation
from stripfold.solve.continuation import Event
from stripfold.strip.contact_mesh import FOLDED, INTERVAL, POINT
from stripfold.strip.effects import Effect, Hysteresis, Pull
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, Lift
from tasks import friction
from tasks.friction import Run, Sample

ROD = StripModel(12.0, 0.06, kind="rod")
MESH = ROD.contact_mesh(2.0, memory=True)
CORNERS = [(-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2), (6.0, 0.0)]
STEP = 0.25
MATERIAL = Material(3780.0)
OTHER = Material(8.0 * 3780.0, eta_m=2e-3, rho_a=3.0)
"""L* half as long, and the same thickness / L*: in solver units the same strip."""
LENGTH = 14.0


def polygon(*corners: tuple[float, float]) -> GripperPath:
    """Straight from corner to corner."""
    return GripperPath("polygon", pieces_through(("side", np.array(ends)) for ends in pairwise(corners)))


LOW = polygon(*CORNERS)
"""A path without a snap: the sag touches first."""


def none(model: Model, q: Array) -> tuple[Effect, ...]:
    """No effects."""
    return ()


def both(model: Model, q: Array) -> tuple[Effect, ...]:
    """Both laws at once."""
    return Pull(model, 0.05, q), Hysteresis.of(model, 0.02, slack=q)


def unbalanced(problem: MovingContact, q: Array, lam: float) -> float:
    """Largest force that nothing balances."""
    residual = problem.residual(q, lam)
    residual[problem.prescribed] = 0.0
    return float(np.abs(residual).max())


def steps_until(lam: float, steps: Iterator[Step]) -> Iterator[Step]:
    """The first steps, up to one past a value of lambda."""
    for step in steps:
        yield step
        if step.lam > lam:
            return


def lifted(height: float, kind: str = "rod") -> BranchPoint:
    """A strip of 16 L* at the start of its motion along x."""
    ((_, at),) = lift(StripModel(16.0, 0.06, kind=kind).contact_mesh(2.0, memory=True), [height])
    start = float(at.point.q[at.problem.mesh.model.middle[0, 0]])
    return contact_branch.solved(MovingContact(at.problem.mesh, AlongX(height)), at.point.q, start)


@pytest.fixture(scope="module")
def low_steps() -> list[Step]:
    """The low path with both laws, as far as the second corner."""
    return list(load_incrementally(MESH, replace(LOW, pieces=LOW.pieces[:2]), both, 0.4))


@pytest.fixture(scope="module")
def stored() -> tuple[xr.Dataset, list[Run]]:
    """What friction an R-path needs, and the runs that were stored."""
    runs: list[Run] = []
    smallest = friction.smallest

    def keep(*given: object) -> tuple[float, Run]:
        fails, run = smallest(*given)  # type: ignore[arg-type]
        runs.append(replace(run, rest=tuple(run.rest)))
        return fails, runs[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "smallest", keep)
        return friction.run(MATERIAL, LENGTH * MATERIAL.gravity_length, STEP, 2.0), runs


class TestSteps:
    """Where the steps are."""

    def test_they_are_equal_within_a_piece_and_end_at_corners(self):
        path = polygon((0.0, 0.0), (0.0, 1.2), (2.5, 1.2))
        found = list(steps_on(path, 12.0, 0.1))
        first, second = (AlongPath(piece, 12.0) for piece in path.pieces)
        assert [motion for motion, _ in found] == [first] * 12 + [second] * 25
        np.testing.assert_allclose([s for _, s in found], np.arange(1, 38) * 0.1, atol=1e-12)
        uneven = list(steps_on(path, 12.0, 0.5))
        assert [s for _, s in uneven] == pytest.approx([0.4, 0.8, 1.2, 1.7, 2.2, 2.7, 3.2, 3.7])
        assert uneven[2] == (first, 1.2)
        assert list(steps_on(path, 12.0, 10.0)) == [(first, 1.2), (second, pytest.approx(3.7))]

    @pytest.mark.parametrize("size", [0.0, -0.1, LOW.length * 1.01, float("nan"), inf])
    def test_a_step_that_is_none(self, size: float):
        with pytest.raises(InvalidInputError, match="step"):
            next(load_incrementally(MESH, LOW, none, size))


class TestLoadingIncrementally:
    """The states."""

    @pytest.mark.parametrize("size", [0.3, 0.7])
    def test_without_effects_it_is_the_branch(self, size: float):
        """Truth: the state at the first corner by continuation, on a mesh of its own."""
        motion = AlongPath(LOW.pieces[0], 12.0)
        corner = LOW.pieces[0].end
        end = Event("corner", lambda point, _: point.lam >= corner, tolerance=inf)
        branch = contact_branch.follow(
            contact_branch.from_flat(ROD.contact_mesh(1.0), motion, 0.01), contact_branch.STEPS, lambda _: [end]
        )
        before = next(item.before for item in branch if isinstance(item, BranchCrossing))
        expected = continuation.step_to(before.problem, before.point, corner, contact_branch.STEPS)
        step = next(s for s in load_incrementally(MESH, LOW, none, size) if s.lam == corner)
        assert step.at.contact[0] == pytest.approx(expected.q[-1], abs=1e-3)
        s = np.linspace(0.0, 12.0, 50)
        places = [
            at.problem.at(at.contact).model.resampled_mid_surface(at.point.q[: at.problem.n], s)
            for at in (step.at, BranchPoint(before.problem, expected))
        ]
        np.testing.assert_allclose(places[0], places[1], atol=1e-3)

    def test_pieces_and_friction_of_strength_zero(self):
        begin = replace(LOW, pieces=LOW.pieces[:2])
        steps = list(load_incrementally(MESH, begin, none, 2.0))
        assert [(step.at.problem.motion, step.lam) for step in steps] == list(steps_on(begin, 12.0, 2.0))
        assert path_friction.effects_of("pull", 0.0)(MESH(np.ones(1)).model, np.zeros(1)) == ()
        weak = load_incrementally(MESH, LOW, lambda model, q: (Pull(model, 0.0, q),), 2.0)
        for step, other in zip(steps[:4], weak, strict=False):
            np.testing.assert_allclose(step.at.point.q, other.at.point.q, atol=1e-8)

    def test_each_step_is_an_equilibrium_with_its_friction(self, low_steps: list[Step]):
        for step in low_steps:
            at = step.at
            assert unbalanced(at.problem, at.point.q, step.lam) < 1e-7
            problem, point = step.on_mesh
            place = point.q[problem.model.middle[0]] - [6.0, 0.0]
            np.testing.assert_allclose(place, LOW.position(step.lam), atol=1e-9)
            assert at.point.negatives == 0
            assert step.touches or contact_events.clearance(at.problem, at.point.q)[0] > -1e-4
            # The same forces with the contact at nodes: the floor pushes.
            residual = problem.residual(point.q, step.lam)
            others = np.setdiff1d(np.arange(problem.size), np.concatenate([problem.prescribed, problem.bounded]))
            held = [] if problem.model.slopes is None else problem.model.slopes
            assert np.abs(residual[np.setdiff1d(others, held)]).max() < 1e-7
        assert [step.touches for step in low_steps] == sorted(step.touches for step in low_steps)
        assert low_steps[-1].at.topology in (POINT, INTERVAL)

    def test_effects_remember_the_step_before(self, low_steps: list[Step]):
        compared = 0
        for before, step in pairwise(low_steps):
            if step.at.problem.mesh is not before.at.problem.mesh:
                continue
            compared += 1
            q, problem = before.at.point.q, before.at.problem
            pull, hysteresis = step.at.problem.effects
            np.testing.assert_array_equal(pull.q_prev, q[: problem.n])
            np.testing.assert_array_equal(step.at.problem.remembered, before.at.contact)
            old = problem.at(before.at.contact).problem.effects[1]
            lost = old.dissipation(q[: problem.n])
            assert hysteresis.dissipated == pytest.approx(old.dissipated + lost, rel=1e-12)
        assert compared > 10
        assert low_steps[-1].at.problem.effects[1].dissipated > 1e-3
        # What is reported of a step's stability is with the friction: without it the eigenvalue is lower by k_f.
        at = next(step.at for step in low_steps if step.at.problem.motion.path == LOW.pieces[1])
        bare = MovingContact(at.problem.mesh, at.problem.motion)
        free = continuation.evaluate(bare, at.point.state, at.point.tangent)
        assert at.point.eigenvalues[0] > free.eigenvalues[0] + 0.04

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_a_step_begins_with_the_last_state_and_ends_with_its_friction_alone(self, kind: str):
        """The force that the update takes away is there at first; then in proportion to lambda no longer."""
        start = lifted(3.0, kind)
        places = [(start.problem.motion, start.point.lam + 0.2 * n) for n in range(1, 4)]
        at = list(load_incrementally_from(with_effects(start, both), places))[-1].at
        end = at.point.lam + 0.2
        step = path_friction._StepProblem.after(at, end)
        accepted = at.problem.accepted(at.point.q)
        q, lam = at.point.q, at.point.lam
        assert unbalanced(step, q, lam) < 1e-7
        assert unbalanced(accepted, q, lam) > 1e-4
        np.testing.assert_array_equal(step.residual(q, end), accepted.residual(q, end))
        force, _, rate = step.linearise(q, lam + 0.05)
        np.testing.assert_allclose(force, step.residual(q, lam + 0.05), atol=1e-13)
        slope = (step.residual(q, lam + 0.06) - step.residual(q, lam + 0.04)) / 0.02
        np.testing.assert_allclose(rate, slope, atol=1e-10)

    @pytest.mark.parametrize("law", friction.LAWS)
    def test_one_solve_or_the_branch(self, law: str):
        """Both ways to a step's end find the same state."""
        start = lifted(3.0)
        at = with_effects(start, path_friction.effects_of(law, 0.05))
        for _ in range(4):
            once = path_friction._at_once(at, at.point.lam + 0.2)
            along = path_friction._along_branch(at, at.point.lam + 0.2, locate=True)
            assert once is not None
            assert along.point.lam == once.point.lam
            np.testing.assert_allclose(along.point.q, once.point.q, atol=1e-6)
            at = once


class TestLoss:
    """A strip is lost exactly at a limit point."""

    @pytest.mark.parametrize("size", [0.1, 1.0, 3.0])
    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_without_friction_it_is_the_located_critical_point(self, size: float, kind: str):
        """Also in steps so long that a state behind the snap is at their end."""
        start = lifted(3.0, kind)
        critical = solve_height(StripModel(16.0, 0.06, kind=kind), 3.0, 2.0).lam
        places = ((start.problem.motion, start.point.lam + size * n) for n in range(1, 200))
        with pytest.raises(LostStabilityError, match="limit point") as caught:
            list(load_incrementally_from(with_effects(start, none), places))
        assert caught.value.parameter == pytest.approx(critical, rel=1e-3)

    def test_hysteresis_delays_it(self):
        start = lifted(3.0)
        critical = solve_height(StripModel(16.0, 0.06, kind="rod"), 3.0, 2.0).lam

        def limit(strength: float) -> float:
            places = ((start.problem.motion, start.point.lam + 0.2 * n) for n in range(1, 200))
            acting = with_effects(start, path_friction.effects_of("hysteresis", strength))
            with pytest.raises(LostStabilityError, match="limit point") as caught:
                list(load_incrementally_from(acting, places))
            return caught.value.parameter

        assert critical + 0.02 < limit(0.005) < limit(0.01) < critical + 0.5

    def test_the_pull_lets_the_strip_down(self):
        """It acts like a viscosity: with enough of it the strip moves on through the snap in steps, and touches."""
        start = lifted(3.0)
        critical = solve_height(StripModel(16.0, 0.06, kind="rod"), 3.0, 2.0).lam
        places = ((start.problem.motion, start.point.lam + 0.2 * n) for n in range(1, 200))
        acting = with_effects(start, path_friction.effects_of("pull", 0.1))
        steps = load_incrementally_from(acting, places)
        touch = next(step for step in steps if step.touches)
        assert critical < touch.lam < critical + 3.0

    def test_on_a_path(self):
        """The steps up to the snap have been handed out."""
        path = triangular(20.0)
        critical = np.sqrt(2.0) * (10.0 + 3.392)  # found by continuation
        mesh = StripModel(20.0, 0.0594, kind="rod").contact_mesh(2.0, memory=True)
        handed_out: list[float] = []

        def go() -> None:
            for step in load_incrementally(mesh, path, path_friction.effects_of("pull", 1e-4), 0.2):
                handed_out.append(step.lam)

        with pytest.raises(LostStabilityError, match="does not follow") as caught:
            go()
        assert caught.value.parameter == pytest.approx(critical, abs=0.02)
        assert 0.0 < caught.value.parameter - handed_out[-1] < 0.2


def test_a_small_yield_curvature_does_not_stop_elements_planned_anew() -> None:
    """On new elements the curvatures differed by several kappa_y: Newton's method went from stick to slip and back."""
    mesh = StripModel(12.2617, 0.01127, kind="rod").contact_mesh(1.0, memory=True)

    def effects(model: Model, q: Array) -> tuple[Hysteresis, ...]:
        return (Hysteresis.of(model, 0.0434, yield_curvature=0.0058, slack=q),)

    steps = load_incrementally(mesh, plan_r_path(12.2617).path, effects, 0.1)
    assert next(step for step in steps if step.lam > 2.95).lam == pytest.approx(3.0, abs=0.1)


def test_work_of_the_gripper():
    """Its work is the gain of energy, stored in the springs, and dissipated, while the elements move along the strip.

    By the trapezoidal rule over small steps.
    """
    ((_, first),) = lift(ROD.contact_mesh(0.5, memory=True), [1.0])
    first = with_effects(first, lambda model, q: (Hysteresis.of(model, 0.1, slack=q),))
    heights = np.linspace(1.0, 2.5, 61)
    steps = load_incrementally_from(first, [(Lift(), float(height)) for height in heights[1:]])
    states = [at.problem.on_mesh(at.point) for at in (first, *(step.at for step in steps))]
    pull = [problem.residual(point.q, point.lam)[problem.model.middle[0, 1]] for problem, point in states]
    work = float(np.trapezoid(pull, heights))
    begin, end = (p.model.energy(point.q) + float(p.model.weight @ point.q) for p, point in (states[0], states[-1]))
    problem, point = states[-1]
    effect = problem.effects[0].committed(point.q, np.zeros_like)
    stored, lost = effect.stored(point.q), effect.dissipated
    print(work, end - begin, stored, lost)
    assert lost > 0.03 * work
    assert end - begin + stored + lost == pytest.approx(work, abs=0.005 * lost)


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
            return Run(law, strength, step, (), iter(()), x)

        monkeypatch.setattr(friction, "follow", follow)
        fails, found = friction.smallest(MESH, plan, law, 0.25)  # type: ignore[arg-type]
        suffices = found.strength
        assert fails < threshold <= suffices
        assert suffices <= friction.NARROW * fails
        assert len(tried) < 20
        assert {fails, suffices} <= set(tried)

    @pytest.mark.parametrize("law", friction.LAWS)
    @pytest.mark.parametrize("off", [0.92, 1.0, 1.08])
    def test_a_good_guess_takes_two_trials(self, monkeypatch: pytest.MonkeyPatch, law: str, off: float):
        plan, step = plan_r_path(LENGTH), 0.25
        tried: list[float] = []
        threshold = off * friction.first_guess(MESH, law, step)

        def follow(model, plan, law, strength, step):  # type: ignore[no-untyped-def]
            tried.append(strength)
            return Run(law, strength, step, (), iter(()), plan.first_touch if strength >= threshold else nan)

        monkeypatch.setattr(friction, "follow", follow)
        friction.smallest(MESH, plan, law, step)  # type: ignore[arg-type]
        assert len(tried) == 2

    @pytest.mark.parametrize(
        ("length", "thickness", "pull", "moment"), [(12.0, 0.0766, 0.0324, 0.00595), (40.0, 0.042, 0.0913, 0.00913)]
    )
    def test_the_first_guess_is_near(self, length: float, thickness: float, pull: float, moment: float):
        """Truth: the smallest sufficient friction of strips of 0.6 m in steps of 0.1 L*, found from other guesses."""
        mesh = StripModel(length, thickness).contact_mesh()
        assert friction.first_guess(mesh, "pull", 0.1) == pytest.approx(pull, rel=0.15)
        assert friction.first_guess(mesh, "hysteresis", 0.1) == pytest.approx(moment, rel=0.15)

    @pytest.mark.parametrize("x", [float("nan"), 5.0])
    def test_none_suffices(self, monkeypatch: pytest.MonkeyPatch, x: float):
        plan = plan_r_path(LENGTH)
        monkeypatch.setattr(friction, "follow", lambda m, p, law, k, step: Run(law, k, step, (), iter(()), x))
        with pytest.raises(SolveError, match="pull friction"):
            friction.smallest(MESH, plan, "pull", 0.25)  # type: ignore[arg-type]

    def test_bracket(self, stored: tuple[xr.Dataset, list[Run]]):
        """Truth: the strip followed with either end, to the planned touch or elsewhere."""
        data, _ = stored
        plan = plan_r_path(LENGTH)
        mesh = StripModel(LENGTH, MATERIAL.relative_thickness).contact_mesh(2.0, memory=True)
        for law in friction.LAWS:
            fails, suffices = (float(data[name].sel(law=law)) for name in ("fails", "suffices"))
            assert fails < suffices <= 1.1 * fails
            for strength, expected in ((fails, False), (suffices, True)):
                run = friction.follow(mesh, plan, law, strength, STEP)
                assert run.followed(plan) is expected

    def test_the_pull_goes_by_force_times_step(self):
        """k_f times the step is what counts; the unit of a pull is the mass times the way."""
        plan = plan_r_path(20.0)
        mesh = StripModel(20.0, 0.0594, kind="rod").contact_mesh(2.0, memory=True)
        for strength, expected in ((0.0055, False), (0.012, True)):
            run = friction.follow(mesh, plan, "pull", strength / 0.4, 0.4)
            assert run.followed(plan) is expected
            assert (run.law, run.strength, run.step) == ("pull", strength / 0.4, 0.4)
            assert not (run.lost and expected)

    def test_a_lost_strip_says_so(self, monkeypatch: pytest.MonkeyPatch):
        plan = plan_r_path(LENGTH)
        mesh = StripModel(LENGTH, 0.06, kind="rod").contact_mesh(2.0, memory=True)
        run = friction.follow(mesh, plan, "pull", 0.0, STEP)
        assert "limit point" in run.lost
        assert np.isnan(run.touch_x)
        assert not run.followed(plan)

        def planted() -> Iterator[Sample]:
            yield run.steps[0]
            raise LostStabilityError("planted")

        found = Run("pull", 0.2, STEP, (), planted(), plan.first_touch)
        monkeypatch.setattr(friction, "smallest", lambda *_: (0.1, found))
        with pytest.raises(SolveError, match="planted"):
            friction.run(MATERIAL, LENGTH * MATERIAL.gravity_length, STEP, 3.0)

    def test_laws(self):
        model = MESH(np.ones(1)).model
        q = np.zeros(model.size)
        (pull,) = path_friction.effects_of("pull", 0.3)(model, q)
        assert isinstance(pull, Pull)
        assert pull.k_f == 0.3
        (hysteresis,) = path_friction.effects_of("hysteresis", 0.3)(model, q)
        assert isinstance(hysteresis, Hysteresis)
        assert hysteresis.moment == 0.3
        for effect in (pull, hysteresis):
            assert np.abs(effect.force(q)).max() < 1e-12


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
            upper = data["arc"].values < 0.5 * LENGTH * unit
            there = np.where(upper, np.abs(x[i] - float(chosen["touch_x"])) + z[i], inf)
            came = int(np.argmin(there))
            assert there[came] < 0.1 * unit
            assert z[i - 1, came] > 1e-3 * unit
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
        """Positive where the strip is stable by itself, negative where only friction holds it."""

        def stability(step: Sample) -> float:
            return friction._of_step(step, plan, np.zeros(1))["eigenvalue"]

        data, runs = stored
        plan = plan_r_path(LENGTH)
        seconds = np.sqrt(MATERIAL.gravity_length / 9.81)
        for law, run in zip(friction.LAWS, runs, strict=True):
            before = data["eigenvalue"].sel(law=law).values[: run.touch]
            assert before[:10].min() > 0.0
            assert before[-1] < 0.0
            assert before[-1] * seconds**2 == pytest.approx(stability(run.steps[run.touch - 1]))
        mesh = StripModel(LENGTH, MATERIAL.relative_thickness, kind="rod").contact_mesh(2.0, memory=True)
        steps = load_incrementally(mesh, plan.path, path_friction.effects_of("pull", 0.2), STEP)
        step = next(step for step in steps if step.lam > 3.0)
        value = stability(Sample.of(step))
        # With the pull every eigenvalue is higher by k_f.
        assert step.at.point.eigenvalues[0] == pytest.approx(value + 0.2, rel=1e-5)

    def test_another_material_of_the_same_ratios(
        self, stored: tuple[xr.Dataset, list[Run]], monkeypatch: pytest.MonkeyPatch
    ):
        """The same numbers of another size: by hand L* is half, rho_a g L* is 3/2, a second 1/sqrt(2)."""
        data, runs = stored
        fails = {law: float(data["fails"].sel(law=law)) for law in friction.LAWS}
        by_law = {run.law: run for run in runs}
        seen: list[tuple[float, float]] = []

        def smallest(mesh, plan, law, step):  # type: ignore[no-untyped-def]
            model = mesh(np.ones(1)).model
            seen.append((model.length, model.thickness))
            return fails[law], by_law[law]

        monkeypatch.setattr(friction, "smallest", smallest)
        other = friction.run(OTHER, LENGTH * OTHER.gravity_length, STEP, 2.0)
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


@pytest.mark.parametrize(("refinement", "size"), [(1.0, 0.25), (1.0, 0.1)])
def test_a_layer_that_friction_keeps_bent_comes_down(
    monkeypatch: pytest.MonkeyPatch, refinement: float, size: float
) -> None:
    """Just over the floor the branch turns back where the layer has touched in a second place.

    Whether a step meets that depends on it and on the mesh; the fold is that of finer elements.
    """
    turned: list[BranchPoint] = []
    comes_down = path_friction._layer_comes_down
    monkeypatch.setattr(path_friction, "_layer_comes_down", lambda at: turned.append(at) or comes_down(at))
    length = 17.39
    mesh = StripModel(length, 0.0515, kind="rod").contact_mesh(refinement, memory=True)
    path = plan_r_path(length).path
    *_, last = load_incrementally(mesh, path, effects_of("hysteresis", 0.2175, 0.289), size)
    assert last.lam == path.length
    assert last.at.topology == FOLDED
    assert shape_error(*last.on_mesh, half_fold(length)) == pytest.approx(0.0535, abs=1e-3)
    (at,) = turned
    height = at.mid_surface(at.model.ends)[:, 1]
    under = height < -1e-6
    assert under.any()
    assert at.model.ends[under].max() < at.contact[0]


def test_what_slides_goes_on_sliding_in_the_next_step() -> None:
    """With it taken as sticking the contact of this strip would move the other way, back to the flat strip."""
    length, softer = 15.3314, 14.9904
    path = triangular(softer).scaled(length / softer)
    for refinement, size in ((1.0, 0.1), (0.7, 0.07)):
        mesh = StripModel(length, 0.048023, kind="rod").contact_mesh(refinement, memory=True)
        steps = load_incrementally(mesh, path, effects_of("hysteresis", 0.257921, 0.0956828), size)
        ends = [step.lam for step in steps_until(0.4, steps)]
        assert ends == sorted(ends)
        assert ends[-1] > 0.4


def test_a_layer_that_has_not_come_down_is_a_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the branch turns back and is still unstable at the step's end."""
    landed = path_friction.landed

    def unstable(at: BranchPoint, lam: float) -> BranchPoint:
        down = landed(at, lam)
        return replace(down, point=replace(down.point, negatives=1))

    monkeypatch.setattr(path_friction, "landed", unstable)
    mesh = StripModel(17.39, 0.0515, kind="rod").contact_mesh(1.0, memory=True)
    with pytest.raises(LostStabilityError) as lost:
        list(load_incrementally(mesh, plan_r_path(17.39).path, effects_of("hysteresis", 0.2175, 0.289), 0.25))
    assert lost.value.parameter == pytest.approx(27.228, abs=1e-3)


def test_the_end_of_a_layer_beside_the_gripper_is_told_from_the_others() -> None:
    """Where another end of the contact moves most, or where no layer lies, a limit point is a loss."""
    steps = [step.at for step in load_incrementally(MESH, LOW, none, 1.0)]
    at = next(at for at in steps if at.topology == INTERVAL)

    def moving(*rates: float) -> bool:
        tangent = replace(at.point.tangent, q=np.append(np.zeros(at.problem.n), rates))
        return path_friction._layer_comes_down(BranchPoint(at.problem, replace(at.point, tangent=tangent)))

    assert moving(-0.9, 0.1, 0.3)
    assert not moving(-0.1, 0.3, 0.9)
    assert not moving(0.3, -0.9, 0.1)
    assert not path_friction._layer_comes_down(steps[0])


def test_a_layer_that_begins_to_lie_just_over_the_floor() -> None:
    """Lower than any state off the floor, on the R-path of a softer strip."""
    length, softer = 8.43601, 9.087417
    path = plan_r_path(softer).path.scaled(length / softer)
    mesh = StripModel(length, 0.0513747, kind="rod").contact_mesh(1.0, memory=True)
    *_, last = load_incrementally(mesh, path, effects_of("hysteresis", 0.2758, 0.526615), 0.25)
    assert last.lam == path.length
    assert last.at.topology == FOLDED


def test_a_state_on_elements_planned_anew_is_an_equilibrium_with_its_friction() -> None:
    """With the memory that the new elements have, and its branch goes on as it came."""
    steps = load_incrementally(MESH, LOW, lambda model, q: (Hysteresis.of(model, 0.1, slack=q),), 0.4)
    at = next(step.at for step in steps if step.lam > 3.0)
    loaded = BranchPoint(at.problem.accepted(at.point.q), at.point)
    new = contact_branch.transferred(loaded, mesh=at.problem.mesh.replanned(1.1 * at.contact))
    assert unbalanced(new.problem, new.point.q, new.point.lam) < 1e-8
    assert new.point.tangent.lam == pytest.approx(at.point.tangent.lam, abs=0.03)

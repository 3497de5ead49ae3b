"""Steps with friction that remembers, and the smallest friction with which an R-path is followed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, LostStabilityError
from stripfold.base.material import Material
from stripfold.follow import contact_branch, contact_events, memory
from stripfold.follow.contact_branch import BranchCrossing, BranchPoint, Planned
from stripfold.follow.memory import Effects, effects_of, load_incrementally_from, start_on_path, steps_on, with_effects
from stripfold.follow.statics import StripModel, lift, solve_height
from stripfold.follow.track import on_mesh
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.geometric import triangular
from stripfold.paths.rpath import plan_r_path
from stripfold.solve import continuation
from stripfold.solve.continuation import Event
from stripfold.strip.contact_mesh import FOLDED, INTERVAL, POINT
from stripfold.strip.effects import Effect, Hysteresis, Pull
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX

ROD = StripModel(12.0, 0.06, kind="rod")
MESH = ROD.contact_mesh(2.0, memory=True)
CORNERS = [(-6.0, 0.0), (-5.2, 1.2), (5.0, 1.2), (6.0, 0.0)]
STEP = 0.25
MATERIAL = Material(3780.0)
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


def load_incrementally(mesh: Planned, path: GripperPath, effects: Effects, size: float) -> Iterator[BranchPoint]:
    """Step after step along a path, from the flat strip on."""
    first = start_on_path(mesh, path, effects, size)
    yield from load_incrementally_from(first, steps_on(path, first.problem.mesh.length, size))


def unbalanced(problem: MovingContact, q: Array, lam: float) -> float:
    """Largest force that nothing balances."""
    residual = problem.residual(q, lam)
    residual[problem.prescribed] = 0.0
    return float(np.abs(residual).max())


def steps_until(lam: float, steps: Iterator[BranchPoint]) -> Iterator[BranchPoint]:
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
def low_steps() -> list[BranchPoint]:
    """The low path with both laws, as far as the second corner."""
    return list(load_incrementally(MESH, replace(LOW, pieces=LOW.pieces[:2]), both, 0.4))


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
        assert step.contact[0] == pytest.approx(expected.q[-1], abs=1e-3)
        s = np.linspace(0.0, 12.0, 50)
        places = [
            at.problem.at(at.contact).model.resampled_mid_surface(at.point.q[: at.problem.n], s)
            for at in (step, BranchPoint(before.problem, expected))
        ]
        np.testing.assert_allclose(places[0], places[1], atol=1e-3)

    def test_pieces_and_friction_of_strength_zero(self):
        begin = replace(LOW, pieces=LOW.pieces[:2])
        steps = list(load_incrementally(MESH, begin, none, 2.0))
        assert [(step.problem.motion, step.lam) for step in steps] == list(steps_on(begin, 12.0, 2.0))
        assert memory.effects_of("pull", 0.0)(MESH(np.ones(1)).model, np.zeros(1)) == ()
        weak = load_incrementally(MESH, LOW, lambda model, q: (Pull(model, 0.0, q),), 2.0)
        for step, other in zip(steps[:4], weak, strict=False):
            np.testing.assert_allclose(step.point.q, other.point.q, atol=1e-8)

    def test_each_step_is_an_equilibrium_with_its_friction(self, low_steps: list[BranchPoint]):
        for step in low_steps:
            at = step
            assert unbalanced(at.problem, at.point.q, step.lam) < 1e-7
            problem, point = on_mesh(step)
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
        assert low_steps[-1].topology in (POINT, INTERVAL)

    def test_effects_remember_the_step_before(self, low_steps: list[BranchPoint]):
        compared = 0
        for before, step in pairwise(low_steps):
            if step.problem.mesh is not before.problem.mesh:
                continue
            compared += 1
            q, problem = before.point.q, before.problem
            pull, hysteresis = step.problem.effects
            np.testing.assert_array_equal(pull.q_prev, q[: problem.n])
            np.testing.assert_array_equal(step.problem.remembered, before.contact)
            old = problem.at(before.contact).effects[1]
            lost = old.dissipation(q[: problem.n])
            assert hysteresis.dissipated == pytest.approx(old.dissipated + lost, rel=1e-12)
        assert compared > 10
        assert low_steps[-1].problem.effects[1].dissipated > 1e-3
        # What is reported of a step's stability is with the friction: without it the eigenvalue is lower by k_f.
        at = next(step for step in low_steps if step.problem.motion.path == LOW.pieces[1])
        bare = MovingContact(at.problem.mesh, at.problem.motion)
        free = continuation.evaluate(bare, at.point.state, at.point.tangent)
        assert at.point.eigenvalues[0] > free.eigenvalues[0] + 0.04

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_a_step_begins_with_the_last_state_and_ends_with_its_friction_alone(self, kind: str):
        """The force that the update takes away is there at first; then in proportion to lambda no longer."""
        start = lifted(3.0, kind)
        places = [(start.problem.motion, start.point.lam + 0.2 * n) for n in range(1, 4)]
        at = list(load_incrementally_from(with_effects(start, both), places))[-1]
        end = at.point.lam + 0.2
        step = memory._StepProblem.after(at, end)
        accepted = at.problem.accepted(at.point.q)
        q, lam = at.point.q, at.point.lam
        assert unbalanced(step, q, lam) < 1e-7
        assert unbalanced(accepted, q, lam) > 1e-4
        np.testing.assert_array_equal(step.residual(q, end), accepted.residual(q, end))
        force, _, rate = step.linearise(q, lam + 0.05)
        np.testing.assert_allclose(force, step.residual(q, lam + 0.05), atol=1e-13)
        slope = (step.residual(q, lam + 0.06) - step.residual(q, lam + 0.04)) / 0.02
        np.testing.assert_allclose(rate, slope, atol=1e-10)


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
            acting = with_effects(start, memory.effects_of("hysteresis", strength))
            with pytest.raises(LostStabilityError, match="limit point") as caught:
                list(load_incrementally_from(acting, places))
            return caught.value.parameter

        assert critical + 0.02 < limit(0.005) < limit(0.01) < critical + 0.5

    def test_the_pull_lets_the_strip_down(self):
        """It acts like a viscosity: with enough of it the strip moves on through the snap in steps, and touches."""
        start = lifted(3.0)
        critical = solve_height(StripModel(16.0, 0.06, kind="rod"), 3.0, 2.0).lam
        places = ((start.problem.motion, start.point.lam + 0.2 * n) for n in range(1, 200))
        acting = with_effects(start, memory.effects_of("pull", 0.1))
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
            for step in load_incrementally(mesh, path, memory.effects_of("pull", 1e-4), 0.2):
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


class TestFriction:
    """The smallest that suffices."""

    def test_laws(self):
        model = MESH(np.ones(1)).model
        q = np.zeros(model.size)
        (pull,) = memory.effects_of("pull", 0.3)(model, q)
        assert isinstance(pull, Pull)
        assert pull.k_f == 0.3
        (hysteresis,) = memory.effects_of("hysteresis", 0.3)(model, q)
        assert isinstance(hysteresis, Hysteresis)
        assert hysteresis.moment == 0.3
        for effect in (pull, hysteresis):
            assert np.abs(effect.force(q)).max() < 1e-12


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


def test_the_end_of_a_layer_beside_the_gripper_is_told_from_the_others() -> None:
    """Where another end of the contact moves most, or where no layer lies, a limit point is a loss."""
    steps = [step for step in load_incrementally(MESH, LOW, none, 1.0)]
    at = next(at for at in steps if at.topology == INTERVAL)

    def moving(*rates: float) -> bool:
        tangent = replace(at.point.tangent, q=np.append(np.zeros(at.problem.n), rates))
        return memory._layer_comes_down(BranchPoint(at.problem, replace(at.point, tangent=tangent)))

    assert moving(-0.9, 0.1, 0.3)
    assert not moving(-0.1, 0.3, 0.9)
    assert not moving(0.3, -0.9, 0.1)
    assert not memory._layer_comes_down(steps[0])


def test_a_layer_that_begins_to_lie_just_over_the_floor() -> None:
    """Lower than any state off the floor, on the R-path of a softer strip."""
    length, softer = 8.43601, 9.087417
    path = plan_r_path(softer).path.scaled(length / softer)
    mesh = StripModel(length, 0.0513747, kind="rod").contact_mesh(1.0, memory=True)
    *_, last = load_incrementally(mesh, path, effects_of("hysteresis", 0.2758, 0.526615), 0.25)
    assert last.lam == path.length
    assert last.topology == FOLDED


def test_a_state_on_elements_planned_anew_is_an_equilibrium_with_its_friction() -> None:
    """With the memory that the new elements have, and its branch goes on as it came."""
    steps = load_incrementally(MESH, LOW, lambda model, q: (Hysteresis.of(model, 0.1, slack=q),), 0.4)
    at = next(step for step in steps if step.lam > 3.0)
    loaded = BranchPoint(at.problem.accepted(at.point.q), at.point)
    new = contact_branch.transferred(loaded, mesh=at.problem.mesh.replanned(1.1 * at.contact))
    assert unbalanced(new.problem, new.point.q, new.point.lam) < 1e-8
    assert new.point.tangent.lam == pytest.approx(at.point.tangent.lam, abs=0.03)

"""Steps with friction that remembers, and the smallest friction with which an R-path is followed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import inf

import numpy as np
import pytest
import xarray as xr

from stripfold.analysis import contact_branch, friction, path_friction
from stripfold.analysis.contact_branch import BranchCrossing, BranchPoint
from stripfold.analysis.friction import Run
from stripfold.analysis.path_friction import Step, load_incrementally, load_incrementally_from, steps_on, with_effects
from stripfold.analysis.static import StripModel, lift, solve_height
from stripfold.arrays import Array
from stripfold.effects import Effect, Hysteresis, Pull
from stripfold.errors import InvalidInputError, LostStabilityError, SolveError
from stripfold.material import Material
from stripfold.models.contact_mesh import Topology
from stripfold.models.model import Model
from stripfold.moving_contact import MovingContact
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.geometric import triangular
from stripfold.paths.rpath import plan_r_path
from stripfold.problem import AlongPiece, AlongX, Lift
from stripfold.solve import continuation
from stripfold.solve.events import Event, never

ROD = StripModel(12.0, 0.06, kind="rod")
MESH = ROD.contact_mesh(2.0, memory=True)
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
    follow = friction.follow

    def keep(*given: object) -> Run:
        run = follow(*given)  # type: ignore[arg-type]
        if run.values:
            runs.append(run)
        return run

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "follow", keep)
        return friction.run(MATERIAL, LENGTH * MATERIAL.gravity_length, STEP, 2.0), runs


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
    def test_a_step_that_is_none(self, size: float):
        with pytest.raises(InvalidInputError, match="step"):
            next(load_incrementally(MESH, LOW, none, size))


class TestLoadingIncrementally:
    """The states."""

    @pytest.mark.parametrize("size", [0.3, 0.7])
    def test_without_effects_it_is_the_branch(self, size: float):
        """Truth: the state at the first corner by continuation, on a mesh of its own."""
        motion = AlongPiece(LOW.pieces[0], 12.0)
        corner = LOW.pieces[0].end
        end = Event("corner", lambda point, _: point.lam >= corner, located=never)
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
        steps = list(load_incrementally(MESH, replace(LOW, pieces=LOW.pieces[:2]), none, 2.0))
        assert [(step.piece, step.lam) for step in steps] == [p for p in steps_on(LOW, 2.0) if p[0] < 2]
        assert friction.effects_of("pull", 0.0)(MESH(np.ones(1)).model, np.zeros(1)) == ()
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
            # The same forces with the contact at nodes: the floor pushes.
            residual = problem.residual(point.q, step.lam)
            others = np.setdiff1d(np.arange(problem.size), np.concatenate([problem.prescribed, problem.bounded]))
            held = [] if problem.model.slopes is None else problem.model.slopes
            assert np.abs(residual[np.setdiff1d(others, held)]).max() < 1e-7
        assert [step.touches for step in low_steps] == sorted(step.touches for step in low_steps)
        assert low_steps[-1].at.topology in (Topology.POINT, Topology.INTERVAL)

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
        at = next(step.at for step in low_steps if step.piece == 1)
        bare = MovingContact(at.problem.mesh, at.problem.motion)
        free = continuation.evaluate(bare, at.point.state, at.point.tangent)
        assert at.point.eigenvalues[0] > free.eigenvalues[0] + 0.04

    @pytest.mark.parametrize("kind", ["rod", "solid"])
    def test_a_step_begins_with_the_last_state_and_ends_with_its_friction_alone(self, kind: str):
        """The force that the update takes away is there at first; then in proportion to lambda no longer."""
        start = lifted(3.0, kind)
        places = [(0, start.point.lam + 0.2 * n) for n in range(1, 4)]
        at = list(load_incrementally_from(with_effects(start, both), [start.problem.motion], places))[-1].at
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
        at = with_effects(start, friction.effects_of(law, 0.05))
        for _ in range(4):
            once = path_friction._at_once(at, at.point.lam + 0.2)
            along = path_friction._along_branch(at, at.point.lam + 0.2)
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
        places = ((0, start.point.lam + size * n) for n in range(1, 200))
        with pytest.raises(LostStabilityError, match="limit point") as caught:
            list(load_incrementally_from(with_effects(start, none), [start.problem.motion], places))
        assert caught.value.parameter == pytest.approx(critical, abs=2e-3)

    @pytest.mark.parametrize("law", friction.LAWS)
    def test_friction_delays_it(self, law: str):
        start = lifted(3.0)
        critical = solve_height(StripModel(16.0, 0.06, kind="rod"), 3.0, 2.0).lam

        def limit(strength: float) -> float:
            places = ((0, start.point.lam + 0.2 * n) for n in range(1, 200))
            acting = with_effects(start, friction.effects_of(law, strength))
            with pytest.raises(LostStabilityError, match="limit point") as caught:
                list(load_incrementally_from(acting, [start.problem.motion], places))
            return caught.value.parameter

        weak, strong = (0.002, 0.004) if law == "hysteresis" else (0.02, 0.04)
        assert critical + 1e-3 < limit(weak) < limit(strong) < critical + 0.5

    def test_on_a_path(self):
        """The steps up to the snap have been handed out."""
        path = triangular(20.0)
        critical = np.sqrt(2.0) * (10.0 + 3.392)  # found by continuation
        mesh = StripModel(20.0, 0.0594, kind="rod").contact_mesh(2.0, memory=True)
        handed_out: list[float] = []

        def go() -> None:
            for step in load_incrementally(mesh, path, friction.effects_of("pull", 1e-4), 0.2):
                handed_out.append(step.lam)

        with pytest.raises(LostStabilityError, match="does not follow") as caught:
            go()
        assert caught.value.parameter == pytest.approx(critical, abs=0.02)
        assert 0.0 < caught.value.parameter - handed_out[-1] < 0.2


def test_work_of_the_gripper():
    """Its work is the gain of energy, stored in the springs, and dissipated, while the elements move along the strip.

    By the trapezoidal rule over small steps.
    """
    ((_, first),) = lift(ROD.contact_mesh(1.0, memory=True), [1.0])
    first = with_effects(first, lambda model, q: (Hysteresis.of(model, 0.1, slack=q),))
    heights = np.linspace(1.0, 2.5, 61)
    steps = load_incrementally_from(first, [Lift()], [(0, float(height)) for height in heights[1:]])
    states = [at.problem.on_mesh(at.point) for at in (first, *(step.at for step in steps))]
    pull = [problem.residual(point.q, point.lam)[problem.model.middle[0, 1]] for problem, point in states]
    work = float(np.trapezoid(pull, heights))
    begin, end = (p.model.energy(point.q) + float(p.model.weight @ point.q) for p, point in (states[0], states[-1]))
    problem, point = states[-1]
    effect = problem.effects[0].committed(point.q)
    stored, lost = effect.stored(point.q), effect.dissipated
    print(work, end - begin, stored, lost)
    assert lost > 0.03 * work
    assert end - begin + stored + lost == pytest.approx(work, abs=0.01 * lost)



"""The ends of the contact as unknowns: derivatives, the elastica as the thin limit, and a low gripper's contacts."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from stripfold import elastica
from stripfold.ask.prediction import (
    ElasticaPrediction,
    end_of_advance,
    from_near_the_end,
    without_horizontal_force,
)
from stripfold.base.errors import NewtonError, SolveError
from stripfold.follow import contact_events, statics
from stripfold.follow.contact_branch import STEPS, BranchCrossing, BranchPoint, follow, solved
from stripfold.follow.memory import effects_of
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from stripfold.strip.contact_mesh import FOLDED, INTERVAL, LYING, POINT, ContactMesh, Sizes, Topology
from stripfold.strip.effects import BendingLaw, MomentCurvature
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, TwoGrippers
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

MODELS = ("rod", "solid")
LENGTH, HEIGHT = 20.0, 3.0
CONTACT = {
    LYING: [4.0],
    POINT: [2.0, 5.0],
    INTERVAL: [2.0, 3.0, 6.0],
    FOLDED: [2.0, 5.0],
    (False,): [],
    (False, False, True, False, False, True): [1.0, 2.0, 3.0, 4.5, 6.0],
}


def strip(kind: str, thickness: float = 1e-3, length: float = LENGTH) -> StripModel:
    return StripModel(length, thickness, kind=kind)


def near_end(kind: str, thickness: float, height: float = HEIGHT, refinement: float = 1.0) -> statics.XRun:
    return from_near_the_end(strip(kind, thickness), ElasticaPrediction.at(height), refinement)


class TestEquations:
    @pytest.mark.parametrize("kind", MODELS)
    @pytest.mark.parametrize("topology", CONTACT)
    def test_derivatives(self, kind: str, topology: Topology):
        """By the model's unknowns and the contact coordinates, against differences of the residual."""
        of = {"rod": Rod, "solid": Solid}[kind]
        sizes = Sizes(1.0, 3.0, 0.5, least=3)
        mesh = ContactMesh.of(9.0, topology, np.array(CONTACT[topology]), sizes, lambda e: of.of(9.0, 0.3, elements=e))
        # A point that touches, or is held by a second gripper.
        self.check(MovingContact(mesh, AlongX(1.0)))
        if any(mesh.points):
            self.check(MovingContact(mesh, TwoGrippers(AlongX(1.0), CONTACT[topology][0], 0.1, 0.4 - 1.0)))

    def check(self, problem: MovingContact) -> None:
        mesh, rng = problem.mesh, np.random.default_rng(3)
        q = np.append(0.03 * rng.normal(size=problem.n), mesh.planned + 0.01)
        _, matrix, _ = problem.linearise(q, 0.0)
        for _ in range(3):
            direction, step = rng.normal(size=problem.size), 1e-6
            ahead, back = (problem.residual(q + sign * step * direction, 0.0) for sign in (1.0, -1.0))
            difference = (ahead - back) / (2.0 * step)
            np.testing.assert_allclose(matrix @ direction, difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())

    @pytest.mark.parametrize("kind", MODELS)
    @pytest.mark.parametrize("law", ["pull", "hysteresis", "bending law"])
    def test_derivatives_with_effects(self, kind: str, law: str):
        """The effect's part of the columns of the contact coordinates, against differences of the residual."""
        mesh = strip(kind, 0.1, 9.0).contact_mesh(3.0, memory=True)(np.array([4.0]))
        rng, before = np.random.default_rng(4), mesh.model
        angle = 0.2 * before.s**2
        bent = before.unknowns_of(np.stack([before.s - 4.5 - 0.1 * before.s, 0.3 * angle], axis=1), angle)
        # Smooth: friction has a kink where an element begins to slide, kappa_p one at the ends of its cells.
        softer = BendingLaw.of(before, MomentCurvature(np.array([0.2, 5.0]), np.array([0.15, 3.0])))
        effects = (softer,) if law == "bending law" else effects_of(law, 50.0)(before, bent)
        both = MovingContact(mesh, AlongX(1.0), effects, mesh.planned), MovingContact(mesh, AlongX(1.0))
        contact, step = mesh.planned + 0.0213, 1e-6
        u = both[0].at(contact).model.resampled(bent, both[0].at(contact).model.s) + 1e-3 * rng.normal(size=both[0].n)
        sides = [[p.residual(np.append(u, contact + sign * step), 0.0) for p in both] for sign in (1.0, -1.0)]
        difference = (sides[0][0] - sides[0][1] - sides[1][0] + sides[1][1]) / (2.0 * step)
        matrices = [p.linearise(np.append(u, contact), 0.0)[1] for p in both]
        column, bare = (matrix @ np.append(np.zeros(len(u)), 1.0) for matrix in matrices)
        np.testing.assert_allclose(column - bare, difference, rtol=0.0, atol=1e-5 * np.abs(difference).max())

    @pytest.mark.parametrize("kind", MODELS)
    def test_a_step_predicts_the_stress(self, kind: str):
        """The predicted stress differs from that of the state by the square of the step, also by contact."""
        mesh = strip(kind, 0.1, 9.0).contact_mesh(3.0)(np.array([4.0]))
        problem = MovingContact(mesh, AlongX(1.0))
        rng = np.random.default_rng(5)
        q = np.append(0.03 * rng.normal(size=problem.n), 4.0)
        direction = np.append(0.1 * rng.normal(size=problem.n), 0.3)
        apart = []
        for size in (1e-2, 5e-3):
            new, stress = problem.stepped(q, size * direction)
            true = problem.at(new[-1:]).model.predict_stress(new[:-1], np.zeros(problem.n))
            apart.append(np.abs(stress - true).max())
        assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)

    def test_a_point_contact_stands_upright(self):
        """The section at the point: its equation changes with the tilt there, and with no other column's."""
        sizes = Sizes(1.0, 3.0, 0.5, least=3)
        contact = np.array(CONTACT[POINT])
        mesh = ContactMesh.of(9.0, POINT, contact, sizes, lambda e: Solid.of(9.0, 0.3, elements=e))
        problem, model = MovingContact(mesh, AlongX(1.0)), mesh.model
        column = int(np.argmin(np.abs(model.s - contact[0])))
        tilts = []
        for s in range(len(model.s)):
            angle = np.zeros(len(model.s))
            angle[s] = 0.1
            straight = np.stack([model.s - 4.5, 0.0 * model.s], axis=1)
            q = np.append(model.unknowns_of(straight, angle), contact)
            tilts.append(problem.residual(q, 0.0)[problem.n])
        assert np.flatnonzero(tilts).tolist() == [column]

    def test_a_part_cannot_have_a_negative_length(self):
        mesh = strip("rod").contact_mesh()(np.array([4.0]))
        problem = MovingContact(mesh, AlongX(1.0))
        q = np.append(np.zeros(problem.n), 4.0)
        with pytest.raises(NewtonError, match="negative length"):
            problem.stepped(q, np.append(np.zeros(problem.n), LENGTH))

    @pytest.mark.parametrize("kind", MODELS)
    def test_states_on_other_elements(self, kind: str):
        """The shape of a bent strip, and its stress, at the places of other elements."""
        of = {"rod": Rod, "solid": Solid}[kind].of
        one, other = of(3.0, 0.05, elements=30), of(3.0, 0.05, elements=41)

        def bent(model: Rod | Solid) -> np.ndarray:
            angle = 0.5 * model.s
            return model.unknowns_of(np.stack([2.0 * np.sin(angle) - 1.5, 2.0 - 2.0 * np.cos(angle)], 1), angle)

        q = bent(one)
        np.testing.assert_allclose(one.resampled(q, other.s), bent(other), atol=2e-5)
        zero = np.zeros(other.size)
        stress, there = one.resampled_stress(q, other), other.predict_stress(bent(other), zero)
        np.testing.assert_allclose(stress, there, atol=1e-3 * np.abs(there).max())
        moved = one.with_ends(np.sort(np.append([0.0, 3.0], np.random.default_rng(0).uniform(0.0, 3.0, 29))))
        again = of(3.0, 0.05, elements=moved.ends)
        np.testing.assert_allclose(moved.internal_force(q), again.internal_force(q), rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(moved.weight, again.weight, atol=1e-14)


class TestCriticalPoint:
    def test_order_four_on_the_rod(self):
        """lambda_c of the thin rod converges to the elastica's with the fourth power of the element length."""
        truth = elastica.critical(HEIGHT).advance
        errors = np.array([near_end("rod", 1e-4, refinement=r).lam - truth for r in (2.0, 1.0, 0.5)])
        print("errors", errors)
        assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.5)
        assert abs(errors[1]) < 5e-5 * truth

    def test_order_three_on_the_solid(self):
        """Against the finest mesh; the rod's lambda_c is as far away as the models are (docs/method.md)."""
        truth = near_end("solid", 0.0594, refinement=0.2).lam
        errors = np.array([near_end("solid", 0.0594, refinement=r).lam - truth for r in (2.0, 1.0)])
        print("errors", errors)
        assert abs(errors[1]) < 1e-5 * truth
        assert abs(errors[0]) > 5.0 * abs(errors[1])
        assert near_end("rod", 0.0594, refinement=0.5).lam == pytest.approx(truth, rel=5e-5)

    @pytest.mark.parametrize("kind", MODELS)
    def test_thickness(self, kind: str):
        """lambda_c falls with h^2."""
        h = np.array([0.2, 0.1, 0.05])
        distance = np.array([near_end(kind, t).lam for t in h]) - elastica.critical(HEIGHT).advance
        assert distance / h**2 == pytest.approx(-5.9, abs=0.5)

    @pytest.mark.parametrize(("height", "end"), [(0.5, End.TOUCH), (1.58, End.TOUCH), (1.592, End.SNAP)])
    def test_touch_or_snap(self, height: float, end: End):
        """On either side of the limit, 1.58617 L*."""
        found, truth = near_end("rod", 1e-3, height, 0.5), elastica.critical(height).state
        assert found.end is end
        assert found.free_length == pytest.approx(truth.length, abs=2e-3)
        assert found.lam == pytest.approx(truth.advance, abs=2e-4)

    @pytest.mark.parametrize("kind", MODELS)
    def test_shortest_that_snaps(self, kind: str):
        """Its free part at the limit point just has room, whatever the steps.

        Truth: the limit point of a long strip, and the elastica's; the solid's lift-off is a thickness wide.
        """
        h, prediction = 0.05, ElasticaPrediction.at(HEIGHT)
        long = near_end(kind, h)
        shortest = long.free_length + (h if kind == "solid" else contact_events.LEAST_LYING)
        assert shortest == pytest.approx(prediction.last.length, abs=0.5 * h)
        near = 0.02 if kind == "solid" else 0.003
        for extra, end in ((0.5, End.SNAP), (near, End.SNAP), (-near, End.LIFTED), (-0.2, End.LIFTED)):
            short = strip(kind, h, shortest + extra)
            ((_, start),) = statics.lift(short.contact_mesh(), [HEIGHT])
            runs = [end_of_advance(short, prediction), from_near_the_end(short, prediction)]
            runs += [statics.along_x(start, HEIGHT, options=replace(STEPS, largest=ds)) for ds in (0.7, 0.2)]
            assert [run.end for run in runs] == 4 * [end]
            lam = [run.lam for run in runs]
            assert lam == pytest.approx(4 * [lam[0]], abs=3e-4)
            if end is End.SNAP:
                # What lies is compressed by the horizontal force; the end of a solid is near its lift-off.
                assert lam[0] == pytest.approx(long.lam, abs=1e-3)

    def test_too_short_to_be_lifted(self):
        with pytest.raises(SolveError, match="leaves the floor"):
            statics.solve_height(strip("rod", 0.05, 2.9), HEIGHT)

    @pytest.mark.parametrize("kind", MODELS)
    def test_one_maximum(self, kind: str):
        """lambda rises up to the critical point, on coarse elements and fine; there it is where the elastica's is."""
        truth = elastica.critical(HEIGHT).advance
        for refinement in (1.5, 0.7):
            run = statics.solve_height(strip(kind, 0.02), HEIGHT, refinement)
            lam = np.array([at.point.lam for at in run.points[: run.points.index(run.last) + 1]])
            # Elements planned anew move a state by their error.
            assert np.diff(lam).min() > -1e-3
            assert run.lam == pytest.approx(truth, rel=1e-3)

    def test_no_horizontal_force(self):
        prediction = ElasticaPrediction.at(HEIGHT)
        found = without_horizontal_force(strip("rod"), prediction)
        assert found == pytest.approx(prediction.first.advance, abs=1e-4)


def low_path(kind: str, height: float, thickness: float = 0.02, refinement: float = 1.0) -> list[BranchPoint]:
    """States of an advance through the touch of the sag, until an upper layer of 2 L* lies."""
    ((_, start),) = statics.lift(strip(kind, thickness).contact_mesh(refinement), [height])
    lambda_0 = float(start.u[start.model.middle[0, 0]])
    first = solved(MovingContact(start.problem.mesh, AlongX(height)), start.point.q, lambda_0)
    points = []
    for item in follow(first, STEPS, lambda _: [statics.LIMIT]):
        assert not isinstance(item, BranchCrossing), f"a limit point at {item.before.point.lam}"
        points.append(item)
        if item.topology == INTERVAL and item.contact[1] - item.contact[0] > 2.0:
            return points
    raise AssertionError("a branch ends in an event or raises")


def test_the_sag_flattens_where_it_does_on_finer_elements():
    """A force in a point shears the solid: over an element's length the strip looks the flatter the shorter that is."""
    last = []
    for refinement in (1.0, 0.5):
        points = low_path("solid", 0.62, 0.04, refinement)
        flat = [at.topology for at in points].index(INTERVAL)
        before, behind = points[flat - 1 : flat + 1]
        assert behind.point.lam == pytest.approx(before.point.lam, abs=0.03)
        assert len(behind.point.state.residuals) <= 5
        last.append(before.point.lam)
    assert last[0] == pytest.approx(last[1], abs=0.01)


def test_no_event_is_lost_where_elements_are_planned_anew():
    """Near the touch of this strip its elements are due to be planned anew; on the new ones it may be past."""
    strip_drawn, height = statics.StripModel(17.593802, 0.094148), 0.6188235
    run = statics.solve_height(strip_drawn, height)
    assert run.end is statics.End.TOUCH
    finer = statics.solve_height(strip_drawn, height, 0.5)
    assert run.lam == pytest.approx(finer.lam, abs=3e-3)


@pytest.mark.parametrize("kind", MODELS)
def test_a_low_gripper_lays_the_sag_down(kind: str):
    """docs/physics.md, section 5: touch, point contact, interval; no limit point, no horizontal force in the end."""
    points = low_path(kind, 1.0)
    topologies = [at.topology for at in points]
    assert [t for t, u in pairwise([*topologies, None]) if t is not u] == [
        LYING,
        POINT,
        INTERVAL,
    ]
    assert all(at.point.negatives == 0 for at in points)
    touched = elastica.critical(1.0).state
    point = points[topologies.index(POINT)]
    assert point.point.lam == pytest.approx(touched.advance, abs=0.02)
    assert point.contact[1] == pytest.approx(touched.length, abs=0.05)
    last = points[-1]
    loop = elastica.folded_loop()
    # A solid lifts off within a thickness at either end.
    assert last.contact[2] - last.contact[1] == pytest.approx(loop.arc, abs=0.03)
    grip = last.point.state.force[last.model.middle[0, 0]]
    assert grip == pytest.approx(0.0, abs=3e-3)

"""The ends of the contact as unknowns: derivatives, the elastica as the thin limit, and a low gripper's contacts."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from stripfold import elastica
from stripfold.ask.prediction import (
    ElasticaPrediction,
    from_near_the_end,
    snap,
)
from stripfold.follow import statics
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from stripfold.paths import geometric
from stripfold.strip.contact_mesh import FOLDED, INTERVAL, LYING, POINT, ContactMesh, Sizes, Topology
from stripfold.strip.effects import Pull
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Slipping, TwoGrippers
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
    def test_a_copy_is_made_of_what_the_problem_was(self, kind: str):
        """What has been computed is no part of it: a process is sent the states of a path, some hundreds."""
        at = near_end(kind, 0.02).last
        used, fresh = at.problem, replace(at.problem)
        used.linearise(at.point.q, at.point.lam)
        again = pickle.loads(pickle.dumps(used))
        assert len(pickle.dumps(used)) == len(pickle.dumps(fresh))
        assert np.array_equal(again.mesh.model.mass.flat, used.mesh.model.mass.flat)

    @pytest.mark.parametrize("kind", MODELS)
    @pytest.mark.parametrize("topology", CONTACT)
    def test_derivatives(self, kind: str, topology: Topology):
        """By the model's unknowns and the contact coordinates, against differences of the residual."""
        of = {"rod": Rod, "solid": Solid}[kind]
        sizes = Sizes(1.0, 3.0, 0.5, least=3)
        mesh = ContactMesh.of(9.0, topology, np.array(CONTACT[topology]), sizes, lambda e: of.of(9.0, 0.3, elements=e))
        # A point that touches, or is held by a second gripper.
        self.check(MovingContact(mesh, AlongX(1.0)))
        # The whole strip slides.
        self.check(MovingContact(mesh, Slipping(geometric.triangular(9.0).pieces[0], 9.0, ratio=0.4)))
        # What pulls back was on other elements.
        before = 0.03 * np.random.default_rng(4).normal(size=mesh.model.size)
        self.check(MovingContact(mesh, AlongX(1.0), (Pull(mesh.model, 40.0, before),), mesh.planned))
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

    @pytest.mark.parametrize(("kind", "refinement"), [("rod", 0.12), ("solid", 0.25)])
    def test_a_high_thin_strip_on_fine_elements(self, kind: str, refinement: float):
        """Elements far from the grasp keep the digits of their lengths: followed and solved for, lambda_c is one."""
        high = StripModel(98.8, 3.8e-4, kind=kind)
        prediction = ElasticaPrediction.at(42.6)
        followed = from_near_the_end(high, prediction, refinement).lam
        assert snap(high, prediction, refinement).checked().lam == pytest.approx(followed, abs=1e-6)
        assert followed == pytest.approx(prediction.last.advance, rel=2e-6)

    @pytest.mark.parametrize(("height", "end"), [(0.5, End.TOUCH), (1.58, End.TOUCH), (1.592, End.SNAP)])
    def test_touch_or_snap(self, height: float, end: End):
        """On either side of the limit, 1.58617 L*."""
        found, truth = near_end("rod", 1e-3, height, 0.5), elastica.critical(height).state
        assert found.end is end
        assert found.free_length == pytest.approx(truth.length, abs=2e-3)
        assert found.lam == pytest.approx(truth.advance, abs=2e-4)

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

"""The free part of a rod with its lift-off as an unknown, and the critical point found with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stripfold import elastica
from stripfold.analysis import critical_point as critical
from stripfold.analysis import locate_rod
from stripfold.analysis.static import End, StripModel
from stripfold.errors import SolveError
from stripfold.inputs import Scene
from stripfold.models.free_rod import FreeRod, FreeState, Guess

LENGTH, HEIGHT = 20.0, 3.0


def free_rod(thickness: float, elements: int = 36, height: float = HEIGHT) -> FreeRod:
    return FreeRod.of(LENGTH, thickness, height, np.linspace(0.0, 1.0, elements + 1))


def rod(thickness: float, length: float = LENGTH) -> StripModel:
    return StripModel(length, thickness, kind="rod")


@pytest.fixture(scope="module")
def prediction() -> locate_rod.ElasticaPrediction:
    return locate_rod.ElasticaPrediction.at(HEIGHT)


class TestState:
    def test_derivatives(self):
        """By nodes, free length (the gripper's height falls with it) and H, against differences of the forces."""
        part = free_rod(0.1, 6)
        rng = np.random.default_rng(3)
        held = [1, 24, 25, 27]
        q = 0.03 * rng.normal(size=part.unit.size)
        q[held] = 0.0
        q[1] = HEIGHT / 6.5
        state = FreeState(q, 0.4, 6.5)

        def force(**change: Any) -> np.ndarray:
            new = state._replace(**change)
            moved = new.q.copy()
            moved[1] = HEIGHT / new.length
            return part.linearised(*part.guess(new._replace(q=moved))).force

        at, step = part.linearised(*part.guess(state)), 1e-6
        by_length = (force(length=6.5 + step) - force(length=6.5 - step)) / (2.0 * step)
        by_force = (force(force=0.4 + step) - force(force=0.4 - step)) / (2.0 * step)
        np.testing.assert_allclose(at.by_length, by_length, rtol=1e-6, atol=1e-4)
        np.testing.assert_allclose(at.by_force, by_force, atol=1e-4)
        direction = rng.normal(size=len(q))
        direction[held] = 0.0
        along = (force(q=q + step * direction) - force(q=q - step * direction)) / (2.0 * step)
        np.testing.assert_allclose(at.tangent @ direction, along, rtol=1e-6, atol=1e-3)

    @pytest.mark.parametrize("height", [1.0, 3.0, 12.0])
    def test_the_thin_limit_is_the_elastica(self, height: float):
        """State by state: place of the gripper, force and sag, with the fourth power of the element length."""
        end = elastica.critical(height)
        state = end.state
        errors = []
        for elements in (60, 120):
            part = free_rod(1e-4, elements, height)
            found = part.solve(part.from_elastica(state), length=state.length)
            errors.append(abs(part.advance(found) - state.advance))
            assert -found.force == pytest.approx(state.force_x, abs=10.0 * errors[-1])
            sag = min(part.clearance(found), height)
            assert sag == pytest.approx(min(state.clearance, height), abs=10.0 * errors[-1] + 2e-4)
        assert errors[1] < 1e-4 * state.advance
        assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)

    def test_no_horizontal_force(self, prediction: locate_rod.ElasticaPrediction):
        part = free_rod(1e-4, 80)
        found = part.solve(part.from_elastica(prediction.first), force=0.0)
        assert found.force == 0.0
        assert part.advance(found) == pytest.approx(prediction.first.advance, abs=1e-5)
        assert found.length == pytest.approx(prediction.first.length, abs=1e-5)

    def test_the_lying_part_is_compressed(self):
        """membrane (e^2 - 1) / 2 e = -H, and the gripper is that much farther."""
        part = free_rod(0.2)
        e = part.stretch(0.7)
        assert part.membrane * 0.5 * (e**2 - 1.0) * e == pytest.approx(-0.7, rel=1e-12)
        flat = FreeState(np.zeros(part.unit.size), 0.7, 5.0)
        assert part.advance(flat) == pytest.approx((LENGTH - 5.0) * (1.0 - e))

    def test_slope_and_prediction(self, prediction: locate_rod.ElasticaPrediction):
        """d lambda / d l against a difference along the branch; the predicted state is wrong by the step's square."""
        part = free_rod(0.05)
        length = prediction.last.length - 0.1
        state = part.solve(part.from_elastica(prediction.last), length=length)
        apart, rates = [], []
        for step in (0.02, 0.01):
            guess = part.moved(state, length + step)
            ahead = part.solve(guess, length=length + step)
            back = part.solve(part.moved(state, length - step), length=length - step)
            rates.append((part.advance(ahead) - part.advance(back)) / (2.0 * step))
            apart.append(np.abs(guess.state.q - ahead.q).max())
        assert part.slope(state) == pytest.approx((4.0 * rates[1] - rates[0]) / 3.0, abs=3e-6)
        assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)

    def test_a_guess_too_far(self, prediction: locate_rod.ElasticaPrediction):
        part = free_rod(0.1)
        guess = part.from_elastica(prediction.last)
        with pytest.raises(SolveError, match="near the prediction"):
            part.solve(Guess(guess.state, 0.0 * guess.predicted_stress), length=0.3 * prediction.last.length)


class TestCriticalPoint:
    def test_order_four(self, prediction: locate_rod.ElasticaPrediction):
        truth = elastica.critical(HEIGHT).advance
        errors = np.array([locate_rod.run(rod(1e-4), prediction, r).lam - truth for r in (2.0, 1.0, 0.5)])
        print("errors", errors)
        assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(4.0, abs=0.3)
        assert abs(errors[1]) < locate_rod.MESH_ERROR * truth

    def test_thickness(self, prediction: locate_rod.ElasticaPrediction):
        """lambda_c falls with h^2, and thick strips are reached by way of thinner ones."""
        h = np.array([0.2, 0.1, 0.05])
        distance = (
            np.array([locate_rod.run(rod(t), prediction, 1.0).lam for t in h])
            - locate_rod.run(rod(1e-4), prediction, 1.0).lam
        )
        assert distance / h**2 == pytest.approx(-5.9, abs=0.4)

    @pytest.mark.parametrize(("height", "end"), [(0.5, End.TOUCH), (1.58, End.TOUCH), (1.592, End.SNAP)])
    def test_touch_or_snap(self, height: float, end: End):
        """On either side of the limit, 1.58617 L*."""
        found = locate_rod.run(rod(1e-3), locate_rod.ElasticaPrediction.at(height), 0.5)
        truth = elastica.critical(height)
        assert found.end is end
        state = truth.state
        assert found.free_length == pytest.approx(state.length, abs=2e-3)
        assert found.lam == pytest.approx(state.advance, abs=2e-4)

    def test_too_short(self, prediction: locate_rod.ElasticaPrediction):
        """The elastica would just snap, the rod's free length at its maximum is shorter: the strip decides."""
        free = locate_rod.run(rod(0.05), prediction, 1.0).free_length
        assert locate_rod.run(rod(0.05, free - 0.02), prediction, 1.0).end is End.LIFTED
        assert locate_rod.run(rod(0.05, free + 0.02), prediction, 1.0).end is End.SNAP

    def test_too_thick(self):
        """Its strains at the tight fold of a low gripper are beyond what the law is for: an error, not a number."""
        with pytest.raises(SolveError):
            locate_rod.run(rod(0.3), locate_rod.ElasticaPrediction.at(0.5), 1.0)

    def test_estimates(self):
        """Random strips: the error is within the estimate, which is within the accuracy asked for."""
        rng = np.random.default_rng(5)
        for accuracy in (1e-2, 1e-4, 1e-6):
            height, thickness = float(rng.uniform(1.7, 9.0)), float(rng.uniform(0.005, 0.15))
            scene = scene_of(height, thickness, accuracy)
            found = critical.find(scene)
            truth = locate_rod.run(rod(thickness, 30.0), locate_rod.ElasticaPrediction.at(height), 0.15).lam
            error = abs(found.lambda_c / scene.material.gravity_length - truth) / truth
            print(accuracy, error, found.error / found.lambda_c)
            assert error <= found.error / found.lambda_c <= accuracy


def scene_of(height: float, thickness: float, accuracy: float) -> Scene:
    """A strip 30 L* long in metres."""
    unit = (3780.0 * 9.81) ** (-1.0 / 3.0)
    eta_m = thickness**2 / 12.0 * unit**2 * 3780.0
    return Scene(length=30.0 * unit, height=height * unit, eta_b=3780.0, eta_m=eta_m, model="rod", accuracy=accuracy)

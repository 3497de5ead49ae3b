"""Equilibria of a strip with internal friction: Newton's method, energy balance, dependence on the steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold.follow.contact_set import ROBUST_NEWTON
from stripfold.follow.statics import StripModel, lift
from stripfold.solve import newton
from stripfold.solve.problem import Equilibrium
from stripfold.strip.effects import Hysteresis, Pull
from stripfold.strip.problem import Lift, StripProblem


@pytest.fixture(scope="module")
def lifted():
    """A strip lifted to 1 L* without friction: model, state."""
    strip = StripModel(12.0, 0.02)
    ((_, at),) = lift(strip.contact_mesh(), [1.0])
    model = strip.model(48)
    problem = StripProblem(model, Lift())
    lies = problem.bounded[np.isin(problem.bounded, model.middle[model.s > at.contact[-1], 1])]
    q = at.model.resampled(at.u, model.s)
    return model, newton.solve(problem, q, 1.0, lies, options=ROBUST_NEWTON)


def onward(lifted, top: float, steps: int, *effects: Hysteresis | Pull) -> tuple[StripProblem, Equilibrium]:
    """Lift further in equal accepted steps: the problem and the state at the end."""
    model, last = lifted
    problem = StripProblem(model, Lift(), effects)
    for height in np.linspace(1.0, top, steps + 1)[1:]:
        last = newton.solve(problem, last.q, height, last.active, options=ROBUST_NEWTON)
        problem = problem.accepted(last.q)
    return problem, last


class TestNewton:
    """One step of 0.1 L*."""

    HEIGHT = 1.1
    # Below rounding: the residual history is as long as possible.
    OPTIONS = replace(ROBUST_NEWTON, force_tolerance=1e-11, largest_step=np.inf)

    def solve(self, lifted, *effects):
        model, state = lifted
        problem = StripProblem(model, Lift(), effects)
        return newton.solve(problem, state.q, self.HEIGHT, state.active, options=self.OPTIONS)

    @staticmethod
    def assert_quadratic(residuals: tuple[float, ...]) -> None:
        """The last iteration above rounding: from below 1e-4 to below 100 times the square."""
        print(residuals)
        last = np.flatnonzero(np.array(residuals) > 1e-7)[-1]
        assert residuals[last] < 1e-4
        assert residuals[last + 1] < 100.0 * residuals[last] ** 2

    def test_pull(self, lifted):
        """Quadratic; no effect at k_f = 0; a displacement in proportion to k_f."""
        model, state = lifted
        without = self.solve(lifted)
        np.testing.assert_array_equal(self.solve(lifted, Pull(model, 0.0, state.q)).q, without.q)
        away = []
        for k_f in (0.01, 0.02, 1.0):
            pulled = self.solve(lifted, Pull(model, k_f, state.q))
            self.assert_quadratic(pulled.residuals)
            assert len(pulled.residuals) <= len(without.residuals) + 1
            away.append(np.abs(pulled.q - without.q).max())
        assert away[0] > 1e-5
        assert away[1] / away[0] == pytest.approx(2.0, rel=0.05)

    @pytest.mark.parametrize(("moment", "yield_curvature"), [(0.05, 0.02), (0.2, 0.05)])
    def test_hysteresis(self, lifted, moment, yield_curvature):
        """Some elements slide, some stick: Newton's method still converges quadratically."""
        model, state = lifted
        effect = Hysteresis.of(model, moment, yield_curvature=yield_curvature, slack=state.q)
        there = self.solve(lifted, effect)
        self.assert_quadratic(there.residuals)
        share = np.abs(effect.moments(there.q)) / moment
        assert np.any(share > 0.999)
        assert np.any((share > 0.01) & (share < 0.99))
        assert effect.committed(there.q, np.zeros_like).dissipated > 0.0


class TestBranch:
    """Many steps."""

    def test_work_of_the_gripper(self, lifted):
        """The work of the gripper is the gain of elastic and potential energy, stored in the springs, and dissipated.

        Over small steps, by the trapezoidal rule; without the terms of the friction the balance is far off.
        """
        model, state = lifted
        problem = StripProblem(model, Lift(), (Hysteresis.of(model, 0.2, slack=state.q),))
        grasp = model.middle[0, 1]

        def energy(q):
            return model.energy(q) + float(model.weight @ q)

        last, work, before = state, 0.0, problem.residual(state.q, 1.0)[grasp]
        heights = np.linspace(1.0, 1.5, 41)
        for height in heights[1:]:
            last = newton.solve(problem, last.q, height, last.active, options=ROBUST_NEWTON)
            pull = problem.residual(last.q, height)[grasp]
            work += 0.5 * (before + pull) * (heights[1] - heights[0])
            before, problem = pull, problem.accepted(last.q)
        effect = problem.effects[0]
        gain = energy(last.q) - energy(state.q)
        print(work, gain, effect.stored(last.q), effect.dissipated)
        assert effect.dissipated > 0.05 * work
        assert gain + effect.stored(last.q) + effect.dissipated == pytest.approx(work, rel=5e-4)

    def test_hysteresis_does_not_depend_on_the_steps(self, lifted):
        """Four steps or eight give the same state, as each element is bent monotonically; with the pull they do not."""
        model, state = lifted

        def up(steps: int, *effects: Hysteresis | Pull) -> np.ndarray:
            return onward(lifted, 1.4, steps, *effects)[1].q

        def far(a: np.ndarray, b: np.ndarray) -> float:
            return float(np.abs(a - b).max())

        hysteresis = Hysteresis.of(model, 0.05, slack=state.q)
        rubbed, pulled = up(4, hysteresis), up(4, Pull(model, 0.1, state.q))
        assert far(rubbed, up(4)) > 1e-3
        assert hysteresis.dissipation(rubbed) > 1e-3
        assert far(rubbed, up(8, hysteresis)) < 1e-10
        assert far(pulled, up(8, Pull(model, 0.1, state.q))) > 1e-5

    def test_steps_where_elements_unbend(self, lifted):
        """When lifted to 3 L*, steps of 0.1 and of 0.05 L* agree to 1e-4 L* (docs/physics.md, section 8)."""
        model, state = lifted
        places, lost = [], []
        for steps in (20, 40):
            problem, there = onward(lifted, 3.0, steps, Hysteresis.of(model, 0.05, slack=state.q))
            places.append(there.q[model.middle[0, 0]])
            lost.append(problem.effects[0].dissipated)
        print(places, lost)
        assert 1e-8 < abs(places[1] - places[0]) < 1e-4
        assert lost[1] == pytest.approx(lost[0], rel=1e-3)

    def test_yield_curvature(self, lifted):
        """Halving the default moves the gripper by less than 0.005 L*, and less each time (docs/physics.md, section 8).

        The dissipation grows by a tenth.
        """
        model, state = lifted
        places, lost = [], []
        for yield_curvature in (0.1, 0.05, 0.025):
            effect = Hysteresis.of(model, 0.05, yield_curvature=yield_curvature, slack=state.q)
            problem, there = onward(lifted, 3.0, 40, effect)
            places.append(there.q[model.middle[0, 0]])
            lost.append(problem.effects[0].dissipated)
        print(places, lost)
        assert 0.0 < places[2] - places[1] < 0.8 * (places[1] - places[0])
        assert places[2] - places[1] < 0.005
        assert lost[2] / lost[1] == pytest.approx(1.1, abs=0.02)

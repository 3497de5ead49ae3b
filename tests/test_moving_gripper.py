"""A gripper that does not stop at the critical point, with friction in bending: statics, and motion in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold import elastica
from stripfold.analysis import moving_gripper
from stripfold.analysis.moving_gripper import DynamicSnap, static_limit
from stripfold.analysis.static import StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.solve import dynamics
from stripfold.solve.drive import Nudge
from stripfold.solve.schemes import Damping

STRIP, HEIGHT, REFINEMENT = StripModel(16.0, 0.08), 5.0, 3.0
SPEED, FRICTION = 0.02, 0.03


@pytest.fixture(scope="module")
def frictionless() -> float:
    return static_limit(STRIP, HEIGHT, 0.0, REFINEMENT)[1]


@pytest.fixture(scope="module")
def snap() -> DynamicSnap:
    return moving_gripper.run(STRIP, HEIGHT, FRICTION, SPEED, 0.3, 3.0, Damping(0.1, 0.05), REFINEMENT)


class TestStaticLimit:
    def test_without_friction_it_is_the_located_critical_point(self, frictionless: float):
        """Another algorithm on another mesh: arc length and a bracket of the fold."""
        assert frictionless == pytest.approx(solve_height(STRIP, HEIGHT).last.point.lam, abs=5e-3)

    def test_friction_delays_it(self, snap: DynamicSnap, frictionless: float):
        assert 0.1 < snap.static_limit - frictionless < 0.6

    def test_an_active_set_change_is_passed(self):
        """On this mesh one is a limit point, 0.2 L* before the fold; friction delays the fold past the elastica's."""
        _, limit = static_limit(StripModel(20.0, 0.0485, kind="rod"), 8.0, 0.01, 1.0)
        assert 0.05 < limit - elastica.critical(8.0).advance < 0.1

    @pytest.mark.parametrize(("length", "height", "reason"), [(16.0, 1.2, "touches before"), (6.0, HEIGHT, "lifted")])
    def test_without_a_snap(self, length: float, height: float, reason: str):
        with pytest.raises(SolveError, match=reason):
            static_limit(StripModel(length, 0.08), height, 0.0, REFINEMENT)


class TestMotion:
    def test_the_gripper_moves_at_its_speed(self, snap: DynamicSnap):
        t, lam = np.array([[state.t, state.lam] for state in snap.states]).T
        np.testing.assert_allclose(np.diff(lam), SPEED * np.diff(t), rtol=1e-9)
        assert lam[0] == pytest.approx(snap.static_limit - 0.3, abs=moving_gripper.STEP)

    def test_it_falls_past_the_limit_and_goes_on(self, snap: DynamicSnap):
        touch = snap.states[snap.touch]
        assert snap.static_limit < touch.lam < snap.static_limit + 1.0
        assert snap.states[-1].t >= touch.t + 3.0

    def test_it_starts_at_the_quasi_static_rate(self, snap: DynamicSnap):
        fastest = np.array([np.linalg.norm(state.v[snap.model.middle], axis=1).max() for state in snap.states])
        assert SPEED < fastest[0] < 10.0 * SPEED
        assert fastest.max() > 2.0 * fastest[0]

    def test_the_energy_balance_closes_and_friction_dissipates(self, snap: DynamicSnap):
        first, last = snap.states[0].energy, snap.states[-1].energy
        assert last.total - first.total == pytest.approx(last.work - last.lost, abs=1e-9)
        heat = [state.energy.friction for state in snap.states]
        assert heat[-1] > 0.02 * (first.total - min(state.energy.total for state in snap.states))
        # The friction springs release no more than they can store.
        assert min(np.diff(heat)) > -FRICTION * 0.05 * snap.model.length


def test_a_state_held_by_friction_stays_at_rest():
    """Without the memory of friction the same state starts to move at once."""
    steps, _ = static_limit(STRIP, HEIGHT, FRICTION, REFINEMENT)
    step = steps[len(steps) // 2]
    held = step.problem.accepted(step.point.q)
    largest = []
    for problem in (held, replace(held, effects=())):
        first = dynamics.start(problem, step.point.q, np.zeros(problem.size), step.point.lam, step.point.active)
        states = dynamics.march(problem, first, Nudge(step.point.lam))
        largest.append(max(next(states).energy.kinetic for _ in range(40)))
    assert largest[0] < 1e-12
    assert largest[1] > 1e-6

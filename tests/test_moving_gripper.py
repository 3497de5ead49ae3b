"""A gripper that does not stop at the critical point, with friction in bending: statics, and motion in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold.base.errors import SolveError
from stripfold.follow import time
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.time import static_limit
from stripfold.follow.track import Track, on_mesh
from stripfold.solve import dynamics
from stripfold.solve.drive import Nudge
from stripfold.solve.schemes import Damping

STRIP, HEIGHT, REFINEMENT = StripModel(16.0, 0.08), 5.0, 2.0
SPEED, FRICTION = 0.02, 0.03


@pytest.fixture(scope="module")
def frictionless() -> float:
    return static_limit(STRIP, HEIGHT, 0.0, REFINEMENT).lam


@pytest.fixture(scope="module")
def snap() -> Track:
    return time.through_snap(STRIP, HEIGHT, FRICTION, SPEED, 0.3, 3.0, Damping(0.1, 0.05), REFINEMENT)


class TestStaticLimit:
    def test_without_friction_it_is_the_located_critical_point(self, frictionless: float):
        """Another algorithm on another mesh: arc length and a bracket of the fold."""
        assert frictionless == pytest.approx(solve_height(STRIP, HEIGHT, 1.0).lam, abs=5e-3)

    def test_friction_delays_it(self, snap: Track, frictionless: float):
        assert 0.1 < snap.events[0].travelled - frictionless < 0.6

    @pytest.mark.parametrize(
        ("length", "height", "reason"), [(16.0, 1.2, "touches before"), (8.5, HEIGHT, "leaves the floor")]
    )
    def test_without_a_snap(self, length: float, height: float, reason: str):
        with pytest.raises(SolveError, match=reason):
            static_limit(StripModel(length, 0.08), height, 0.0, REFINEMENT)


class TestMotion:
    def test_the_gripper_moves_at_its_speed(self, snap: Track):
        t, lam = np.array([[state.t, state.lam] for state in snap.moments]).T
        np.testing.assert_allclose(np.diff(lam), SPEED * np.diff(t), rtol=1e-9)
        assert lam[0] == pytest.approx(snap.events[0].travelled - 0.3, abs=time.STEP)

    def test_it_falls_past_the_limit_and_goes_on(self, snap: Track):
        assert snap.touch is not None
        touch = snap.moments[snap.touch.index]
        assert snap.events[0].travelled < touch.lam < snap.events[0].travelled + 1.0
        assert snap.moments[-1].t >= touch.t + 3.0

    def test_it_starts_at_the_quasi_static_rate(self, snap: Track):
        middle = snap.points[0].problem.model.middle
        fastest = np.array([np.linalg.norm(state.v[middle], axis=1).max() for state in snap.moments])
        assert SPEED < fastest[0] < 10.0 * SPEED
        assert fastest.max() > 2.0 * fastest[0]

    def test_the_energy_balance_closes_and_friction_dissipates(self, snap: Track):
        first, last = snap.moments[0].energy, snap.moments[-1].energy
        # Each step leaves unbalanced forces of up to 1e-8, times the way.
        way = sum(
            np.abs(after.q - before.q).max() for before, after in zip(snap.moments, snap.moments[1:], strict=False)
        )
        assert last.total - first.total == pytest.approx(last.work - last.lost, abs=1e-8 * way)
        heat = [state.energy.friction for state in snap.moments]
        assert heat[-1] > 0.02 * (first.total - min(state.energy.total for state in snap.moments))
        # The friction springs release no more than they can store.
        assert min(np.diff(heat)) > -FRICTION * 0.05 * STRIP.length


def test_elements_are_fine_where_the_lift_off_passes():
    """Else the strip sticks and slips with each node that leaves the floor."""
    steps = static_limit(STRIP, HEIGHT, FRICTION, REFINEMENT).branch
    first, last = steps[len(steps) // 2], steps[-1]
    ends = time.model_in_time(last, REFINEMENT).ends
    passed = (ends[1:] > first.contact[-1]) & (ends[:-1] < last.contact[-1])
    assert np.diff(ends)[passed].max() < 0.11 * REFINEMENT


def test_a_state_held_by_friction_stays_at_rest():
    """Without the memory of friction the same state starts to move at once."""
    steps = static_limit(STRIP, HEIGHT, FRICTION, REFINEMENT).branch
    at = len(steps) // 2
    model = time.model_in_time(steps[-1], REFINEMENT)
    held, first = time.set_in_motion(steps[at - 1], steps[at], 0.0, model)
    largest = []
    for problem in (held, replace(held, effects=())):
        begin = dynamics.start(problem, first.q, np.zeros(problem.size), first.lam, first.active)
        states = dynamics.march(problem, begin, Nudge(first.lam))
        largest.append(max(next(states).energy.kinetic for _ in range(40)))
    assert largest[0] < 1e-12
    assert largest[1] > 1e-6


def test_the_state_on_a_fixed_mesh_is_the_static_one():
    """Its shape, and with its friction; without the memory it is another state."""
    steps = static_limit(STRIP, HEIGHT, FRICTION, REFINEMENT).branch
    at = len(steps) // 2
    model = time.model_in_time(steps[-1], REFINEMENT)
    problem, first = time.set_in_motion(steps[at - 1], steps[at], SPEED, model)
    s = np.linspace(0.0, STRIP.length, 40)
    moving, point = on_mesh(steps[at])
    before, after = (p.model.resampled_mid_surface(q, s) for p, q in ((moving, point.q), (problem, first.q)))
    assert np.abs(after - before).max() < 0.02
    moments = problem.effects[0].moments(first.q)
    expected = moving.effects[0].moments(point.q)
    middles = [0.5 * (model.ends[1:] + model.ends[:-1]) for model in (problem.model, moving.model)]
    there = np.interp(middles[0], middles[1], expected)
    assert np.mean(np.abs(moments - there)) < 0.1 * FRICTION
    assert np.abs(moments).max() > 0.9 * FRICTION
    grasp = first.v[problem.model.middle[0]]
    np.testing.assert_allclose(grasp, [SPEED, 0.0], atol=1e-3 * SPEED)

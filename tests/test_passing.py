"""A gripper that does not stop at the critical point, with friction in bending: statics, and motion in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stripfold import elastica
from stripfold.analysis import moving_gripper as passing
from stripfold.analysis.moving_gripper import Passage
from stripfold.analysis.static import StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.problem import AlongX
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Nudge
from stripfold.solve.schemes import Damping

STRIP, HEIGHT, REFINEMENT = StripModel(16.0, 0.08), 5.0, 3.0
SPEED, MOMENT = 0.02, 0.03


@pytest.fixture(scope="module")
def passage() -> Passage:
    return passing.run(STRIP, HEIGHT, MOMENT, SPEED, 0.3, 3.0, Damping(0.1, 0.05), REFINEMENT)


class TestToLoss:
    def test_without_friction_it_is_the_located_critical_point(self):
        """Another algorithm on another mesh: arc length and a bracket of the fold."""
        found = solve_height(STRIP, HEIGHT, 2.0).last.lam
        _, static = passing.to_loss(STRIP, HEIGHT, 0.0, REFINEMENT)
        assert static == pytest.approx(found, abs=5e-3)

    def test_friction_holds_the_strip_longer(self, passage: Passage):
        _, static = passing.to_loss(STRIP, HEIGHT, 0.0, REFINEMENT)
        assert 0.1 < passage.static - static < 0.6

    def test_a_contact_that_opens_is_no_loss(self):
        """On this mesh one does, 0.2 L* before the fold: with friction the strip holds longer than the elastica."""
        _, static = passing.to_loss(StripModel(20.0, 0.0485, kind="rod"), 8.0, 0.01, 1.0)
        assert 0.05 < static - elastica.critical(8.0).advance < 0.1

    def test_too_low_a_gripper_lays_the_strip_down(self):
        with pytest.raises(SolveError, match="touches before"):
            passing.to_loss(STRIP, 1.2, 0.0, REFINEMENT)

    def test_too_short_a_strip_is_lifted(self):
        with pytest.raises(SolveError, match="lifted"):
            passing.to_loss(StripModel(6.0, 0.08), HEIGHT, 0.0, REFINEMENT)


class TestPassage:
    def test_the_gripper_moves_at_its_speed(self, passage: Passage):
        t, lam = np.array([[m.t, m.lam] for m in passage.moments]).T
        np.testing.assert_allclose(np.diff(lam), SPEED * np.diff(t), rtol=1e-9)
        assert lam[0] == pytest.approx(passage.static - 0.3, abs=passing.STEP)

    def test_it_falls_past_the_loss_and_goes_on(self, passage: Passage):
        touch = passage.moments[passage.touch]
        assert passage.static < touch.lam < passage.static + 1.0
        assert passage.moments[-1].t >= touch.t + 3.0

    def test_it_begins_as_slowly_as_its_gripper(self, passage: Passage):
        model, first = passage.model, passage.moments[0]
        speeds = np.linalg.norm(first.v[model.middle], axis=1)
        assert SPEED < speeds.max() < 10.0 * SPEED
        fastest = max(np.linalg.norm(m.v[model.middle], axis=1).max() for m in passage.moments)
        assert fastest > 2.0 * speeds.max()

    def test_the_energy_balance_closes_and_friction_takes_its_part(self, passage: Passage):
        first, last = passage.moments[0].energy, passage.moments[-1].energy
        gain = last.total - first.total
        assert gain == pytest.approx(last.work - last.lost, abs=1e-9)
        heat = [m.energy.friction for m in passage.moments]
        assert heat[-1] > 0.02 * (first.total - min(m.energy.total for m in passage.moments))
        # The springs give back no more than they can keep.
        assert min(np.diff(heat)) > -MOMENT * 0.05 * passage.model.length


def test_a_state_that_friction_holds_stays_at_rest():
    """Without its memory the same state starts to move at once."""
    steps, _ = passing.to_loss(STRIP, HEIGHT, MOMENT, REFINEMENT)
    step = steps[len(steps) // 2]
    held = step.problem.accepted(step.point.q)
    free = replace(held, effects=())
    largest = {}
    for name, problem in (("held", held), ("free", free)):
        first = dynamics.start(problem, step.point.q, np.zeros(problem.size), step.point.lam, step.point.active)
        drive = Nudge(step.point.lam)
        moments = dynamics.march(problem, first, drive)
        largest[name] = max(next(moments).energy.kinetic for _ in range(40))
    assert isinstance(held.motion, AlongX)
    assert largest["held"] < 1e-12
    assert largest["free"] > 1e-6

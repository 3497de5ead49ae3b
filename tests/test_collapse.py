"""The way through a collapse: touch, rest, hand-over, and on; against what the elastica says of the laid-down strip."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from stripfold.base.errors import SolveError
from stripfold.follow import collapse, release
from stripfold.follow.collapse import Collapse
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.release import TIME_OPTIONS, Fall, ReleaseState
from stripfold.follow.static import StripModel
from stripfold.solve import dynamics
from stripfold.solve.schemes import Damping, EnergyMomentum

STRIP, HEIGHT = StripModel(15.0, 0.03), 1.8
FALL = Fall(1e-2, damping=Damping(0.2, 0.1))


@pytest.fixture(scope="module")
def found() -> Collapse:
    return collapse.simulate(STRIP, HEIGHT, FALL, refinement=1.5)


def test_it_goes_from_the_critical_point_to_the_end(found: Collapse) -> None:
    first, last = found.motion.states[0], found.motion.states[-1]
    assert first.lam == pytest.approx(found.run.lam, abs=0.012)
    assert last.lam == pytest.approx(found.run.last.point.lam + release.NUDGE)
    assert found.after[0][1].lam == last.lam
    assert found.end == "the gripper is above the held end"
    assert found.after[-1][1].lam >= STRIP.length
    assert all(point.negatives == 0 for _, point in found.after)


def test_nothing_penetrates_or_gains_energy(found: Collapse) -> None:
    bounded = found.motion.problem.bounded
    states = found.motion.states
    assert min(m.q[bounded].min() for m in states) >= 0.0
    closing = np.array([m.energy.closing for m in states])
    assert np.abs(closing).max() < 1e-9
    for name in ("air", "viscous", "contact", "numerical"):
        lost = np.array([getattr(m.energy, name) for m in states])
        assert np.all(np.diff(lost) >= -1e-15), name
        assert lost[-1] > 0.0, name


def test_the_ledger_is_the_energy(found: Collapse) -> None:
    """Independent of the integrator: the energies of the states themselves, and air drag by quadrature."""
    problem, states = found.motion.problem, found.motion.states
    first, last = states[0], states[-1]
    change = sum(problem.energies(last.q)) - sum(problem.energies(first.q)) - first.energy.kinetic
    energy = last.energy
    assert change == pytest.approx(energy.work - energy.lost - energy.kinetic, rel=1e-6)
    power = np.array([m.mean_v @ (problem.mass @ m.mean_v) for m in states[1:]])
    dt = np.array([m.dt for m in states[1:]])
    assert energy.air == pytest.approx(FALL.damping.air * float(power @ dt), rel=1e-6)


def test_the_touch_is_the_first(found: Collapse) -> None:
    model, motion = found.motion.problem.model, found.motion
    assert not any(touches(model, m) for m in motion.states[: motion.touch])
    at = motion.states[motion.touch]
    assert touches(model, at)
    # Bisection stops with a bracket that is short enough; its lower end need not be a state of the motion.
    before = motion.states[motion.touch - 1]
    if at.dt > release.TOUCH_TOLERANCE:
        _, drive = release.initial_state(ReleaseState.at(found.run.last, 1.5), FALL)
        scheme, shorter = EnergyMomentum(), at.dt - release.TOUCH_TOLERANCE
        almost = dynamics.step(found.motion.problem, before, shorter, drive, FALL.damping, scheme, TIME_OPTIONS)
        assert not touches(model, almost)
    # One way leads there: also where the touch was found by halving, each step begins where the last one ended.
    for before, after in pairwise(motion.states):
        assert after.t - before.t == pytest.approx(after.dt, rel=1e-6)
    column = int(np.argmin(np.abs(model.s - model.s[columns_on_floor(model, at)][0])))
    assert motion.touch_x == pytest.approx(model.mid_surface(at.q)[column, 0], abs=0.1)


def test_both_signs_end_in_the_same_state(found: Collapse) -> None:
    other = release.simulate_fall(ReleaseState.at(found.run.last, 1.5), replace(FALL, disturbance=-FALL.disturbance))
    middle = found.motion.problem.model.mid_surface
    apart = middle(other.states[-1].q) - middle(found.motion.states[-1].q)
    assert np.abs(apart).max() < 1e-3
    # Against the fall it takes longer: the disturbance has a direction.
    assert other.states[other.touch].t > found.motion.states[found.motion.touch].t


def test_a_moving_gripper(found: Collapse) -> None:
    motion = release.simulate_fall(ReleaseState.at(found.run.last, 1.5), replace(FALL, speed=0.02, to_rest=False))
    last = motion.states[-1]
    assert last.lam == pytest.approx(motion.states[0].lam + 0.02 * last.t)
    assert motion.touch == len(motion.states) - 1
    assert abs(last.energy.closing) < 1e-9


def test_no_snap_no_fall() -> None:
    with pytest.raises(SolveError, match="no fall to follow"):
        collapse.simulate(StripModel(12.0, 0.0594), 1.2, FALL, refinement=2.0)

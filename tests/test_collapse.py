"""The way through a collapse: touch, rest, hand-over, and on; against what the elastica says of the laid-down strip."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from stripfold import Strip, elastica
from stripfold.base.errors import InvalidInputError, SolveError
from stripfold.base.material import Material
from stripfold.follow import fall
from stripfold.follow.contact import columns_on_floor, touches
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.fall import TIME_OPTIONS, Fall, ReleaseState
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End, Track
from stripfold.solve import dynamics
from stripfold.solve.schemes import Damping, EnergyMomentum

STRIP, HEIGHT = StripModel(15.0, 0.03), 1.8
FALL = Fall(1e-2, damping=Damping(0.2, 0.1))


class Fallen:
    """A collapse by its parts: the state it falls from, the states before, of the fall and after it."""

    def __init__(self, track: Track) -> None:
        self.track, self.motion = track, track.states[track.falls[0]]
        self.before, self.after = track.states[: track.falls[0].start], track.states[track.falls[0].stop :]
        at = track.points[len(self.before) - 1]
        assert isinstance(at, BranchPoint)
        self.critical = at
        self.problem, self.states = self.motion[0].problem, track.moments
        touch = track.touch
        assert touch is not None
        self.touch, self.touch_x = touch.index - len(self.before), touch.x


@pytest.fixture(scope="module")
def found() -> Fallen:
    return Fallen(fall.collapse(STRIP, HEIGHT, FALL, refinement=1.5))


def test_it_goes_from_the_critical_point_to_the_end(found: Fallen) -> None:
    first, last = found.states[0], found.states[-1]
    assert first.lam == pytest.approx(found.track.events[0].travelled, abs=0.012)
    assert last.lam == pytest.approx(found.critical.lam + fall.NUDGE)
    assert found.after[0][1].lam == last.lam
    assert found.track.end is End.PATH
    assert found.after[-1][1].lam >= STRIP.length
    assert all(point.negatives == 0 for _, point in found.after)


def test_nothing_penetrates_or_gains_energy(found: Fallen) -> None:
    bounded = found.problem.bounded
    states = found.states
    assert min(m.q[bounded].min() for m in states) >= 0.0
    closing = np.array([m.energy.closing for m in states])
    assert np.abs(closing).max() < 1e-9
    for name in ("air", "viscous", "contact", "numerical"):
        lost = np.array([getattr(m.energy, name) for m in states])
        assert np.all(np.diff(lost) >= -1e-15), name
        assert lost[-1] > 0.0, name


def test_the_ledger_is_the_energy(found: Fallen) -> None:
    """Independent of the integrator: the energies of the states themselves, and air drag by quadrature."""
    problem, states = found.problem, found.states
    first, last = states[0], states[-1]
    change = sum(problem.energies(last.q)) - sum(problem.energies(first.q)) - first.energy.kinetic
    energy = last.energy
    assert change == pytest.approx(energy.work - energy.lost - energy.kinetic, rel=1e-6)
    power = np.array([m.mean_v @ (problem.mass @ m.mean_v) for m in states[1:]])
    dt = np.array([m.dt for m in states[1:]])
    assert energy.air == pytest.approx(FALL.damping.air * float(power @ dt), rel=1e-6)


def test_the_touch_is_the_first(found: Fallen) -> None:
    model, motion = found.problem.model, found
    assert not any(touches(model, m) for m in motion.states[: motion.touch])
    at = motion.states[motion.touch]
    assert touches(model, at)
    # Bisection stops with a bracket that is short enough; its lower end need not be a state of the motion.
    before = motion.states[motion.touch - 1]
    if at.dt > fall.TOUCH_TOLERANCE:
        _, drive = fall.initial_state(ReleaseState.at(found.critical, 1.5), FALL)
        scheme, shorter = EnergyMomentum(), at.dt - fall.TOUCH_TOLERANCE
        almost = dynamics.step(found.problem, before, shorter, drive, FALL.damping, scheme, TIME_OPTIONS)
        assert not touches(model, almost)
    # One way leads there: also where the touch was found by halving, each step begins where the last one ended.
    for before, after in pairwise(motion.states):
        assert after.t - before.t == pytest.approx(after.dt, rel=1e-6)
    column = int(np.argmin(np.abs(model.s - model.s[columns_on_floor(model, at)][0])))
    assert motion.touch_x == pytest.approx(model.mid_surface(at.q)[column, 0], abs=0.1)


def test_both_signs_end_in_the_same_state(found: Fallen) -> None:
    other = fall.simulate_fall(ReleaseState.at(found.critical, 1.5), replace(FALL, disturbance=-FALL.disturbance))
    middle = found.problem.model.mid_surface
    apart = middle(other.moments[-1].q) - middle(found.states[-1].q)
    assert np.abs(apart).max() < 1e-3
    # Against the fall it takes longer: the disturbance has a direction.
    assert other.moments[other.touch.index].t > found.states[found.touch].t


def test_a_moving_gripper(found: Fallen) -> None:
    motion = fall.simulate_fall(ReleaseState.at(found.critical, 1.5), replace(FALL, speed=0.02, to_rest=False))
    last = motion.moments[-1]
    assert last.lam == pytest.approx(motion.moments[0].lam + 0.02 * last.t)
    assert motion.end is End.TOUCH
    assert motion.touch is not None
    assert motion.touch.index == len(motion.points) - 1
    assert abs(last.energy.closing) < 1e-9


def test_no_snap_no_fall() -> None:
    with pytest.raises(SolveError, match="no fall to follow"):
        fall.collapse(StripModel(12.0, 0.0594), 1.2, FALL, refinement=2.0)


def test_statics_alone_end_at_the_critical_point() -> None:
    strip = Strip(length=0.4, eta_b=3780)
    with_fall = strip.collapse(0.06, model="rod", release={"until": "touch"})
    alone = strip.collapse(0.06, model="rod", effects={"inertia": "off"})
    assert alone.lambda_c == with_fall.lambda_c
    assert np.isnan(alone.touch).all()
    assert alone.dataset.attrs["end"] == "the critical point: statics alone do not lead past it"


class TestInternalFriction:
    """A fall with bending friction, from the static limit that it delays."""

    SCENE, MOMENT = Strip(length=0.6, eta_b=3780.0), 0.004

    @pytest.fixture(scope="class")
    def fallen(self):
        material = Material(3780.0)
        moment = self.MOMENT * material.force_scale * material.gravity_length
        return self.SCENE.collapse(0.09, model="rod", friction_moment=moment).dataset

    def test_it_delays_the_snap(self, fallen):
        """By the law of the elastica for small moments."""
        unit = Material(3780.0).gravity_length
        delay = (float(fallen.lambda_c) - self.SCENE.critical(0.09, model="rod").lambda_c) / unit
        assert delay == pytest.approx(elastica.friction_delay(0.09 / unit) * self.MOMENT, rel=0.1)

    def test_the_fall_is_followed_to_rest_and_dissipates(self, fallen):
        falling = fallen.isel(state=fallen.phase.values == "fall")
        assert float(fallen.touch_x) < 0.0
        assert "rest" in fallen.attrs["end"]
        assert float(falling.friction[-1]) > 1e-3 * float(abs(falling.elastic[0] - falling.elastic[-1]))
        assert np.abs(falling.closing.values).max() < 1e-9
        row = fallen.sel(effect="friction")
        assert bool(row.needed)
        assert bool(row.active)

    def test_a_last_static_state_that_is_almost_at_the_limit(self):
        """Here it is 0.006 L* before, where contact at nodes has no state any more: it falls from the one before."""
        material = Material(3780.0)
        unit = material.gravity_length
        moment, release = 0.01 * material.force_scale * unit, {"until": "touch"}
        found = self.SCENE.collapse(2.5 * unit, model="rod", friction_moment=moment, release=release)
        assert np.isfinite(found.touch).all()

    def test_it_is_off_or_on_as_asked(self):
        asked = {"model": "rod", "effects": {"friction": "off", "inertia": "off"}}
        off, without = (self.SCENE.collapse(0.09, friction_moment=moment, **asked).dataset for moment in (1e-5, 0.0))
        assert float(off.lambda_c) == float(without.lambda_c)
        assert "friction" in off.attrs["missing"].split(", ")
        with pytest.raises(InvalidInputError, match="friction_moment"):
            self.SCENE.collapse(0.09, effects={"friction": "on"})

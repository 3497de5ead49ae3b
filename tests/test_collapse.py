"""The way through a collapse: touch, rest, hand-over, and on; against what the elastica says of the laid-down strip."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

from stripfold import elastica
from stripfold.ask import collapse_record
from stripfold.ask.inputs import Simulation
from stripfold.base.errors import SolveError
from stripfold.follow import fall
from stripfold.follow.contact import columns_on_floor, touch_position, touches
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.fall import TIME_OPTIONS, Fall, ReleaseState
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End, Track
from stripfold.solve import dynamics
from stripfold.solve.schemes import Damping, EnergyMomentum
from stripfold.strip.problem import Opened, StripProblem
from stripfold.strip.rod import Rod

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


@pytest.fixture(scope="module")
def stored() -> tuple[Simulation, xr.Dataset]:
    asked = Simulation(length=0.3, height=0.054, eta_b=3780.0, disturbance=0.01, air=5.0)
    return asked, collapse_record.run(asked)


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


def test_what_lies_and_what_is_held_has_its_velocity(found: Fallen) -> None:
    """After an impact nothing on the floor goes into it, and the gripper and the pin go as they are driven."""
    problem, states = found.problem, found.states
    _, drive = fall.initial_state(ReleaseState.at(found.critical, 1.5), FALL)
    for state in states[1:]:
        assert np.abs(state.v[state.active]).max() < 1e-12
        np.testing.assert_allclose(state.v[problem.prescribed], [drive.rate(state.t), 0.0, 0.0, 0.0], atol=1e-12)


def test_it_ends_when_it_has_been_at_rest_for_a_while(found: Fallen) -> None:
    """A millionth of what was lost, for two time units: at the turn of an oscillation nothing moves either."""
    states, problem = found.states, found.problem
    kinetic, work = (np.array([getattr(m.energy, name) for m in states]) for name in ("kinetic", "work"))
    left = np.array([sum(problem.energies(m.q)) for m in states]) + kinetic - work
    share = kinetic / np.maximum(left[0] - left, 1e-12)
    t = np.array([m.t for m in states])
    assert share[t > t[-1] - 2.0].max() < 1e-6
    # And no later: before that it moved.
    assert share[t > t[-1] - 2.0 - 2.5 * TIME_OPTIONS.largest].max() > 1e-6


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


def test_what_lies_in_front_of_the_lying_part_does_not_touch() -> None:
    """A strip bent by friction beside its lift-off has nodes on the floor there; folded over it touches."""
    model = Rod.of(10.0, 0.05, elements=100)
    x, z = model.middle.T
    on_floor = (model.s < 2.0) | (model.s > 4.0)
    state = dynamics.start(StripProblem(model, Opened()), np.zeros(model.size), np.zeros(model.size), 0.0, z[on_floor])
    assert not touches(model, state)
    folded = state.q.copy()
    folded[x[model.s < 2.0]] = 8.0 - 2.0 * model.s[model.s < 2.0]
    assert touches(model, replace(state, q=folded))
    # All that lies is one part.
    assert not touches(model, replace(state, q=folded, active=z[model.s > 4.0]))


def test_where_it_touches_lies_between_nodes(found: Fallen) -> None:
    """The strip shifted and bent to a known parabola: its lowest point comes out, not the node's."""
    problem = found.problem
    model = problem.model
    state = found.states[found.touch]
    column = int(np.argmin(np.abs(model.s - model.s[columns_on_floor(model, state)][0])))
    lowest = model.s[column] + 0.3 * (model.s[column + 1] - model.s[column])
    q = state.q.copy()
    q[model.middle[:, 0]] = 0.25
    q[model.middle[:, 1]] = (model.s - lowest) ** 2
    expected = lowest - model.length / 2.0 + 0.25
    assert touch_position(problem.model, replace(state, q=q)) == pytest.approx(expected, abs=1e-9)


def test_a_lying_upper_layer_leaves_the_folded_loop(found: Fallen) -> None:
    """Truth: where the upper layer lies flat no horizontal force is left, and the loop is the elastica's folded one."""
    (problem, last) = found.after[-1]
    model = problem.model
    s = model.s[columns_on_floor(model, last)]
    gap = int(np.argmax(np.diff(s)))
    assert s[gap] - s[0] > 0.5, "the upper layer lies"
    shape = model.mid_surface(last.q)
    loop = shape[(model.s > s[gap]) & (model.s < s[gap + 1])]
    assert loop[:, 1].max() == pytest.approx(elastica.folded_loop().height, abs=6e-3)
    # And towards the gripper it is the strip that was lifted without horizontal force.
    rising = elastica.state_no_horizontal_force(HEIGHT)
    assert s[0] == pytest.approx(rising.length, abs=0.12)


def test_both_signs_end_in_the_same_state(found: Fallen) -> None:
    other = fall.simulate_fall(ReleaseState.at(found.critical, 1.5), replace(FALL, disturbance=-FALL.disturbance))
    middle = found.problem.model.mid_surface
    apart = middle(other.moments[-1].q) - middle(found.states[-1].q)
    assert np.abs(apart).max() < 1e-3
    # Against the fall it takes longer: the disturbance has a direction.
    assert other.moments[other.touch.index].t > found.states[found.touch].t


def test_the_disturbance_has_its_speed_and_direction(found: Fallen) -> None:
    first, drive = fall.initial_state(ReleaseState.at(found.critical, 1.5), FALL)
    problem = found.problem
    speed = np.linalg.norm(first.v[problem.model.middle], axis=1).max()
    assert speed == pytest.approx(FALL.disturbance)
    # Along the branch the strip moves as between two of its states.
    before, last = found.before[-2:]
    s = problem.model.s
    onwards = np.subtract(*(one.model.resampled_mid_surface(at.q, s) for one, at in (last, before)))
    assert np.sum(first.v[problem.model.middle] * onwards) > 0.0
    assert drive.lam(0.0) == found.states[0].lam
    # It is an equilibrium: what rounding leaves of its forces would make the light thickness unknowns fly.
    assert np.all(first.a == 0.0)


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


def test_what_is_not_at_rest_is_not_handed_over(found: Fallen) -> None:
    """The state at rest with its loop blown up: the equilibrium found from it is another state."""
    model, rest = found.problem.model, found.states[-1]
    fall.state_at_rest(found.problem, rest)
    q = rest.q.copy()
    height = model.mid_surface(q)[:, 1]
    q[model.middle[1:-1, 1]] += 0.2 * height[1:-1]
    with pytest.raises(SolveError, match=r"from the equilibrium|did not converge|inside out"):
        fall.state_at_rest(found.problem, replace(rest, q=q))


def test_dataset(stored: tuple[Simulation, xr.Dataset]) -> None:
    asked, data = stored
    phase = data["phase"].values
    assert list(dict.fromkeys(phase)) == ["before", "fall", "after"]
    assert all(var.attrs["units"] and var.attrs["long_name"] for var in data.variables.values())
    fall = data.isel(state=phase == "fall")
    assert float(data["lambda_c"]) == pytest.approx(float(fall["advance"][0]), rel=2e-3)
    assert float(data["lambda_0"]) == pytest.approx(float(data["advance"][0]))
    # SI, from what can be measured in the file itself.
    last = data.isel(state=-1)
    assert float(last["z"][0]) == pytest.approx(0.054)
    assert float(last["x"][0]) == pytest.approx(float(last["advance"]) - 0.15)
    assert float(last["x"][-1]) == pytest.approx(0.15)
    weights = np.gradient(data["arc"].values)
    gravity = 9.81 * (fall["z"].values @ weights)
    assert fall["gravity"].values - fall["gravity"].values[0] == pytest.approx(gravity - gravity[0], abs=2e-3)
    speed = np.gradient(fall["z"].values, fall["time"].values, axis=0) ** 2
    speed += np.gradient(fall["x"].values, fall["time"].values, axis=0) ** 2
    kinetic = 0.5 * speed @ weights
    assert kinetic.max() == pytest.approx(float(fall["kinetic"].max()), rel=0.1)
    assert fall["time"].values[0] == 0.0
    assert np.isnan(data["time"].values[phase != "fall"]).all()
    assert asked.time_unit < float(data["touch_time"]) < float(data["settle_time"])
    assert float(data["deflection"][0]) == 0.0


def test_what_is_stored_is_what_the_stored_shapes_say(stored: tuple[Simulation, xr.Dataset]) -> None:
    _, data = stored
    x, z, arc = (data[name].values for name in ("x", "z", "arc"))
    assert (arc[0], arc[-1]) == (0.0, pytest.approx(0.3))
    rms = np.sqrt(np.trapezoid((x - x[0]) ** 2 + (z - z[0]) ** 2, arc, axis=1) / 0.3)
    assert rms.max() > 0.05
    np.testing.assert_allclose(data["deflection"], rms, atol=1e-12)
    # The nodes between gripper and pin are those that can be on the floor.
    np.testing.assert_allclose(data["minimal_gap"], z[:, 1:-1].min(axis=1), atol=5e-6)
    assert (data["contacts"] > 0.0).all()


def test_the_parts_join(stored: tuple[Simulation, xr.Dataset]) -> None:
    """Statics end where the fall begins, and the numbers quoted are those of the states."""
    _, data = stored
    before, fall, after = (data.isel(state=data["phase"].values == name) for name in ("before", "fall", "after"))
    for name in ("advance", "x", "z", "elastic", "gravity"):
        # The same state on another mesh.
        np.testing.assert_allclose(before[name][-1], fall[name][0], rtol=0.01, atol=4e-3, err_msg=name)
    assert float(data["settle_time"]) == pytest.approx(float(fall["time"][-1]))
    touch = int(np.argmin(np.abs(fall["time"].values - float(data["touch_time"]))))
    assert float(fall["time"][touch]) == pytest.approx(float(data["touch_time"]))
    assert int(fall["contacts"][touch]) > int(fall["contacts"][touch - 1])
    free = fall["z"].values[touch - 1] > 1e-5
    down = int(np.argmin(np.where(free, fall["z"].values[touch], np.inf)))
    assert float(data["touch_x"]) == pytest.approx(float(fall["x"].values[touch][down]), abs=5e-3)
    for name in collapse_record.ENERGIES:
        assert np.isfinite(fall[name]).all(), name
        for statics in (before, after):
            expected = np.isfinite if name in collapse_record.IN_STATICS else np.isnan
            assert expected(statics[name]).all(), name
    for statics in (before, after):
        assert (statics["kinetic"] == 0.0).all()
        assert (statics["negatives"] == 0.0).all()
    assert np.isnan(fall["negatives"]).all()

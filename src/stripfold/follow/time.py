"""A strip followed in time under a gripper that moves: slowly along a path, or through a snap.

Along a path with friction between the layers, from the flat strip to rest at the path's end and, if asked for, to rest
after the gripper has opened.  In units of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from math import ceil, inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import NewtonError, SolveError
from stripfold.base.progress import FALL, SLOW, Percent
from stripfold.follow.contact import has_ruck, lies_apart, lift_off, touches
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.contact_set import NODAL_SIZES, ROBUST_NEWTON
from stripfold.follow.fall import TIME_OPTIONS as FALL_OPTIONS
from stripfold.follow.fall import TOUCH_TOLERANCE, Fall, to_rest
from stripfold.follow.memory import STEP, effects_of, load, with_effects
from stripfold.follow.statics import StripModel, from_flat, lift, start_along_x
from stripfold.follow.track import End, StripState, Track, grip_and_hold
from stripfold.paths.curve import GripperPath
from stripfold.paths.motion import StampedPath, TimedPath
from stripfold.solve import dynamics, newton
from stripfold.solve.dynamics import Drive, Moving, Nudge, TimeEvent, TimeOptions, TimeState
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.schemes import Damping
from stripfold.strip.effects import Hysteresis
from stripfold.strip.layer_friction import LayerFriction
from stripfold.strip.model import Model
from stripfold.strip.problem import AlongPath, Opened, StripProblem
from stripfold.strip.self_contact import SelfContact

SPEED = 0.2
"""Speed of the gripper, sqrt(g L*): 0.1 m/s with L* = 2.5 cm."""
ELEMENT = 0.1
"""Length of the elements, L*."""
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-4, newton=NewtonOptions(max_iterations=25))
"""Error per step, L*: that of a fall behind its first touch, as the state at rest counts.  Layers that begin to slide
need more iterations."""
BUMP_WIDTH = 8.98682
"""Width of a bump of small slopes times the root of the push: twice the least root of tan(a) = a."""
FINE = 34.0
"""Elements over its width, so that what is free does not jump by one of them under the push."""
CREEP, LOST, CREPT = 0.005, 0.05, 0.3
"""Speed of a gripper that creeps past a static limit, and of the strip at which it stops, sqrt(g L*); way in which that
has to happen, L*."""
MAX_STEPS = 20000
"""Steps in time within which a strip has to touch or fall."""
SIZES = replace(NODAL_SIZES, free=0.1)
"""Elements of the motion through a snap: friction delays it, and the lift-off passes more of the strip."""


class Ridge(NamedTuple):
    """A ridge across the table under the flat strip, a full wave of a cosine; ``place``: from the grasped end.

    Lengths in the unit of the places that it is asked for.
    """

    height: float
    width: float
    place: float

    @classmethod
    def worst(cls, states: Sequence[StripState], height: float) -> Ridge:
        """The one of this height that grows most easily: as wide as the bump, and behind the lift-off, L*.

        ``states``: static ones, of which that with the largest push counts.
        """
        push, problem, point = max((grip_and_hold(*state)[0][0], *state) for state in states)
        width = BUMP_WIDTH / sqrt(push)
        return cls(height, width, lift_off(problem.model, point) + width)

    def at(self, s: Array) -> Array:
        """Its height at distances from the grasped end."""
        share = np.clip((s - self.place) / self.width, -0.5, 0.5)
        return np.asarray(self.height * np.cos(pi * share) ** 2)


def rucks(found: Track) -> bool:
    """Whether what lies rucks on the way."""
    return any(has_ruck(problem.model, state) for problem, state in found.states)


def follow_in_time(
    strip: StripModel,
    path: GripperPath,
    mu: float,
    moment: float = 0.0,
    *,
    damping: Damping,
    yield_curvature: float | None = None,
    speed: float | TimedPath | StampedPath = SPEED,
    refinement: float = 1.0,
    ridge: Ridge | None = None,
    options: TimeOptions = TIME_OPTIONS,
    progress: Callable[[str], None] | None = None,
) -> Track:
    """Follow a path to its end and wait for rest.

    ``strip``, ``path``: the strip and the gripper's path, L*.  ``mu``: coefficient of friction between the layers and
    on the floor.  ``moment``: M_0 of the bending hysteresis, rho_a g L*^2.  ``damping``: physical damping.
    ``yield_curvature``: kappa_y of that hysteresis, 1/L*, or the usual one.  ``speed``: of the gripper, sqrt(g L*), or
    where it is when.  ``refinement``: factor on the element lengths, which are shorter where the strip lies on a
    ``ridge`` of the table.  ``progress``: called with a line on how much of the path is done.

    Raises SolveError: the first state cannot be computed; TimeStepError: as :func:`.fall.to_rest`.
    """
    element = ELEMENT * refinement if ridge is None else min(ELEMENT * refinement, ridge.width / FINE)
    model = strip.model(ceil(strip.length / element))
    problem = StripProblem(
        model,
        AlongPath(path, strip.length),
        self_contact=SelfContact.of(model, strip.thickness),
        table=None if ridge is None else ridge.at(model.s),
    )
    is_free = model.s < 1.0
    if ridge is not None:
        # As over a narrow one: contact is found faster than lost.
        is_free |= np.abs(model.s - ridge.place) < (72.0 * ridge.height) ** 0.25
        is_free[np.argmin(np.abs(model.s - ridge.place))] = False
    lies = np.setdiff1d(problem.bounded, model.middle[is_free, 1])
    # From the flat strip it might go over to another branch: a gripper that advances makes a thin one buckle at once.
    lifted = from_flat(strip.contact_mesh(refinement), path, strip.length)
    guess = lifted.model.resampled(lifted.point.q[: lifted.problem.n], model.s)
    q = newton.solve(problem, guess, lifted.lam, lies, options=ROBUST_NEWTON).q
    hysteresis = (Hysteresis.of(model, moment, yield_curvature=yield_curvature, slack=q),) if moment else ()
    layers = (LayerFriction.of(model, mu, q, problem.reaction),) if mu else ()
    problem = replace(problem, effects=(*hysteresis, *layers))
    on_floor = problem.bounded[q[problem.bounded] <= problem.lower]
    first = dynamics.start(problem, q, np.zeros(model.size), lifted.lam, on_floor)
    if isinstance(speed, TimedPath | StampedPath):
        drive: Drive = (timing := speed.starting_at(lifted.lam))
        moving = float(timing.t[-1])
    else:
        drive, moving = Moving(lifted.lam, speed, path.length), (path.length - lifted.lam) / speed
    return _followed(problem, first, drive, damping, options, moving, Percent(progress, "following the path in time"))


def opened(found: Track, damping: Damping, options: TimeOptions = TIME_OPTIONS) -> Track:
    """The strip at rest after its gripper has opened at the end of the path; errors as :func:`follow_in_time`."""
    before, last = found.states[-1]
    assert isinstance(last, TimeState)
    problem = replace(before.accepted(last.q), motion=Opened())
    on_floor = problem.bounded[last.q[problem.bounded] <= 0.0]
    return _followed(problem, replace(last, t=0.0, active=on_floor), Moving(last.lam, 0.0), damping, options, 0.0)


def _followed(
    problem: StripProblem,
    first: TimeState,
    drive: Drive,
    damping: Damping,
    options: TimeOptions,
    moving: float,
    moved: Percent | None = None,
    until: Sequence[TimeEvent] = (),
) -> Track:
    """To rest after the gripper has moved for some time, or to an earlier event."""
    states: list[StripState] = []
    for state in to_rest(problem, [first], drive, damping, options, *until, moving=moving):
        if moved is not None:
            moved(min(state.t / moving, 1.0))
        states.append(StripState(problem, state))
        # The march updates a problem of its own in the same way.
        problem = problem.accepted(state.q)
    return _in_time(states, End.REST)


def _in_time(states: Sequence[StripState], end: End, **known: Any) -> Track:
    return Track(tuple(states), end, (SLOW,) * len(states), **known)


def dissipated(found: Track) -> Array:
    """Energy dissipated by the friction between the layers before each state and in the end, shape (states + 1,)."""
    last, state = found.states[-1]
    problems = [*(problem for problem, _ in found.states), last.accepted(state.q)]
    return np.array([sum(e.dissipated for e in p.effects if isinstance(e, LayerFriction)) for p in problems])


def through_snap(
    strip: StripModel,
    height: float,
    friction: float,
    speed: float,
    before: float,
    after: float,
    damping: Damping,
    refinement: float = 1.0,
) -> Track:
    """Advance the gripper through the snap of a strip with bending friction, as a camera would film it.

    First statics with the memory of friction, in steps, up to the static limit, the last stable state; then motion in
    time from a state well before it, through the snap and past the first touch.

    ``strip``, ``height``: height in L*.  ``friction``: M_0 of the bending hysteresis, rho_a g L*^2; 0 for none.
    ``speed``: speed of the gripper, sqrt(g L*).  ``before``: distance before the static limit at which the motion in
    time begins, L*.  ``after``: duration after the first touch, sqrt(L*/g).

    Returns the motion in time; its event is the static limit, friction included.  Raises SolveError: there is no snap
    at this height, or a part could not be computed; TimeStepError: the motion could not be followed.
    """
    static = static_limit(strip, height, friction, refinement)
    steps, limit = [at for at in static.points if isinstance(at, BranchPoint)], static.lam
    lams = np.array([at.point.lam for at in steps])
    index = int(np.clip(np.searchsorted(lams, limit - before, side="right") - 1, 1, len(steps) - 1))
    problem, first = set_in_motion(steps[index - 1], steps[index], speed, model_in_time(steps[-1], refinement))
    states: list[StripState] = []
    landed = inf
    for state in dynamics.march(problem, first, Moving(first.lam, speed), damping, options=FALL_OPTIONS):
        states.append(StripState(problem, state))
        if landed == inf and touches(problem.model, state):
            landed = state.t
        if state.t > landed + after:
            return _in_time(states, End.TOUCH, events=static.events)
        if len(states) > MAX_STEPS:
            raise SolveError("the strip does not come down", parameter=state.lam)
    raise AssertionError("a motion does not end by itself")


def collapse_with_friction(
    strip: StripModel,
    height: float,
    friction: float,
    fall: Fall | None,
    refinement: float = 1.0,
    progress: Callable[[str], None] | None = None,
    self_contact: float | None = None,
    layer_friction: float = 0.0,
) -> Track:
    """Advance a strip with bending friction to its static limit and let it fall to rest, or to its first touch.

    ``friction``: M_0 of the bending hysteresis, rho_a g L*^2; the rest as for :func:`.fall.collapse`.  No mode is known
    of a strip with memory: a gripper that is to be held creeps on until the strip outruns it, without a disturbance.

    Raises SolveError: there is no snap at this height, a part could not be computed, or the strip did not fall;
    TimeStepError: the motion could not be followed.
    """
    say = progress or (lambda _: None)
    say("statics with friction to the limit")
    static = static_limit(strip, height, friction, refinement)
    if fall is None:
        return static
    problem, first = _released(static.branch, fall.speed or CREEP, refinement)
    model = problem.model
    if self_contact is not None:
        problem = replace(problem, self_contact=SelfContact.of(model, self_contact))
    if layer_friction:
        layers = LayerFriction.of(model, layer_friction, first.q, problem.reaction)
        problem = replace(problem, effects=(*problem.effects, layers))
    touching = TimeEvent(lambda state: lies_apart(model, state), TOUCH_TOLERANCE)
    until = [] if fall.to_rest else [touching]
    say("falling")
    if fall.speed:
        points = _followed(problem, first, Moving(first.lam, fall.speed), fall.damping, FALL_OPTIONS, 0.0, None, until)
        states = points.states
    else:
        lost = TimeEvent(lambda state: np.linalg.norm(state.v[model.middle], axis=1).max() > LOST)
        slow = Moving(first.lam, CREEP)
        states = _followed(
            problem, first, slow, fall.damping, FALL_OPTIONS, CREPT / CREEP, None, [lost, touching]
        ).states
        last, state = states[-1]
        assert isinstance(state, TimeState)
        held = Nudge(state.lam)
        fallen = _followed(last.accepted(state.q), state, held, fall.damping, FALL_OPTIONS, 0.0, None, until)
        states = (*states, *fallen.states[1:])
    motion = Track(states, End.REST if fall.to_rest else End.TOUCH, (FALL,) * len(states))
    if motion.touch is None:
        raise SolveError("the strip came to rest without touching", parameter=motion.lam)
    return static.then(motion)


def _released(branch: Sequence[BranchPoint], speed: float, refinement: float) -> tuple[StripProblem, TimeState]:
    """Set the last state in motion, or the one before it: so close to the limit other elements may have none."""
    first, before, at = branch[-3:]
    with suppress(NewtonError):
        return set_in_motion(before, at, speed, model_in_time(at, refinement))
    return set_in_motion(first, before, speed, model_in_time(before, refinement))


@lru_cache(maxsize=1)  # gripper speeds at one height share it
def static_limit(strip: StripModel, height: float, friction: float, refinement: float) -> Track:
    """The static steps along x up to the static limit.

    Raises SolveError: the sag touches before it, or the whole strip is lifted.
    """
    ((_, lifted),) = lift(strip.contact_mesh(refinement, memory=True), [height])
    first = with_effects(start_along_x(lifted, height), effects_of("hysteresis", friction))
    places = ((first.problem.motion, first.point.lam + STEP * n) for n in range(1, MAX_STEPS))
    found = load(first, places, until="touch")
    if found.end is End.TOUCH:
        raise SolveError("the sag touches before the strip snaps", parameter=found.lam)
    return found


def model_in_time(last: BranchPoint, refinement: float) -> Model:
    """The strip on a fixed mesh, fine at the lift-off of the last static state: contact is node by node."""
    mesh = replace(last.problem.mesh, sizes=SIZES.scaled(refinement))
    return mesh.replanned(last.contact).model


def set_in_motion(before: BranchPoint, at: BranchPoint, speed: float, model: Model) -> tuple[StripProblem, TimeState]:
    """A static state on a fixed mesh, at the rate at which the strip moves from the state before to this one."""
    lam = at.point.lam
    held = at.problem.accepted(at.point.q).at(at.contact)
    problem = StripProblem(model, at.problem.motion, tuple(effect.on(held.model, model) for effect in held.effects))
    lies = problem.bounded[np.isin(problem.bounded, model.middle[model.s >= at.contact[-1], 1])]
    q, q_before = (state.model.resampled(state.u, model.s) for state in (at, before))
    state = newton.solve(problem, q, lam, lies, options=ROBUST_NEWTON)
    rate = (q - q_before) / (lam - before.point.lam)
    rate[state.active] = 0.0
    return problem, dynamics.start(problem, state.q, speed * rate, lam, state.active)

"""A strip let go from an unstable state: dynamics to its first touch and to rest, and back to statics.

All in units of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from stripfold.analysis.static import ROBUST_NEWTON, X_STEPS, contact_positions, touches
from stripfold.arrays import Array
from stripfold.errors import NewtonError, SolveError, TimeStepError
from stripfold.problem import StripProblem
from stripfold.solve import continuation, dynamics
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.dynamics import Drive, Moving, Nudge, TimeOptions, TimeState
from stripfold.solve.problem import Point
from stripfold.solve.schemes import Damping, EnergyMomentum, Scheme

Progress = Callable[[str], None]

NUDGE = 0.01
"""How far a held gripper is moved past lambda_c, smoothly within one time unit, L*: there no equilibrium is near, also
not one that a tooth of the contact would hold (docs/method.md)."""
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-5)
TOUCH_TOLERANCE = 1e-3
"""Time within which the first touch is located."""
PATIENCE = 400.0
"""Time after which a strip that has not touched is taken to stay; longer with damping, which slows the start."""
REST = 1e-6
"""Kinetic energy, as a share of what has been released, of a strip at rest."""
QUIET = 2.0
"""Time for which it has to stay below: an oscillation turns faster."""
AWAY = 0.1
"""How far a strip has to have moved for a rest without a touch to be its motion's end, L*: a slow start is no rest."""
SAME_STATE = 0.1
"""Largest distance between the strip at rest and the equilibrium it is handed over to, L*."""


@dataclass(frozen=True, slots=True)
class Fall:
    """How the strip is let go.

    Attributes
    ----------
    disturbance
        Largest speed of the mid-surface in the initial velocity along the critical eigenvector; positive in the
        direction in which the branch goes on, negative against it.  A velocity and not a displacement: that would
        stretch a thin strip by its square.
    speed
        Speed of the gripper; with 0 it is held just past lambda_c.
    damping
        Physical damping.
    to_rest
        Whether to go on from the first touch until the strip is at rest.
    """

    disturbance: float = 1e-3
    speed: float = 0.0
    damping: Damping = field(default_factory=Damping)
    to_rest: bool = True


@dataclass(frozen=True, eq=False)
class Motion:
    """The dynamic part.

    Attributes
    ----------
    states
        All accepted states, from lambda_c on.
    touch
        Index of the first state at which the falling part touches; None where it came to rest without.
    touch_x
        Where it touches, x in the frame of the model (origin mid-strip); nan without a touch.
    """

    states: tuple[TimeState, ...]
    touch: int | None
    touch_x: float


@dataclass(frozen=True, eq=False)
class ReleaseState:
    """The state from which a strip is let go.

    Attributes
    ----------
    problem, point, mode
        The state, what it solves, and the eigenvector along which it is disturbed.
    nudge
        How far a held gripper is moved on first, L*; 0 from a state that is unstable itself.
    """

    problem: StripProblem
    point: Point
    mode: Array
    nudge: float = NUDGE

    @classmethod
    def at(cls, problem: StripProblem, found: CriticalPoint) -> ReleaseState:
        """Let go at a critical point."""
        return cls(problem, found.before, found.mode)


def initial_state(release: ReleaseState, fall: Fall) -> tuple[TimeState, Drive]:
    """The first state of a fall, and how the gripper moves in it."""
    problem, point = release.problem, release.point
    middle = problem.model.middle
    mode = release.mode / np.linalg.norm(release.mode[middle], axis=1).max()
    if problem.mass @ mode @ point.tangent.q < 0.0:
        mode = -mode
    v = fall.disturbance * mode
    first = dynamics.start(problem, point.q, v, point.lam, point.state.active)
    drive = Moving(point.lam, fall.speed) if fall.speed else Nudge(point.lam, release.nudge)
    return first, drive


def simulate_fall(
    release: ReleaseState,
    fall: Fall,
    options: TimeOptions = TIME_OPTIONS,
    progress: Progress | None = None,
    scheme: Scheme | None = None,
) -> Motion:
    """From an unstable state to the first touch and, if asked for, to rest.

    A strip that comes to rest elsewhere without touching has its motion end there.

    Raises
    ------
    SolveError
        Nothing happened, or the strip does not come to rest.
    TimeStepError
        No time step succeeds.
    """
    say = progress or (lambda _: None)
    problem = release.problem
    if problem.effects:
        # The search for the touch goes back in time; what an effect remembers does not.
        raise ValueError("a fall is for problems without effects")
    first, drive = initial_state(release, fall)
    motion = _Marching(problem, drive, fall.damping, options, scheme or EnergyMomentum())
    states, touched = _to_touch(motion, first)
    if not touched:
        say(f"at rest without a touch after {states[-1].t:.1f} sqrt(L*/g)")
        return Motion(tuple(states), None, float("nan"))
    touch = len(states) - 1
    say(f"touch after {states[-1].t:.1f} sqrt(L*/g)")
    if fall.to_rest:
        states += _to_rest(motion, states[0], states[-1])
    return Motion(tuple(states), touch, touch_position(problem, states[touch]))


@dataclass(frozen=True)
class _Marching:
    """A problem with all that its motion needs."""

    problem: StripProblem
    drive: Drive
    damping: Damping
    options: TimeOptions
    scheme: Scheme

    def march(self, first: TimeState) -> Iterator[TimeState]:
        """States from ``first`` on; an error gets the shape of the strip at the last good one."""
        try:
            yield from dynamics.march(self.problem, first, self.drive, self.damping, self.scheme, self.options)
        except TimeStepError as error:
            error.details["mid_surface"] = self.problem.model.mid_surface(error.last.q)
            raise

    def step(self, before: TimeState, dt: float) -> TimeState:
        """One step."""
        return dynamics.step(self.problem, before, dt, self.drive, self.damping, self.scheme, self.options)

    def out_of_patience(self, state: TimeState, since: float, what: str, advice: str) -> None:
        """Raise when the motion goes on for too long."""
        if state.t - since > PATIENCE * (1.0 + self.damping.air + self.damping.stiffness):
            raise TimeStepError(
                f"{what} within {state.t - since:.0f} sqrt(L*/g)",
                parameter=state.lam,
                advice=advice,
                last=state,
                details={"mid_surface": self.problem.model.mid_surface(state.q)},
            )


def _to_touch(motion: _Marching, first: TimeState) -> tuple[list[TimeState], bool]:
    """All states up to the first at which the falling part touches, or at which it rests elsewhere; which it is."""
    model = motion.problem.model
    states: list[TimeState] = []
    at_rest = _Rest(first)
    for state in motion.march(first):
        if touches(model, state):
            return (states + _locate_touch(motion, states[-1], state) if states else [state]), True
        states.append(state)
        if at_rest(state) and model.largest_move(first.q, state.q) > AWAY:
            return states, False
        motion.out_of_patience(state, first.t, "nothing happened: the strip did not touch", "give a larger disturbance")
    raise AssertionError("a motion does not end by itself")


def _to_rest(motion: _Marching, first: TimeState, touch: TimeState) -> list[TimeState]:
    """The states after the touch until the strip rests; for a moving gripper there is no rest."""
    states: list[TimeState] = []
    at_rest = _Rest(first)
    for state in motion.march(touch):
        if state is touch:
            continue
        states.append(state)
        advice = "add damping, hold the gripper, or ask for the touch only"
        motion.out_of_patience(state, touch.t, "the strip did not come to rest", advice)
        if at_rest(state):
            return states
    raise AssertionError("a motion does not end by itself")


class _Rest:
    """Whether a motion has ended: its kinetic energy has stayed small, for a while."""

    def __init__(self, first: TimeState) -> None:
        self.potential = first.energy.elastic + first.energy.gravity
        self.quiet_since = inf

    def __call__(self, state: TimeState) -> bool:
        released = self.potential - state.energy.elastic - state.energy.gravity
        if state.energy.kinetic > REST * released:
            self.quiet_since = inf
            return False
        self.quiet_since = min(self.quiet_since, state.t)
        return state.t - self.quiet_since > QUIET


def _locate_touch(motion: _Marching, before: TimeState, after: TimeState) -> list[TimeState]:
    """Bisect for the first touch: the states found before it, and the first one with it."""
    nearer: list[TimeState] = []
    at = before
    leading = 0  # how many of them lead up to ``after``; each was stepped to from the one before
    length = after.t - before.t
    while length > TOUCH_TOLERANCE:
        length /= 2.0
        try:
            middle = motion.step(at, length)
        except NewtonError:
            continue
        if touches(motion.problem.model, middle):
            after, leading = middle, len(nearer)
        else:
            at = middle
            nearer.append(middle)
    return [*nearer[:leading], after]


def touch_position(problem: StripProblem, state: TimeState | Point) -> float:
    """Where the falling part touches: x of the lowest point of a parabola through three nodes, origin mid-strip."""
    model = problem.model
    s = contact_positions(model, state)
    gap = int(np.flatnonzero(np.diff(s) > 1.0)[0])
    column = int(np.argmin(np.abs(model.s - s[gap])))
    near = slice(max(column - 1, 0), column + 2)
    position = model.mid_surface(state.q)[near]
    local = model.s[near] - model.s[column]
    curve, slope, _ = np.polyfit(local, position[:, 1], 2)
    lowest = float(np.clip(-slope / (2.0 * curve), local[0], local[-1])) if curve > 0.0 else 0.0
    return float(np.polyval(np.polyfit(local, position[:, 0], 2), lowest))


def state_at_rest(problem: StripProblem, state: TimeState) -> Point:
    """The equilibrium that a strip at rest is handed over to.

    Raises
    ------
    SolveError
        It does not converge, is another state, or is not stable.
    """
    options = replace(X_STEPS, newton=ROBUST_NEWTON)
    point = continuation.start(problem, state.q, state.lam, state.active, 1.0, options)
    distance = problem.model.largest_move(state.q, point.q)
    if distance > SAME_STATE:
        raise SolveError(f"the strip at rest is {distance:.2g} L* from the equilibrium found from it")
    if point.negatives:
        raise SolveError("the state at rest is not stable")
    return point

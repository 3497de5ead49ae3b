"""One strip past its critical point: statics to lambda_c, dynamics to rest, statics again (the paper's section IV).

All in units of L*, sqrt(L*/g) and rho_a g L*; :mod:`.collapse_data` stores it in SI.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from .. import planning
from ..errors import NewtonError, SolveError, TimeStepError
from ..problem import AlongX, StripProblem
from ..solve import continuation, dynamics
from ..solve.dynamics import Drive, Moment, Moving, Nudge, TimeOptions
from ..solve.problem import Point
from ..solve.schemes import Damping, EnergyMomentum
from .static import PATIENT, X_STEPS, End, Strip, XRun, along_x, contact_positions, lift, lift_off, touches

Array = NDArray[np.float64]
Progress = Callable[[str], None]

SIZES = planning.Sizes(free=0.15, lying=0.15)
"""The loop rolls over all of the strip: no part may be coarse."""
NUDGE = 0.01
"""How far a held gripper is moved past lambda_c, smoothly within one time unit, L*: there no equilibrium is near, also
not one that a tooth of the contact would hold (docs/numerics.md)."""
TIME_OPTIONS = TimeOptions(first=0.02, tolerance=1e-5)
TOUCH_TOLERANCE = 1e-3
"""Time within which the first touch is located."""
PATIENCE = 400.0
"""Time after which a strip that has not touched is taken to stay; longer with damping, which slows the start."""
REST = 1e-6
"""Kinetic energy, as a share of what has been released, of a strip at rest."""
QUIET = 2.0
"""Time for which it has to stay below: an oscillation turns faster."""
SAME_STATE = 0.1
"""Largest distance between the strip at rest and the equilibrium it is handed over to, L*."""
BACK = 0.2
"""How far lambda may fall back while the settled strip is followed: less is a contact's tooth, L*."""
MOST_POINTS = 1500


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
    moments
        All accepted moments, from lambda_c on.
    touch
        Index of the first moment at which the falling part touches.
    touch_x
        Where it touches, x in the frame of the model (origin mid-strip).
    """

    moments: tuple[Moment, ...]
    touch: int
    touch_x: float


@dataclass(frozen=True, eq=False)
class Collapse:
    """The whole: static run, fall, and the static points from the state at rest on (empty if it was not asked for)."""

    height: float
    run: XRun
    motion: Motion
    after: tuple[Point, ...]
    end: str


def simulate(
    strip: Strip, height: float, fall: Fall, refinement: float = 1.0, progress: Progress | None = None
) -> Collapse:
    """Lift the strip, move its gripper to lambda_c, let it fall, and move on until the gripper is above the held end.

    Raises
    ------
    SolveError
        There is no snap at this height, a part could not be computed, or the strip did not fall.
    TimeStepError
        The motion could not be followed; with the last good moment.
    """
    say = progress or (lambda _: None)
    say("following the branch to its critical point")
    run = to_critical_point(strip, height, refinement)
    motion = let_fall(run, fall, progress=say)
    if not fall.to_rest:
        return Collapse(height, run, motion, (), "first touch")
    say("going on from the state at rest")
    after, end = go_on(run.problem, motion.moments[-1])
    return Collapse(height, run, motion, after, end)


def to_critical_point(strip: Strip, height: float, refinement: float = 1.0) -> XRun:
    """The static run, on a mesh on which the strip can also be laid down and rolled on.

    Raises
    ------
    SolveError
        It cannot be computed, or there is no snap at this height.
    """
    sweep = planning.lift_off_sweep(height)
    mesh = planning.boundaries(strip.length, sweep, refinement, SIZES)
    (_, model, state) = next(lift(strip, [height]))
    run = along_x(strip, height, (model, state), mesh, past=0.0)
    if run.critical is None:
        raise SolveError(f"there is no fall to follow: {run.end.reason}", advice="choose a height that snaps")
    return run


def beginning(run: XRun, fall: Fall) -> tuple[Moment, Drive]:
    """The first moment of a fall, and how the gripper moves in it."""
    found = run.critical
    assert found is not None
    problem, point = run.problem, found.before
    middle = problem.model.middle
    mode = found.mode / np.linalg.norm(found.mode[middle], axis=1).max()
    if problem.mass @ mode @ point.tangent.q < 0.0:
        mode = -mode
    v = fall.disturbance * mode
    first = dynamics.start(problem, point.q, v, point.lam, point.state.active)
    drive = Moving(point.lam, fall.speed) if fall.speed else Nudge(point.lam, NUDGE)
    return first, drive


def let_fall(run: XRun, fall: Fall, options: TimeOptions = TIME_OPTIONS, progress: Progress | None = None) -> Motion:
    """From the critical point to the first touch and, if asked for, to rest.

    Raises
    ------
    SolveError
        Nothing happened, or the strip does not come to rest.
    TimeStepError
        No time step succeeds.
    """
    say = progress or (lambda _: None)
    problem = run.problem
    first, drive = beginning(run, fall)
    motion = _Marching(problem, drive, fall.damping, options)
    moments = _to_touch(motion, first)
    touch = len(moments) - 1
    say(f"touch after {moments[-1].t:.1f} sqrt(L*/g)")
    if fall.to_rest:
        moments += _to_rest(motion, moments[0], moments[-1])
    return Motion(tuple(moments), touch, touch_position(problem, moments[touch]))


@dataclass(frozen=True)
class _Marching:
    """A problem with all that its motion needs."""

    problem: StripProblem
    drive: Drive
    damping: Damping
    options: TimeOptions
    scheme: EnergyMomentum = field(default_factory=EnergyMomentum)

    def march(self, first: Moment) -> Iterator[Moment]:
        """Moments from ``first`` on; an error gets the shape of the strip at the last good one."""
        try:
            yield from dynamics.march(self.problem, first, self.drive, self.damping, self.scheme, self.options)
        except TimeStepError as error:
            error.details["mid_surface"] = self.problem.model.mid_surface(error.last.q)
            raise

    def step(self, before: Moment, dt: float) -> Moment:
        """One step."""
        return dynamics.step(self.problem, before, dt, self.drive, self.damping, self.scheme, self.options)

    def out_of_patience(self, moment: Moment, since: float, what: str, advice: str) -> None:
        """Raise when the motion goes on for too long."""
        if moment.t - since > PATIENCE * (1.0 + self.damping.air + self.damping.stiffness):
            raise TimeStepError(
                f"{what} within {moment.t - since:.0f} sqrt(L*/g)",
                parameter=moment.lam,
                advice=advice,
                last=moment,
                details={"mid_surface": self.problem.model.mid_surface(moment.q)},
            )


def _to_touch(motion: _Marching, first: Moment) -> list[Moment]:
    """All moments up to the first at which the falling part touches."""
    model = motion.problem.model
    moments: list[Moment] = []
    for moment in motion.march(first):
        if moments and touches(model, moment):
            return moments + _locate_touch(motion, moments[-1], moment)
        moments.append(moment)
        motion.out_of_patience(
            moment, first.t, "nothing happened: the strip did not touch", "give a larger disturbance"
        )
    raise AssertionError("a motion does not end by itself")


def _to_rest(motion: _Marching, first: Moment, touch: Moment) -> list[Moment]:
    """The moments after the touch until the strip rests; for a moving gripper there is no rest."""
    moments: list[Moment] = []
    quiet_since = inf
    potential = first.energy.elastic + first.energy.gravity
    for moment in motion.march(touch):
        if moment is touch:
            continue
        moments.append(moment)
        advice = "add damping, hold the gripper, or ask for the touch only"
        motion.out_of_patience(moment, touch.t, "the strip did not come to rest", advice)
        released = potential - moment.energy.elastic - moment.energy.gravity
        if moment.energy.kinetic > REST * released:
            quiet_since = inf
        else:
            quiet_since = min(quiet_since, moment.t)
            if moment.t - quiet_since > QUIET:
                return moments
    raise AssertionError("a motion does not end by itself")


def _locate_touch(motion: _Marching, before: Moment, after: Moment) -> list[Moment]:
    """Bisect for the first touch: the moments found before it, and the first one with it."""
    nearer: list[Moment] = []
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


def touch_position(problem: StripProblem, moment: Moment | Point) -> float:
    """Where the falling part touches: x of the lowest point of a parabola through three nodes, origin mid-strip."""
    model = problem.model
    s = contact_positions(model, moment)
    gap = int(np.flatnonzero(np.diff(s) > 1.0)[0])
    column = int(np.argmin(np.abs(model.s - s[gap])))
    near = slice(max(column - 1, 0), column + 2)
    position = model.mid_surface(moment.q)[near]
    local = model.s[near] - model.s[column]
    curve, slope, _ = np.polyfit(local, position[:, 1], 2)
    lowest = float(np.clip(-slope / (2.0 * curve), local[0], local[-1])) if curve > 0.0 else 0.0
    return float(np.polyval(np.polyfit(local, position[:, 0], 2), lowest))


def settled(problem: StripProblem, moment: Moment) -> Point:
    """The equilibrium that a strip at rest is handed over to.

    Raises
    ------
    SolveError
        It does not converge, is another state, or is not stable.
    """
    model = problem.model
    static_problem = StripProblem(model, AlongX(_height(problem)))
    options = replace(X_STEPS, newton=PATIENT)
    point = continuation.start(static_problem, moment.q, moment.lam, moment.active, 1.0, options)
    distance = np.linalg.norm(model.mid_surface(point.q) - model.mid_surface(moment.q), axis=1).max()
    if distance > SAME_STATE:
        raise SolveError(f"the strip at rest is {distance:.2g} L* from the equilibrium found from it")
    if point.negatives:
        raise SolveError("the state at rest is not stable")
    return point


def _height(problem: StripProblem) -> float:
    assert isinstance(problem.motion, AlongX)
    return problem.motion.height


def go_on(problem: StripProblem, rest: Moment) -> tuple[tuple[Point, ...], str]:
    """Follow the settled strip until its gripper is above the held end; the points, and what ended the motion."""
    model = problem.model
    first = settled(problem, rest)
    points = [first]
    highest = first.lam
    branch = continuation.follow(problem, first, X_STEPS)
    next(branch)
    for point in branch:
        points.append(point)
        highest = max(highest, point.lam)
        if point.lam >= model.length:
            return tuple(points), "the gripper is above the held end"
        if lift_off(model, point) > model.length - 0.5:
            return tuple(points), End.LIFTED.value
        if point.lam < highest - BACK:
            return tuple(points), "another critical point"
        if len(points) >= MOST_POINTS:
            raise SolveError("the settled strip could not be followed to the end of the motion", parameter=point.lam)
    raise AssertionError("a branch does not end by itself")

"""Assessment of a gripper path: critical points, first touch, quality of the fold (the paper's section V).

Statics along the path to a critical point, the fall from there to rest, statics on, until the path ends.  All in units
of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.collapse import nodes
from stripfold.follow.contact import lift_off, touch_position, touches
from stripfold.follow.contact_branch import STEPS, BranchPoint
from stripfold.follow.path_statics import MOVING, State, StaticSegment, follow
from stripfold.follow.release import (
    Fall,
    Motion,
    Progress,
    ReleaseState,
    at_rest,
    simulate_fall,
)
from stripfold.follow.static import StripModel
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import HalfFold
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point
from stripfold.strip.problem import StripProblem

SNAP, BIFURCATION = KINDS = "snap-through", "bifurcation"
"""At a snap-through the state ceases to exist, at a bifurcation two states meet."""
LARGEST_BIFURCATION_ANGLE = 15.0
"""Angle between path and stability boundary, degrees, below which a critical point is a bifurcation.

At a snap the path crosses the boundary, at 75 degrees or more on the paper's paths.  A path planned on the elastica
touches it; for a strip of thickness h it crosses at an angle that vanishes with h, up to 13 degrees in the study
tangency: an unfolded bifurcation.
"""
MAX_FALLS = 5
"""Falls along one path: a strip that falls more often is not being folded."""
BUMP = 15.6976
"""Height times F^2 of a bump in a beam that lies and is pushed by F, L* (rho_a g L*)^2: in unstable equilibrium.

A lower one stays, a higher one grows.  Its second derivative vanishes where it lifts off, too (Hobbs, J. Transp. Eng.
110, 175, 1984); of small slopes, that is for heights of a small part of L*.
"""
NO_PUSH = 1e-3
"""Push that counts as none, rho_a g L*: forces are solved for to less."""
Followed = tuple[StripProblem, Point | TimeState]
"""A state in statics or in time, with what it solves."""


@dataclass(frozen=True, eq=False)
class CriticalEvent:
    """A critical point on a path.

    ``travelled``, ``place``: length travelled, and where the gripper is, (x, z).  ``kind``: one of :data:`KINDS`.
    ``angle``: between the path and the stability boundary, degrees.  ``found``: the located point.
    """

    travelled: float
    place: Array
    kind: str
    angle: float
    found: CriticalPoint


@dataclass(frozen=True, eq=False)
class Touchdown:
    """The first touch: length travelled, x of the touch, and whether the strip fell there."""

    travelled: float
    x: float
    fell: bool


@dataclass(frozen=True, eq=False)
class Assessment:
    """A path followed to its end.

    ``segments``: the static parts; every one but the last ends in a critical point.  ``motions``: the falls from the
    first of the events on (none where only statics were asked for).  ``events``: the critical points.  ``touch``: the
    first touch, or None.  ``failure``: why the strip could not be followed past the last of the events, where it should
    have been: a fall, or the statics after it, failed.  All that was found before holds.
    """

    path: GripperPath
    segments: tuple[StaticSegment, ...]
    motions: tuple[Motion, ...]
    events: tuple[CriticalEvent, ...]
    touch: Touchdown | None
    failure: SolveError | None = None

    def complete(self) -> Assessment:
        """Itself, where nothing failed; else the failure is raised."""
        if self.failure is not None:
            raise self.failure
        return self

    @property
    def states(self) -> list[State]:
        """All static states, each with what it solves."""
        return [state for segment in self.segments for state in segment.states]

    @property
    def stable(self) -> bool:
        """Whether the strip follows the whole path statically."""
        return not self.events

    @property
    def last(self) -> State:
        """The last static state."""
        return self.segments[-1].states[-1]

    @property
    def contact(self) -> str:
        """How the contact was found: by its coordinates in all static states."""
        return MOVING

    @property
    def at_end(self) -> bool:
        """Whether that is the end of the path."""
        return abs(self.last[1].lam - self.path.length) < 1e-6


def assess_strip(
    strip: StripModel,
    path: GripperPath,
    fall: Fall | None = None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    options: StepOptions = STEPS,
    first: BranchPoint | None = None,
    piece: int = 0,
) -> Assessment:
    """Follow a path, from a state on one of its pieces or from the flat strip.

    At critical points the strip is released as ``fall`` says; without it the first one is the end.  Where the fall is
    not to rest, its first touch is the end.  After :data:`MAX_FALLS` falls the next critical point is the end.

    Raises SolveError: the statics up to the first critical point could not be computed; what fails after that is a part
    of the result.
    """
    say = progress or (lambda _: None)
    mesh = strip.contact_mesh(refinement)
    segments, motions, events = [follow(mesh, path, strip.length, first, piece, options, say)], [], []
    touch, failure = _static_touch(segments[0]), None
    while (found := segments[-1].critical) is not None:
        segment = segments[-1]
        events.append(_event(segment.unheld or segment.states[-1], path, found))
        if fall is None or len(events) > MAX_FALLS:
            break
        try:
            say(f"falling at {found.lam / path.length:.0%} of the path")
            motion = simulate_fall(ReleaseState.at(segment.last, refinement), fall)
            motions.append(motion)
            if touch is None and motion.touch is not None:
                touch = Touchdown(found.lam, motion.touch_x, True)
            if touch is not None and not fall.to_rest:
                break
            say("following the path from the state at rest")
            rest = at_rest(mesh, motion)
            segments.append(follow(mesh, path, strip.length, rest, segment.pieces[-1], options, say))
        except SolveError as error:
            # What statics say of the path holds without the fall.
            failure = error
            break
        touch = touch or _static_touch(segments[-1])
    return Assessment(path, tuple(segments), tuple(motions), tuple(events), touch, failure)


def peak_speed(motion: Motion) -> float:
    """Largest speed of a point of the mid-surface in a fall, sqrt(g L*)."""
    middle = motion.problem.model.middle
    return max(float(np.linalg.norm(state.v[middle], axis=1).max()) for state in motion.states)


def size_of_fall(before: State, motion: Motion) -> tuple[float, float]:
    """The largest height that a point of the strip loses in a fall, L*, and the energy that it frees, rho_a g L*^2.

    From the critical state ``before`` to that at rest.  The energy is by the motion's mesh, on which the error of both
    states is the same; the gripper's way to the critical point and past it, which starts the motion, frees none.
    """
    (critical, point), (first, last) = before, (motion.states[i] for i in (0, -1))
    problem, s = motion.problem, motion.problem.model.s
    drop = critical.model.resampled_mid_surface(point.q, s) - problem.model.mid_surface(last.q)
    pushes = [float(grip_and_hold(problem, at)[0] @ problem.motion.rates(at.lam)) for at in (first, last)]
    work = pushes[0] * (point.lam - first.lam) + pushes[1] * (last.lam - point.lam)
    return float(drop[:, 1].max()), sum(problem.energies(first.q)) - sum(problem.energies(last.q)) + work


def _event(state: State, path: GripperPath, found: CriticalPoint) -> CriticalEvent:
    """The critical point found, with its kind by the mode of a state there."""
    angle = boundary_angle(*state)
    kind = BIFURCATION if angle < LARGEST_BIFURCATION_ANGLE else SNAP
    return CriticalEvent(found.lam, path.position(found.lam), kind, angle, found)


def boundary_angle(problem: StripProblem, point: Point) -> float:
    """Angle between the gripper's way and the stability boundary in the plane of gripper places, degrees.

    The boundary's normal is what the critical mode feels of a move of the gripper: the mode times the tangent's
    columns of the grasp.
    """
    _, tangent, _ = problem.linearise(point.q, point.lam)
    grasp = problem.model.middle[0]
    normal = (tangent @ point.mode)[grasp]
    way = problem.motion.rates(point.lam)
    sine = abs(float(normal @ way)) / float(np.linalg.norm(normal) * np.linalg.norm(way))
    return degrees(np.arcsin(min(sine, 1.0)))


def _static_touch(segment: StaticSegment) -> Touchdown | None:
    """The first touch on a static part: a state of its own where contact coordinates are unknowns."""
    if touches(segment.states[0][0].model, segment.states[0][1]):
        return None
    for problem, point in segment.states:
        if touches(problem.model, point):
            return Touchdown(point.lam, touch_position(problem.model, point), False)
    return None


def lying_length(problem: StripProblem, point: Point | TimeState) -> float:
    """Length that lies from the held end to the lift-off, L*."""
    model = problem.model
    return model.length - lift_off(model, point)


def grip_and_hold(problem: StripProblem, point: Point | TimeState) -> tuple[Array, float]:
    """Force (x, z) of the gripper on the strip, and the horizontal one of the held end, inertia aside, rho_a g L*."""
    residual = problem.residual(point.q, point.lam)
    return np.asarray(residual[problem.model.middle[0]]), float(residual[problem.model.middle[-1, 0]])


def peak_forces(states: Sequence[Followed]) -> tuple[float, float]:
    """Largest force of the gripper, and largest horizontal force of the held end, over states."""
    forces = [grip_and_hold(*state) for state in states]
    return max(float(np.linalg.norm(grip)) for grip, _ in forces), max(abs(hold) for _, hold in forces)


def peak_push(states: Sequence[Followed]) -> tuple[float, float]:
    """Largest push of the gripper on what lies, over states, and the gripper's height there; 0 and nan without one.

    It is the gripper's force in the direction of folding: friction on the floor takes some of it, nothing adds to it.
    Between the states of a static path it is up to 1 % larger.
    """
    push = np.array([grip_and_hold(*state)[0][0] for state in states])
    problem, point = states[int(push.argmax())]
    if push.max() < NO_PUSH:
        return 0.0, float("nan")
    return float(push.max()), float(problem.model.mid_surface(point.q)[0, 1])


def shape_error(problem: StripProblem, point: Point | TimeState, fold: HalfFold) -> float:
    """Largest distance of a state from the folded one, L*.

    The fold may be that of the part of a longer strip that is folded: from the gripped end on.
    """
    model, folded = problem.model, fold.folded
    s = nodes(folded.length)
    apart = model.resampled_mid_surface(point.q, s) - folded.at(s)
    apart[:, 0] -= 0.5 * (folded.length - model.length)
    return float(np.linalg.norm(apart, axis=1).max())

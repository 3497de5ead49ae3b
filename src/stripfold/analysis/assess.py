"""Assessment of a gripper path: critical points, first touch, quality of the fold (the paper's section V).

Statics along the path to a critical point, the fall from there to rest, statics on, until the path ends.  All in units
of L*, sqrt(L*/g) and rho_a g L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from stripfold.analysis import planning
from stripfold.analysis.contact import lift_off, touch, touch_position, touches
from stripfold.analysis.nodal import solve_height
from stripfold.analysis.path_statics import SIZES, STEPS, StaticSegment, follow
from stripfold.analysis.release import (
    Fall,
    Motion,
    Progress,
    ReleaseState,
    simulate_fall,
    state_at_rest,
)
from stripfold.analysis.static import StripModel
from stripfold.arrays import Array
from stripfold.errors import CoarseMeshError
from stripfold.models.model import Model
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import RPath
from stripfold.problem import StripProblem
from stripfold.solve import continuation
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.events import Crossing
from stripfold.solve.problem import Point

SNAP, BIFURCATION = KINDS = "snap-through", "bifurcation"
"""At a snap-through the state ceases to exist, at a bifurcation two states meet."""
LARGEST_BIFURCATION_ANGLE = 15.0
"""Angle between path and stability boundary, degrees, below which a critical point is a bifurcation.

At a snap the path crosses the boundary, at 75 degrees or more on the paper's paths.  A path planned on the elastica
touches it; for a strip of thickness h it crosses at an angle that vanishes with h, up to 13 degrees in the study
tangency: an unfolded bifurcation.
"""
MAX_FALLS = 5
FINEST = 0.5
"""Smallest factor on the element lengths."""


@dataclass(frozen=True, eq=False)
class CriticalEvent:
    """A critical point on a path.

    Attributes
    ----------
    travelled, place
        Length travelled, and where the gripper is, (x, z).
    kind
        One of :data:`KINDS`.
    angle
        Between the path and the stability boundary, degrees.
    found
        The located point.
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

    Attributes
    ----------
    segments
        The static parts; every one but the last ends in a critical point.
    motions
        The falls between them (none where only statics were asked for).
    events
        The critical points.
    touch
        The first touch, or None.
    """

    model: Model
    path: GripperPath
    segments: tuple[StaticSegment, ...]
    motions: tuple[Motion, ...]
    events: tuple[CriticalEvent, ...]
    touch: Touchdown | None

    @property
    def states(self) -> list[tuple[StripProblem, Point]]:
        """All static states, each with what it solves."""
        return [(segment.problem(i), point) for segment in self.segments for i, point in enumerate(segment.points)]

    @property
    def stable(self) -> bool:
        """Whether the strip follows the whole path statically."""
        return not self.events

    @property
    def last(self) -> Point:
        """The last static state."""
        return self.segments[-1].points[-1]

    @property
    def at_end(self) -> bool:
        """Whether that is the end of the path."""
        return abs(self.last.lam - self.path.length) < 1e-6


def mesh_for(strip: StripModel, path: GripperPath, refinement: float = 1.0) -> Model:
    """The strip on a mesh that is fine where it lifts off when the path first meets the stability boundary."""
    sweep = planning.sweep_on_path(path, strip.length)
    return strip.model(planning.boundaries(strip.length, sweep, refinement, SIZES))


def assess_strip(
    strip: StripModel,
    path: GripperPath,
    fall: Fall | None = None,
    refinement: float = 1.0,
    progress: Progress | None = None,
    options: StepOptions = STEPS,
) -> Assessment:
    """Assess a path on a planned mesh; on a finer one where that proves too coarse.

    Raises
    ------
    SolveError, TimeStepError
        As in :func:`assess`.
    """
    while True:
        try:
            return assess(mesh_for(strip, path, refinement), path, fall, progress, options)
        except CoarseMeshError:
            refinement /= 2.0
            if refinement < FINEST:
                raise


def assess(
    model: Model,
    path: GripperPath,
    fall: Fall | None = None,
    progress: Progress | None = None,
    options: StepOptions = STEPS,
) -> Assessment:
    """Follow a path; at critical points the strip is released as ``fall`` says; without it the first one is the end.

    After :data:`MAX_FALLS` falls the next critical point is the end.

    Raises
    ------
    SolveError
        A part could not be computed.
    TimeStepError
        A fall could not be followed.
    """
    say = progress or (lambda _: None)
    say("following the path")
    segments, motions, events = [follow(model, path, options=options)], [], []
    touch = _static_touch(segments[0])
    while (found := segments[-1].critical) is not None:
        segment = segments[-1]
        problem, piece = segment.problem(-1), segment.pieces[-1]
        events.append(_event(problem, path, found))
        if fall is None or len(events) > MAX_FALLS:
            break
        say(f"falling at {found.lam / path.length:.0%} of the path")
        motion = simulate_fall(ReleaseState.at(problem, found), fall)
        motions.append(motion)
        if touch is None and motion.touch is not None:
            touch = Touchdown(found.lam, motion.touch_x, True)
        point = state_at_rest(problem, motion.states[-1])
        say("following the path from the state at rest")
        segments.append(follow(model, path, point, piece, options))
        touch = touch or _static_touch(segments[-1])
    return Assessment(model, path, tuple(segments), tuple(motions), tuple(events), touch)


def _event(problem: StripProblem, path: GripperPath, found: CriticalPoint) -> CriticalEvent:
    angle = boundary_angle(problem, found)
    kind = BIFURCATION if angle < LARGEST_BIFURCATION_ANGLE else SNAP
    return CriticalEvent(found.lam, path.position(found.lam), kind, angle, found)


def boundary_angle(problem: StripProblem, found: CriticalPoint) -> float:
    """Angle between the gripper's way and the stability boundary in the plane of gripper places, degrees.

    The boundary's normal is what the critical mode feels of a move of the gripper: the mode times the tangent's
    columns of the grasp.
    """
    _, tangent, _ = problem.linearise(found.before.q, found.lam)
    grasp = problem.model.middle[0]
    normal = (tangent @ found.mode)[grasp]
    way = problem.motion.rates(found.lam)
    sine = abs(float(normal @ way)) / float(np.linalg.norm(normal) * np.linalg.norm(way))
    return degrees(np.arcsin(min(sine, 1.0)))


def off_the_boundary(strip: StripModel, event: CriticalEvent, refinement: float = 1.0) -> float:
    """How far a critical point on a path is from lambda_c of the x-axis study at its height, L*.

    The boundary belongs to the strip, not to the path: what differs is error.  nan where the sag touches first at
    constant height.
    """
    x, z = event.place
    run = solve_height(strip, float(z), refinement, past=0.0)
    if run.critical is None:
        return float("nan")
    return float(x + strip.length / 2.0 - run.critical.lam)


def _static_touch(segment: StaticSegment) -> Touchdown | None:
    """The first touch on a static part."""
    for i, point in enumerate(segment.points):
        if touches(segment.model, point):
            if i == 0:
                return None
            problem = segment.problem(i)
            before = segment.points[i - 1]
            crossing = Crossing(touch(segment.model), before, point)
            at = continuation.locate(problem, crossing, STEPS).after if before.lam < point.lam else point
            return Touchdown(at.lam, touch_position(segment.model, at), False)
    return None


def lying_length(model: Model, point: Point) -> float:
    """Length that lies from the held end to the lift-off, L*."""
    return model.length - lift_off(model, point)


def grip_and_hold(problem: StripProblem, point: Point) -> tuple[Array, float]:
    """Force (x, z) of the gripper on the strip, and the horizontal one of the held end, rho_a g L*."""
    residual = problem.residual(point.q, point.lam)
    return np.asarray(residual[problem.model.middle[0]]), float(residual[problem.model.middle[-1, 0]])


def peak_forces(states: Sequence[tuple[StripProblem, Point]]) -> tuple[float, float]:
    """Largest force of the gripper, and largest horizontal force of the held end, over static states."""
    forces = [grip_and_hold(*state) for state in states]
    return max(float(np.linalg.norm(grip)) for grip, _ in forces), max(abs(hold) for _, hold in forces)


def shape_error(model: Model, point: Point, plan: RPath) -> float:
    """Largest distance of a state from the folded state that an R-path ends in, L*."""
    apart = model.mid_surface(point.q) - plan.states[-1].at(model.s)
    return float(np.linalg.norm(apart, axis=1).max())

"""A strip that was followed along something, and what is measured on its states.

Statics, statics with memory, motion in time and a fall all yield a :class:`Track`.  In units of L*, sqrt(L*/g) and
rho_a g L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from itertools import groupby, pairwise
from math import degrees, nan
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.progress import AFTER, BEFORE, FALL, SLOW
from stripfold.follow.contact import lies_apart, lift_off, touch_position, touches
from stripfold.follow.contact_branch import LOW, TOUCH_TOLERANCE, BranchPoint
from stripfold.paths.rpath import HalfFold
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.dynamics import TimeState
from stripfold.solve.problem import Point
from stripfold.strip.problem import StripProblem, clamp_of

SNAP, BIFURCATION, COMPRESSION = KINDS = "snap-through", "bifurcation", "compression"
"""At a snap-through the state ceases to exist, at a bifurcation two states meet.

At a compression the push on what lies, not the weight of what hangs, makes the strip spring to another state.
"""
COMPRESSED = 0.1
"""Share of the elastic energy in the compression of what lies, above which a critical point is a compression.

At those of paths that begin flat it is 0.5 to 0.8, at all others below 4e-4 (h = 0.006 to 0.2 L*).
"""
LARGEST_BIFURCATION_ANGLE = 15.0
"""Angle between path and stability boundary, degrees, below which a critical point is a bifurcation.

At a snap the path crosses the boundary, at 75 degrees or more on the paper's paths.  A path planned on the elastica
touches it; for a strip of thickness h it crosses at an angle that vanishes with h, up to 13 degrees in the study
tangency: an unfolded bifurcation.
"""
BUMP = 15.6987
"""Height times F^2 of a bump in a beam that lies and is pushed by F, L* (rho_a g L*)^2: in unstable equilibrium.

A lower one stays, a higher one grows.  Its second derivative vanishes where it lifts off, too (Hobbs, J. Transp. Eng.
110, 175, 1984); of small slopes, that is for heights of a small part of L*.
"""
BUMP_ENERGY = 30.2417
"""Energy times F^2.5 that raises this bump against the push, half of its weight's potential, of the same source."""
WAVE = 8.0
"""Height times F^2 below which a strip that is pushed by F stays on the waves of a table, L* (rho_a g L*)^2.

A wave of height a and wave number k holds it while a k^2 (F - k^2) < 2: the lowest that does not has k^2 = F / 2.
In time a ruck grows from 0.67 :data:`BUMP` on, for a single ridge as for several (study rucks).
"""
AT_GRIP = 0.02
"""Length of the strip from its end over which its direction there is taken, L*: it is straight at its end."""
NO_PUSH = 1e-3
"""Push that counts as none, rho_a g L*: forces are solved for to less."""
MOVING, NODAL = "moving", "nodal"
SPACING = 0.1
"""Largest distance of the nodes at which states are stored or compared, L*."""


class StripState(NamedTuple):
    """A state, static or in time, and what it solves."""

    problem: StripProblem
    point: Point | TimeState

    @property
    def lam(self) -> float:
        """The control parameter."""
        return self.point.lam


class End(StrEnum):
    """What ended a track."""

    SNAP = "snap"
    TOUCH = "touch"
    LIFTED = "lifted"
    DOWN = "down"
    REST = "rest"
    LAYERS = "layers"
    FLAT = "flat"
    PATH = "end of the path"

    @property
    def reason(self) -> str:
        """In words."""
        return {
            End.SNAP: "lambda has a maximum: the strip snaps through",
            End.TOUCH: "the sag touches the lower layer before lambda has a maximum: it is laid down, no snap",
            End.LIFTED: "the whole strip leaves the floor before lambda has a maximum: the strip is too short",
            End.DOWN: "the second gripper is down on the lower layer",
            End.REST: "the strip is at rest",
            End.LAYERS: "layers meet above the floor",
            End.FLAT: "the strip lies flat again",
            End.PATH: "the path ends",
        }[self]


@dataclass(frozen=True, eq=False)
class CriticalEvent:
    """A critical point on a track.

    ``travelled``: lambda there.  ``found``, ``state``: the located point, and the state whose mode is the critical one;
    None of a strip with memory.
    """

    travelled: float
    found: CriticalPoint | None = None
    state: BranchPoint | StripState | None = None

    @cached_property
    def angle(self) -> float:
        """Angle between the gripper's way and the stability boundary, degrees; nan where no mode is known."""
        return nan if self.state is None else boundary_angle(*on_mesh(self.state))

    @property
    def kind(self) -> str:
        """One of :data:`KINDS`."""
        if self.state is not None and compression(*on_mesh(self.state)) > COMPRESSED:
            return COMPRESSION
        return BIFURCATION if self.angle < LARGEST_BIFURCATION_ANGLE else SNAP


@dataclass(frozen=True, eq=False)
class Touch:
    """The first touch: index of the state, lambda and x there, origin mid-strip, and whether the strip fell there."""

    index: int
    travelled: float
    x: float
    fell: bool


@dataclass(frozen=True, eq=False)
class Track:
    """A strip followed along something.

    Attributes
    ----------
    points
        The accepted states, in order; at a corner of a path two, one for each direction.
    end
        What ended it.
    phases, pieces
        For each state its phase, and the index of its piece of the path; no pieces of a fall alone.
    events
        The critical points.
    beyond
        States on the unstable branch past the critical point, where they were asked for.
    failure
        Why the strip could not be followed past the last of the events, where it should have been.  All that was found
        before holds.
    """

    points: tuple[BranchPoint | StripState, ...]
    end: End
    phases: tuple[str, ...]
    pieces: tuple[int, ...] = ()
    events: tuple[CriticalEvent, ...] = ()
    beyond: tuple[BranchPoint, ...] = ()
    failure: SolveError | None = None

    def then(self, other: Track) -> Track:
        """Join a track that goes on from the end of this one."""
        phases = other.phases
        if FALL in self.phases:
            phases = tuple(AFTER if phase == BEFORE else phase for phase in phases)
        return Track(
            (*self.points, *other.points),
            other.end,
            (*self.phases, *phases),
            (*self.pieces, *(other.pieces or self.pieces[-1:] * len(other.points))),
            (*self.events, *other.events),
            other.beyond,
            other.failure,
        )

    def complete(self) -> Track:
        """Itself, where nothing failed; else the failure is raised."""
        if self.failure is not None:
            raise self.failure
        return self

    @cached_property
    def states(self) -> tuple[StripState, ...]:
        """The states, static ones with their contact at nodes."""
        return tuple(on_mesh(at) for at in self.points)

    @property
    def static(self) -> tuple[StripState, ...]:
        """The static ones."""
        return tuple(state for state in self.states if isinstance(state.point, Point))

    @cached_property
    def forces(self) -> Array:
        """:func:`forces_of` the static states."""
        return forces_of(self.static)

    @cached_property
    def branch(self) -> tuple[BranchPoint, ...]:
        """The states with contact coordinates."""
        return tuple(at for at in self.points if isinstance(at, BranchPoint))

    @cached_property
    def moments(self) -> tuple[TimeState, ...]:
        """The states in time."""
        return tuple(at.point for at in self.points if isinstance(at.point, TimeState))

    @property
    def stable(self) -> bool:
        """Whether no state is critical."""
        return not self.events

    @property
    def parts(self) -> list[slice]:
        """Statics and falls in turn, as slices of the states."""
        edges = [0]
        for _, group in groupby(self.phases, lambda phase: phase == FALL):
            edges.append(edges[-1] + len(list(group)))
        return [slice(a, b) for a, b in pairwise(edges)]

    @property
    def falls(self) -> list[slice]:
        """The falls, as slices of the states."""
        return [part for part in self.parts if self.phases[part.start] == FALL]

    @cached_property
    def touch(self) -> Touch | None:
        """The first touch; none of statics, or of a slow motion, that begin with one."""
        for part in self.parts:
            fell = self.phases[part.start] == FALL
            index = (first_landing if fell else _first_touching)(self.states[part])
            if index:
                problem, point = self.states[part.start + index]
                # A strip that falls has travelled as far as to its critical point.
                travelled = self.points[part.start - 1].lam if fell and part.start else point.lam
                return Touch(part.start + index, travelled, touch_position(problem.model, point), fell)
        return None

    @property
    def touch_x(self) -> float:
        """x of the first touch, origin mid-strip; nan without one."""
        return self.touch.x if self.touch else nan

    @property
    def last(self) -> BranchPoint:
        """The last state with contact coordinates."""
        return self.branch[-1]

    @property
    def contact(self) -> str:
        """Whether the contact was found by its coordinates in all states but falls, or in a slow motion at nodes."""
        return NODAL if SLOW in self.phases else MOVING

    @property
    def critical(self) -> CriticalPoint | None:
        """The critical point that ends it, or None."""
        return self.events[-1].found if self.end is End.SNAP and self.events else None

    @property
    def lam(self) -> float:
        """Lambda at the end: lambda_c where it is a critical point."""
        return self.events[-1].travelled if self.end is End.SNAP else self.points[-1].lam

    @property
    def slack(self) -> float:
        """Width of the bracket of lambda at the end, L*."""
        return self.critical.width if self.critical else TOUCH_TOLERANCE

    @property
    def free_length(self) -> float:
        """Length of the part that hangs free in the last state, L*."""
        return float(self.last.contact[-1])


def on_mesh(at: BranchPoint | StripState) -> StripState:
    """A state with its contact at nodes, and what it solves."""
    return at if isinstance(at, StripState) else StripState(*at.problem.on_mesh(at.point))


def _first_touching(states: Sequence[StripState]) -> int | None:
    """Index of the first state in which the strip touches what lies."""
    return next((i for i, (problem, point) in enumerate(states) if touches(problem.model, point)), None)


def first_landing(fall: Sequence[StripState]) -> int | None:
    """Index of the first state of a fall in which the strip has come down on what lies."""
    landed = (i for i, (problem, point) in enumerate(fall) if i and lies_apart(problem.model, point))
    return next(landed, None)


def nodes(length: float) -> Array:
    """Distances from the grasped end at which states are stored or compared, :data:`SPACING` or less apart, L*."""
    return np.linspace(0.0, length, int(np.ceil(length / SPACING)) + 1)


def node_weights(s: Array) -> Array:
    """Length that each node stands for, shape of ``s``: the trapezoidal rule."""
    half = 0.5 * np.diff(s)
    return np.asarray(np.append(half, 0.0) + np.insert(half, 0, 0.0))


def peak_speed(fall: Sequence[StripState]) -> float:
    """Largest speed of a point of the mid-surface in a fall, sqrt(g L*)."""
    middle = fall[0].problem.model.middle
    return max(float(np.linalg.norm(at.v[middle], axis=1).max()) for _, at in fall if isinstance(at, TimeState))


def boundary_angle(problem: StripProblem, point: Point | TimeState) -> float:
    """Angle between the gripper's way and the stability boundary in the plane of gripper places, degrees.

    The boundary's normal is what the critical mode feels of a move of the gripper: the mode times the tangent's
    columns of the grasp.  A clamp that turns has its angle, rad, as a third coordinate.
    """
    assert isinstance(point, Point)
    _, tangent, load_rate = problem.linearise(point.q, point.lam)
    normal = (tangent @ point.mode)[problem.model.middle[0]]
    way = problem.motion.rates(point.lam)
    if (clamp := clamp_of(problem.motion, problem.model, point.lam)) is not None and clamp.rate:
        normal = np.append(normal, float(load_rate @ point.mode) / clamp.rate)
        way = np.append(way, clamp.rate)
    sine = abs(float(normal @ way)) / float(np.linalg.norm(normal) * np.linalg.norm(way))
    return degrees(np.arcsin(min(sine, 1.0)))


def lying_length(problem: StripProblem, point: Point | TimeState) -> float:
    """Length that lies from the held end to the lift-off, L*."""
    model = problem.model
    return model.length - lift_off(model, point)


def compression(problem: StripProblem, point: Point | TimeState) -> float:
    """Share of the elastic energy that is in the compression of what lies by the held end's force."""
    force, model = grip_and_hold(problem, point)[1], problem.model
    return force**2 * lying_length(problem, point) * model.thickness**2 / 24.0 / model.energy(point.q)


def grip_and_hold(problem: StripProblem, point: Point | TimeState) -> tuple[Array, float]:
    """Force (x, z) of the gripper on the strip, and the horizontal one of the held end, inertia aside, rho_a g L*."""
    residual = problem.residual(point.q, point.lam)
    return np.asarray(residual[problem.model.middle[0]]), float(residual[problem.model.middle[-1, 0]])


def forces_of(states: Sequence[StripState]) -> Array:
    """Force (x, z) of the gripper and horizontal one of the held end in each state, shape (len(states), 3)."""
    return np.array([(*grip, hold) for grip, hold in (grip_and_hold(*state) for state in states)])


def peak_forces(forces: Array) -> tuple[float, float]:
    """Largest force of the gripper, and largest horizontal force of the held end, of :func:`forces_of`."""
    return float(np.hypot(forces[:, 0], forces[:, 1]).max()), float(np.abs(forces[:, 2]).max())


def friction_to_hold(problem: StripProblem, point: Point | TimeState) -> float:
    """Coefficient of friction of the table with which what lies would just stay without a pin."""
    return float(hold_frictions(forces_of([StripState(problem, point)]), problem.model.length)[0])


def hold_frictions(forces: Array, length: float) -> Array:
    """The same of all states of a strip of this length, L*, from their :func:`forces_of`; shape (n,).

    Negative where the gripper pushes what lies along x.  All of it slides at once: it is stiff along itself.  The table
    carries what the gripper does not.
    """
    return np.asarray(forces[:, 2] / (length - forces[:, 1]))


def peak_moment(states: Sequence[StripState]) -> float:
    """Largest moment of a clamp on the end of the strip off the floor, over states, rho_a g L*^2; 0 of a hinge."""
    clamps = ((clamp_of(of.motion, of.model, at.lam), of, at) for of, at in states)
    return max((abs(c.moment(at.q)) for c, of, at in clamps if c and at.q[of.model.middle[0, 1]] > LOW), default=0.0)


def peak_push(states: Sequence[StripState], forces: Array) -> tuple[float, float]:
    """Largest push of the gripper on what lies, over states and their forces, and its height there; 0 and nan for none.

    It is the gripper's force in the direction of folding: friction on the floor takes some of it, nothing adds to it.
    Between the states of a static path it is up to 1 % larger.
    """
    push = forces[:, 0]
    problem, point = states[int(push.argmax())]
    if push.max() < NO_PUSH:
        return 0.0, float("nan")
    return float(push.max()), float(problem.model.mid_surface(point.q)[0, 1])


def grip_angles(states: Sequence[StripState]) -> Array:
    """Rotation of the gripper in each state, rad, shape (n,): 0 where it grasps the flat strip, pi on the folded one.

    A hinge is taken to turn with the strip's end; that of a clamp is what the strip's end is given.
    """
    direction = np.diff(mid_surfaces(states, np.array([0.0, AT_GRIP])), axis=1)[:, 0] @ [1.0, -1j]
    return np.unwrap(np.angle([1.0, *direction]))[1:]


def tool_room(states: Sequence[StripState], angles: Array) -> float:
    """Length behind the grasp up to which a tool along the gripper's angles stays above the table, L*; inf for any."""
    z = np.array([problem.model.mid_surface(point.q)[0, 1] for problem, point in states])
    dips = -np.sin(angles)
    down = (dips > 0.0) & (z > LOW)
    return float((z[down] / dips[down]).min(initial=np.inf))


def shape_error(problem: StripProblem, point: Point | TimeState, fold: HalfFold) -> float:
    """Largest distance of a state from the folded one, L*.

    The fold may be that of the part of a longer strip that is folded: from the gripped end on.
    """
    model, folded = problem.model, fold.folded
    s = nodes(folded.length)
    apart = model.resampled_mid_surface(point.q, s) - folded.at(s)
    apart[:, 0] -= 0.5 * (folded.length - model.length)
    return float(np.linalg.norm(apart, axis=1).max())


def mid_surfaces(states: Sequence[StripState], arc: Array) -> Array:
    """Places at distances ``arc`` from the grasped end, whose meshes differ; shape (states, len(arc), 2)."""
    return np.stack([problem.model.resampled_mid_surface(point.q, arc) for problem, point in states])

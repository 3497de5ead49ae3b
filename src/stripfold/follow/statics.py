"""Statics of a strip: lifted, moved along x, or along a path, up to a critical point or another end.

All in units of L*; lambda is the height, the advance or the length travelled.  Corners of a path are states of their
own: the branch is followed to the corner, and from there with the direction of the next piece.  Near the floor the part
of the strip beside a gripper at height z is (24 z)^(1/4) long, a beam under its weight, and gone on the floor.  See
``docs/physics.md``, sections 4 and 5, for what is expected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any, Literal, NamedTuple

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.base.numerics import root
from stripfold.base.progress import BEFORE, Percent
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import (
    LIFTED,
    LOW,
    NEAR_FLOOR,
    STEPS,
    UNHELD,
    BranchCrossing,
    BranchPoint,
    Planned,
    lift_off_of_all,
    solved,
    touch,
    transferred,
    zero,
)
from stripfold.follow.track import CriticalEvent, End, StripState, Track
from stripfold.paths.curve import GripperPath
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import Event, StepOptions
from stripfold.solve.critical import LIMIT, CriticalPoint
from stripfold.strip import contact_mesh
from stripfold.strip.contact_mesh import LYING, ContactMesh
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, Lift, TwoGrippers
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

Until = Literal["touch", "end"]
"""Where statics end if nothing ends them before: at the first touch, or at the end of the path."""
LAMBDA_TOLERANCE = 1e-6
"""Width of the bracket of lambda_c, L*."""
LAID = 2.0
"""Length beside the lift-off, L*, in which what lies may have been lifted before, with friction in bending."""
DOWN = "second gripper on the floor"
BRACKETED = replace(LIMIT, tolerance=1e-3)
"""A critical point located while the branch is followed: a step that leads to another branch is shortened."""
FIRST = 0.01
"""Largest length travelled at the first state of a path, L*."""
LAID_FLAT = "landing on the flat strip"
ENDS = {"touch of the sag": End.TOUCH, LIFTED: End.LIFTED, DOWN: End.DOWN, LAID_FLAT: End.FLAT}
"""The ends by the names of their events."""


@dataclass(frozen=True)
class StripModel:
    """A strip in solver units and its discretisation.

    ``length`` and ``thickness`` in L*; ``kind`` is "solid", "rod" or "reference".  ``nu`` is for all but the rod; with
    another order, number of elements across or law than the usual ones a solid is a :class:`.Reference`.  ``curl``:
    curvature without forces, 1/L*, of the rod and the solid.
    """

    length: float
    thickness: float
    nu: float = 0.0
    order: int = 2
    across: int = 1
    law: str = "svk"
    kind: str = "solid"
    curl: float = 0.0

    def contact_mesh(self, refinement: float = 1.0, memory: bool = False, clamped: bool = False) -> Planned:
        """Plans meshes that move with the lift-off.

        ``memory``: what lies has a history, and elements to keep it.  ``clamped``: the gripper may bend the strip's end
        sharply.
        """
        lying, laid = (0.15, LAID) if memory else (4.0, inf)
        at_contact, free = (inf, 0.12) if self.kind == "rod" else (0.15 * self.thickness, 0.18)
        sizes = contact_mesh.Sizes(free, lying, at_contact, laid, at_end=0.15 * free if clamped else inf)
        sizes = sizes.scaled(refinement)

        def plan(contact: Array) -> ContactMesh:
            return ContactMesh.of(self.length, LYING, contact, sizes, self.model)

        return plan

    def model(self, elements: int | Array) -> Model:
        """The strip with this number of elements, or with these ends of elements."""
        if self.kind == "rod":
            return Rod.of(self.length, self.thickness, elements=elements, curl=self.curl)
        if self.kind == "solid" and (self.order, self.across, self.law) == (2, 1, "svk"):
            return Solid.of(self.length, self.thickness, nu=self.nu, elements=elements, curl=self.curl)
        from stripfold.strip.reference import Reference  # scikit-fem takes longer to import than many a run

        options: dict[str, Any] = {"order": self.order, "across": self.across, "law": self.law}
        return Reference.of(self.length, self.thickness, nu=self.nu, elements=elements, **options)


def branch(
    at: BranchPoint,
    end: float = inf,
    until: Until = "end",
    options: StepOptions = STEPS,
    limit: Event = LIMIT,
    floor: float = inf,
) -> Iterator[BranchPoint | BranchCrossing]:
    """Follow a branch from a state to lambda = ``end``, or to the event that ends it before, which is yielded.

    With ``until="end"`` it goes on through the changes of its contact.  ``limit``: the event of a critical point.
    ``floor``: lambda from which on the gripper is on the floor, where one beside a flat strip ends the branch.
    Raises SolveError: when a state or the branch cannot be computed.
    """

    def stops(problem: MovingContact) -> list[Event]:
        events = [limit] if until == "end" else [touch(problem), lift_off_of_all(problem), limit]
        if floor < inf and len(problem.mesh.topology) == 2:
            # No layer is above what lies: what is off the floor shrinks to nothing.
            events.insert(0, zero(LAID_FLAT, lambda point: floor - point.lam, NEAR_FLOOR))
        if isinstance(problem.motion, TwoGrippers):
            events.insert(0, zero(DOWN, lambda point: float(problem.motion.values(point.lam)[-1])))
        return events

    for item in contact_branch.follow(at, options, stops, until == "end", end):
        yield item
        if isinstance(item, BranchCrossing):
            return


class Leg(NamedTuple):
    """States along one motion, what ended them before its end, and the state just past a critical point."""

    states: list[BranchPoint]
    end: End | None = None
    event: CriticalEvent | None = None
    after: BranchPoint | None = None


def leg(
    at: BranchPoint,
    end: float = inf,
    until: Until = "end",
    options: StepOptions = STEPS,
    tolerance: float = LAMBDA_TOLERANCE,
    seen: Callable[[float], None] = lambda _: None,
    limit: Event = LIMIT,
    floor: float = inf,
) -> Leg:
    """Follow a branch as :func:`branch` does, and locate a critical point that ends it, on elements planned for it.

    It is solved for or, where that fails, as in a strip as thin as rounding or where a step leads to another branch,
    bracketed as the branch is followed once more.

    ``tolerance``: width of the bracket of lambda_c.  ``seen``: called with each lambda.  ``limit``: the event of a
    critical point, :data:`BRACKETED` once more.  ``floor``: as for :func:`branch`.

    Raises SolveError: when the branch cannot be followed, or its critical point not be located.
    """
    states, stopped = [at], None
    for item in branch(at, end, until, options, limit, floor):
        if isinstance(item, BranchCrossing):
            stopped = item
        elif item is not at:
            states.append(item)
            seen(item.lam)
    if stopped is None:
        return Leg(states)
    if stopped.event is UNHELD:
        return Leg(states, End.SNAP, _at_change(stopped.before, stopped.after), stopped.after)
    if stopped.event is not limit:
        # Behind it the sag would be in the floor, or nothing would lie.
        return Leg([*states, stopped.before], ENDS[stopped.event.name])
    if limit is BRACKETED:
        problem = stopped.before.problem
        found = critical.locate(problem, stopped.before.point, stopped.after.point, tolerance, options)
    else:
        # On other elements the limit point may lie a little before.
        planned = map(_replanned, reversed(states))
        near = next((other for other in planned if not critical.is_past(other.point)), states[0])
        problem = near.problem
        try:
            found = critical.near(problem, near.point, tolerance, options)
        except SolveError:
            rest = leg(near, end, until, options, tolerance, seen, BRACKETED, floor)
            return rest._replace(states=[state for state in states if state.lam < near.lam] + rest.states)
        if found.lam >= end:
            at_end = continuation.step_to(states[-1].problem, states[-1].point, end, options)
            return Leg([*states, BranchPoint(states[-1].problem, at_end)])
    before, after = (BranchPoint(problem, point) for point in (found.before, found.after))
    stable = [state for state in states if state is at or state.lam < found.lam]
    return Leg([*stable, before], End.SNAP, CriticalEvent(found.lam, found, before), after)


def _replanned(at: BranchPoint) -> BranchPoint:
    """The state near this one on elements planned for its contact, or itself where there is none."""
    try:
        return transferred(at)
    except SolveError:
        return at


def lift(plan: Planned, heights: Sequence[float]) -> Iterator[tuple[float, BranchPoint]]:
    """Lift the flat strip and yield its state at each height, ascending: the gripper is free along x (lambda_0)."""
    at = contact_branch.from_flat(plan, Lift(), min(LOW, 0.25 * heights[0]))
    for height in heights:
        for item in branch(at, height, "touch"):
            if isinstance(item, BranchPoint):
                at = item
            elif item.event.name == LIFTED:
                raise SolveError(f"the whole strip leaves the floor below a height of {height:.4g} L*")
            else:
                raise SolveError("the strip loses its stability while it is lifted", parameter=at.point.lam)
        yield height, at


def remeshed(at: BranchPoint, plan: Planned) -> BranchPoint:
    """The state near another one on elements planned otherwise; ``plan`` plans them for one lift-off."""
    return transferred(at, mesh=plan(at.contact[-1:]).replanned(at.contact, at.topology))


def at_lambda(near: BranchPoint, lam: float) -> BranchPoint:
    """The state at ``lam`` near a point of a branch, with its tangent as the predictor."""
    tangent = near.point.tangent
    q = near.point.q + (lam - near.point.lam) / tangent.lam * tangent.q
    return solved(near.problem, q, lam)


def start_along_x(start: BranchPoint, height: float, sign: float = 1.0) -> BranchPoint:
    """A state without horizontal force as one of a motion along x, followed with lambda rising or falling."""
    problem, q = MovingContact(start.problem.mesh, AlongX(height)), start.point.q
    return solved(problem, q, float(q[start.model.middle[0, 0]]), sign)


def along_x(
    start: BranchPoint, height: float, plan: Planned | None = None, past: float = 1.0, options: StepOptions = STEPS
) -> Track:
    """Follow the x-axis branch from a state without horizontal force to its end, and after a snap past it.

    ``start``, ``height``: a state at this height of the gripper, L*, as :func:`lift` yields.  ``plan``: plans the
    elements; by default those of ``start``.  ``past``: arc length to follow the unstable branch, L*; 0 for none.
    Raises SolveError: when a state or the branch cannot be computed to its tolerance.
    """
    if plan is not None:
        start = at_lambda(remeshed(start, plan), height)
    return to_the_end(start_along_x(start, height), past, options)


def solve_height(strip: StripModel, height: float, refinement: float = 1.0, past: float = 0.0) -> Track:
    """Lift to one height and run along x from there."""
    ((_, start),) = lift(strip.contact_mesh(refinement), [height])
    return along_x(start, height, past=past)


def to_the_end(
    first: BranchPoint, past: float = 0.0, options: StepOptions = STEPS, tolerance: float = LAMBDA_TOLERANCE
) -> Track:
    """Follow a branch from a state on it to a snap, a touch or its lift-off; see :func:`along_x`."""
    if critical.is_past(first.point):
        raise SolveError("the branch does not start stable", parameter=first.point.lam)
    states, end, event, after = leg(first, until="touch", options=options, tolerance=tolerance)
    assert end is not None
    if event is None or after is None:
        return static_track(states, end)
    beyond = tuple(_beyond(after, past, options)) if past else (after,)
    return static_track(states, end, events=(event,), beyond=beyond)


def _beyond(after: BranchPoint, past: float, options: StepOptions) -> Iterator[BranchPoint]:
    """The unstable branch, which ends where the sag touches or nothing lies."""
    branch = contact_branch.follow(after, options, lambda at: [touch(at), lift_off_of_all(at)], through_contact=False)
    for item in branch:
        yield item.before if isinstance(item, BranchCrossing) else item
        if isinstance(item, BranchCrossing) or item.point.arc - after.point.arc > past:
            return


def static_track(
    points: Sequence[BranchPoint | StripState], end: End, pieces: Sequence[int] | None = None, **known: Any
) -> Track:
    """A track of statics alone."""
    count = len(points)
    return Track(tuple(points), end, (BEFORE,) * count, tuple(pieces or (0,) * count), **known)


def from_flat(mesh: Planned, path: GripperPath, length: float) -> BranchPoint:
    """The first state of a path, its gripper just lifted."""
    piece, first = path.pieces[0], FIRST
    while (height := piece.position(first)[1]) > (1.0 + 1e-9) * LOW:
        first *= LOW / height
    return contact_branch.from_flat(mesh, AlongPath(piece, length, path.gripper), first)


def on_floor_from(path: GripperPath) -> float:
    """Return the length travelled from which on the gripper is on the floor up to the path's end; inf for none."""

    def height(travelled: float) -> float:
        return float(path.position(travelled)[1]) - LOW

    after = before = path.length
    while height(before) <= 0.0:
        after, before = before, before - 5.0 * FIRST
        if before <= 0.0:
            return inf
    return inf if before == after else root(height, before, after, 1e-9)


def follow(
    mesh: Planned,
    path: GripperPath,
    length: float,
    first: BranchPoint | None = None,
    piece: int = 0,
    until: Until = "end",
    options: StepOptions = STEPS,
    progress: Callable[[str], None] | None = None,
) -> Track:
    """Follow a path from the flat strip, or from a state on one of its pieces.

    ``mesh``: plans a mesh of the strip with one lift-off: :meth:`.StripModel.contact_mesh`.  ``path``, ``length``: the
    path, and the length of the strip, L*.  ``first``, ``piece``: the state to begin with, and the index of its piece.
    ``options``: of the steps.  ``progress``: called with a line on how much of the path is done.  Raises SolveError:
    when a state or the branch cannot be computed.
    """
    at = first or from_flat(mesh, path, length)
    followed, floor = Percent(progress, "following the path"), on_floor_from(path)
    points, pieces, events, end = [at], [piece], list[CriticalEvent](), None
    while end is None:
        at = points[-1]
        if at.lam < path.pieces[piece].end:
            states, end, event, _ = leg(
                at, path.pieces[piece].end, until, options, seen=lambda lam: followed(lam / path.length), floor=floor
            )
            events += [event] if event else []
            points += states[1:]
            pieces += [piece] * len(states[1:])
        elif piece + 1 == len(path.pieces):
            end = End.PATH
        else:
            piece += 1
            turned = _turned(at, AlongPath(path.pieces[piece], length, path.gripper))
            if critical.is_past(turned.point):
                # It does not follow the new direction.
                events.append(_at_change(at, turned))
                end = End.SNAP
            else:
                points.append(turned)
                pieces.append(piece)
    return static_track(points, end, pieces, events=tuple(events))


def _turned(at: BranchPoint, first: AlongPath) -> BranchPoint:
    """The state at a corner with the motion of the next piece."""
    now = at.problem.motion
    motion = replace(now, first=first) if isinstance(now, TwoGrippers) else first
    return solved(replace(at.problem, motion=motion), at.point.q, at.lam)


def _at_change(before: BranchPoint, after: BranchPoint) -> CriticalEvent:
    """The critical point at a change of the contact or of the direction, between the states on either side."""
    lam = before.point.lam
    found = CriticalPoint(
        lam, lam, after.point.lam, lam, agree=False, before=before.point, after=after.point, mode=after.point.mode,
        evaluations=0,
    )  # fmt: skip
    return CriticalEvent(lam, found, after)

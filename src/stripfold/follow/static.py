"""The static runs of a strip: lift it, then move the gripper along x to the critical point and past it.

All in units of L*; see ``docs/physics.md``, section 4, for what is expected.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from math import inf

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.contact_branch import (
    STEPS,
    BranchCrossing,
    BranchPoint,
    Planned,
    follow,
    from_flat,
    solved,
    transferred,
)
from stripfold.follow.contact_events import LIFTED, TOUCH_TOLERANCE, lift_off_of_all, touch
from stripfold.follow.landing import LOW
from stripfold.solve import critical
from stripfold.solve.continuation import Event, StepOptions
from stripfold.solve.critical import LIMIT, CriticalPoint
from stripfold.strip import contact_mesh
from stripfold.strip.contact_mesh import LYING, ContactMesh
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Lift
from stripfold.strip.rod import Rod
from stripfold.strip.solid import Solid

LAMBDA_TOLERANCE = 1e-6
"""Width of the bracket of lambda_c, L*."""


class End(StrEnum):
    """The end of the gripper's advance."""

    SNAP = "snap"
    TOUCH = "touch"
    LIFTED = "lifted"

    @property
    def reason(self) -> str:
        """In words."""
        return {
            End.SNAP: "lambda has a maximum: the strip snaps through",
            End.TOUCH: "the sag touches the lower layer before lambda has a maximum: it is laid down, no snap",
            End.LIFTED: "the whole strip leaves the floor before lambda has a maximum: the strip is too short",
        }[self]


@dataclass(frozen=True)
class StripModel:
    """A strip in solver units and its discretisation.

    ``length`` and ``thickness`` in L*; ``kind`` is "solid", "rod" or "reference".  ``nu`` is for all but the rod; with
    another order, number of elements across or law than the usual ones a solid is a :class:`.Reference`.
    """

    length: float
    thickness: float
    nu: float = 0.0
    order: int = 2
    across: int = 1
    law: str = "svk"
    kind: str = "solid"

    def contact_mesh(self, refinement: float = 1.0, memory: bool = False) -> Planned:
        """Plans meshes that move with the lift-off; ``memory``: what lies has a history, and elements to keep it."""
        lying = 0.15 if memory else 4.0
        at_contact, free = (inf, 0.12) if self.kind == "rod" else (0.15 * self.thickness, 0.18)
        sizes = contact_mesh.Sizes(free, lying, at_contact).scaled(refinement)

        def plan(contact: Array) -> ContactMesh:
            return ContactMesh.of(self.length, LYING, contact, sizes, self.model)

        return plan

    def model(self, elements: int | Array) -> Model:
        """The strip with this number of elements, or with these ends of elements."""
        if self.kind == "rod":
            return Rod.of(self.length, self.thickness, elements=elements)
        if self.kind == "solid" and (self.order, self.across, self.law) == (2, 1, "svk"):
            return Solid.of(self.length, self.thickness, nu=self.nu, elements=elements)
        from stripfold.strip.reference import Reference  # scikit-fem takes longer to import than many a run

        options = {"order": self.order, "across": self.across, "law": self.law}
        return Reference.of(self.length, self.thickness, nu=self.nu, elements=elements, **options)


@dataclass(frozen=True)
class XRun:
    """A run along x at one height.

    ``points``: the points of the branch, from its start on; those before the end are ``points[:n_before]``.  ``end``:
    the end of the advance.  ``critical``: the located critical point where ``end`` is a snap.  ``last``: the state at
    the end of the advance: critical, at first touch, or just before lift-off of the whole strip.
    """

    points: tuple[BranchPoint, ...]
    end: End
    critical: CriticalPoint | None
    last: BranchPoint

    @property
    def lambda_0(self) -> float:
        """Advance at the start of the branch."""
        return self.points[0].point.lam

    @property
    def lam(self) -> float:
        """Advance at its end: lambda_c where it is a snap."""
        return self.critical.lam if self.critical else self.last.point.lam

    @property
    def slack(self) -> float:
        """Width of the bracket of lambda at the end, L*."""
        return self.critical.width if self.critical else TOUCH_TOLERANCE

    @property
    def free_length(self) -> float:
        """Length of the part that hangs free at the end of the advance, L*."""
        return float(self.last.contact[-1])


def lift(plan: Planned, heights: Sequence[float]) -> Iterator[tuple[float, BranchPoint]]:
    """Lift the flat strip and yield its state at each height, ascending: the gripper is free along x (lambda_0)."""
    at = from_flat(plan, Lift(), min(LOW, 0.25 * heights[0]))
    for height in heights:
        at = _lifted_to(at, height)
        yield height, at


def _lifted_to(first: BranchPoint, height: float) -> BranchPoint:
    above = Event("height", lambda point, _: point.lam >= height, tolerance=inf)
    for item in follow(first, STEPS, lambda at: [lift_off_of_all(at), above, LIMIT], through_contact=False):
        if isinstance(item, BranchCrossing):
            if item.event.name == LIFTED:
                raise SolveError(f"the whole strip leaves the floor below a height of {height:.4g} L*")
            if item.event is LIMIT:
                raise SolveError("the strip loses its stability while it is lifted", parameter=item.before.point.lam)
            near = min(item.before, item.after, key=lambda at: abs(at.point.lam - height))
            return at_lambda(near, height)
    raise AssertionError("a branch ends in an event or raises")


def at_lambda(near: BranchPoint, lam: float) -> BranchPoint:
    """The state at ``lam`` near a point of a branch, with its tangent as the predictor."""
    tangent = near.point.tangent
    q = near.point.q + (lam - near.point.lam) / tangent.lam * tangent.q
    return solved(near.problem, q, lam)


def along_x(
    start: BranchPoint, height: float, plan: Planned | None = None, past: float = 1.0, options: StepOptions = STEPS
) -> XRun:
    """Follow the x-axis branch from a state without horizontal force to its end, and after a snap past it.

    ``start``, ``height``: a state at this height of the gripper, L*, as :func:`lift` yields.  ``plan``: plans the
    elements; by default those of ``start``.  ``past``: arc length to follow the unstable branch, L*; 0 for none.
    Raises SolveError: when a state or the branch cannot be computed to its tolerance.
    """
    if plan is not None:
        start = transferred(start, mesh=plan(start.contact))
        start = at_lambda(start, height)
    return to_the_end(start_along_x(start, height), past, options)


def start_along_x(start: BranchPoint, height: float, sign: float = 1.0) -> BranchPoint:
    """A state without horizontal force as one of a motion along x, followed with lambda rising or falling."""
    problem, q = MovingContact(start.problem.mesh, AlongX(height)), start.point.q
    return solved(problem, q, float(q[start.model.middle[0, 0]]), sign)


def to_the_end(
    first: BranchPoint, past: float = 0.0, options: StepOptions = STEPS, tolerance: float = LAMBDA_TOLERANCE
) -> XRun:
    """Follow a branch along x from a state on it, lambda_c to a bracket of ``tolerance``; see :func:`along_x`."""
    if critical.is_past(first.point):
        raise SolveError("the branch does not start stable", parameter=first.point.lam)

    def stops(problem: MovingContact) -> list[Event]:
        return [touch(problem), lift_off_of_all(problem), LIMIT]

    points: list[BranchPoint] = []
    for item in follow(first, options, stops, through_contact=False):
        if isinstance(item, BranchPoint):
            points.append(item)
        elif item.event is LIMIT:
            return _snap(points, past, options, tolerance)
        else:
            # Behind it the sag would be in the floor, or nothing would lie.
            end = End.LIFTED if item.event.name == LIFTED else End.TOUCH
            return XRun((*points, item.before), end, None, item.before)
    raise AssertionError("a branch ends in an event or raises")


def _snap(points: list[BranchPoint], past: float, options: StepOptions, tolerance: float) -> XRun:
    """The critical point on elements planned for it, and the branch past it."""
    last = transferred(points.pop())
    while critical.is_past(last.point):
        # On other elements the limit point lies a little before.
        last = transferred(points.pop())
    # The branch to follow begins with this state.
    problem, found = _limit_point(last, options, tolerance)
    before, after = (BranchPoint(problem, point) for point in (found.before, found.after))
    points += [last, before, after]
    if past == 0.0:
        return XRun(tuple(points), End.SNAP, found, before)
    branch = follow(after, options, lambda at: [touch(at), lift_off_of_all(at)], through_contact=False)
    next(branch)
    for item in branch:
        # The unstable branch ends where the sag touches or nothing lies.
        points.append(item.before if isinstance(item, BranchCrossing) else item)
        if isinstance(item, BranchCrossing) or item.point.arc - found.after.arc > past:
            break
    return XRun(tuple(points), End.SNAP, found, before)


def _limit_point(near: BranchPoint, options: StepOptions, tolerance: float) -> tuple[MovingContact, CriticalPoint]:
    """The limit point ahead: solved for or, where that fails, as in a strip as thin as rounding, bracketed."""
    with suppress(SolveError):
        return near.problem, critical.near(near.problem, near.point, tolerance, options)
    for item in follow(near, options, lambda _: [LIMIT], through_contact=False):
        if isinstance(item, BranchCrossing):
            before, after, problem = item.before.point, item.after.point, item.before.problem
            return problem, critical.locate(problem, before, after, tolerance, options)
    raise AssertionError("a branch ends in an event or raises")


def solve_height(strip: StripModel, height: float, refinement: float = 1.0, past: float = 0.0) -> XRun:
    """Lift to one height and run along x from there."""
    ((_, start),) = lift(strip.contact_mesh(refinement), [height])
    return along_x(start, height, past=past)

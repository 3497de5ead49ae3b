"""Branches of a strip on the floor, through the changes of its contact.

The strip starts flat or from a state of the elastica.  Along the branch elements are planned anew as its parts become
longer or shorter, and the contact changes at events: the sag touches in a point, the point becomes an interval, the
gripper comes down to the floor; and back.  Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NewtonError
from stripfold.follow.contact_events import (
    FIRST_INTERVAL,
    TOUCH_TOLERANCE,
    clearance,
    curvature,
    reaction,
    touch,
    zero,
)
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.events import Crossing, Event
from stripfold.solve.newton import Constraint
from stripfold.solve.problem import Point, Tangent
from stripfold.strip.contact_mesh import ContactMesh, Topology
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import Motion

STEPS = StepOptions(
    first=0.05, largest=0.7, max_correction=0.5, max_attempts=300, newton=newton.NewtonOptions(max_iterations=8)
)
"""A step that needs more iterations is halved: where there is no state it would not end."""
UNHELD = Event("change of the contact that leaves the strip unstable", critical.is_past)
"""The critical point where a contact ends without which the strip is unstable."""


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A point of a branch and its problem."""

    problem: MovingContact
    point: Point

    @property
    def contact(self) -> Array:
        """The contact coordinates."""
        return self.problem.contact(self.point.q)

    @property
    def model(self) -> Model:
        """The strip with its elements."""
        return self.problem.at(self.contact).model

    @property
    def u(self) -> Array:
        """The model's unknowns."""
        return self.point.q[: self.problem.n]

    def mid_surface(self, s: Array) -> Array:
        """Places of the mid-surface at distances from the grasped end, shape (len(s), 2), origin mid-strip."""
        return self.model.resampled_mid_surface(self.u, s)

    @property
    def topology(self) -> Topology:
        """Which parts lie."""
        return self.problem.mesh.topology

    @property
    def lam(self) -> float:
        """The control parameter."""
        return self.point.lam

    @property
    def touches(self) -> bool:
        """Whether something beside the lying part is on the floor."""
        return self.topology is not Topology.LYING


Planned = Callable[[Array], ContactMesh]
"""A mesh of a strip with one lift-off, planned for its place."""


def from_flat(mesh: Planned, motion: Motion, lam: float) -> BranchPoint:
    """A state with the gripper just lifted: the start is a beam under its weight, without tension.

    ``mesh``: plans a mesh with one lift-off.  ``motion``, ``lam``: where the gripper is: above the floor by much less
    than L*.

    Raises InvalidInputError: the gripper is still on the floor.
    """
    place = motion.values(lam)
    dx, height = (0.0, *place)[-2:]
    if height <= 0.0:
        allowed = "a path that lifts the end of the strip from its start"
        raise InvalidInputError("path", "along the floor", allowed, "leave out what is on the floor before the lift")
    free = (24.0 * height) ** 0.25
    planned = mesh(np.array([free]))
    model = planned.model
    a = np.clip(free - model.s, 0.0, None)
    position = np.stack([model.s - model.length / 2.0, free * a**3 / 12.0 - a**4 / 24.0], axis=1)
    u = model.unknowns_of(position, -(free * a**2 / 4.0 - a**3 / 6.0))
    # The gripper's advance compresses the strip evenly.
    u[model.middle[:, 0]] += dx * (1.0 - model.s / model.length)
    return solved(MovingContact(planned, motion), np.append(u, free), lam)


def from_elastica(mesh: Planned, motion: Motion, lam: float, state: elastica.State) -> BranchPoint:
    """The state at ``lam`` near one of the elastica."""
    return solved(*as_elastica(mesh, motion, state), lam)


def as_elastica(mesh: Planned, motion: Motion, state: elastica.State) -> tuple[MovingContact, Array]:
    """A strip bent as the elastica is: its problem and its unknowns."""
    planned = mesh(np.array([state.length]))
    model = planned.model
    at = state.at(np.clip(state.length - model.s, 0.0, None))
    lies = model.s >= state.length
    # The elastica's X points from the lift-off to the gripper, and so does its arc length.
    x = np.where(lies, model.s, state.length - at.x) - model.length / 2.0
    u = model.unknowns_of(np.stack([x, np.where(lies, 0.0, at.z)], axis=1), np.where(lies, 0.0, -at.theta))
    return MovingContact(planned, motion), np.append(u, state.length)


def solved(problem: MovingContact, q: Array, lam: float, sign: float = 1.0) -> BranchPoint:
    """The state at ``lam`` near a guess, with lambda rising, or falling where ``sign`` is negative."""
    return BranchPoint(problem, continuation.start(problem, q, lam, problem.bounded, sign, StepOptions()))


def transferred(
    at: BranchPoint,
    contact: Array | None = None,
    topology: Topology | None = None,
    constraint: tuple[Array, float] | None = None,
    motion: Motion | None = None,
    mesh: ContactMesh | None = None,
) -> BranchPoint:
    """The state near another one on elements planned anew.

    ``at``: the other state.  ``contact``, ``topology``: contact of the new state, by default the same.  ``constraint``:
    row over the contact coordinates and factor of lambda of the equation that picks the state; by default the normal
    plane of the branch.  Of the state guessed, its value is kept.  ``motion``, ``mesh``: motion of the gripper and
    elements; by default the same motion, and elements planned for the contact.
    """
    problem, point = at.problem, at.point
    here = at.contact
    to = here if contact is None else contact
    mesh = mesh or problem.mesh.replanned(to, topology)
    before = problem.at(here)
    u = before.model.resampled(at.u, mesh.model.s)
    new = MovingContact(mesh, motion or problem.motion, before.carried_over(at.u, mesh.model), to)
    q = np.concatenate([u, to])
    row, corner = constraint or (point.tangent.q[problem.n :], point.tangent.lam)
    rows = np.concatenate([np.zeros(new.n), row])
    # Between other nodes the same shape is stretched: the stress is not that of the shape.
    stress = before.model.resampled_stress(at.u, mesh.model)
    where = Constraint(rows, corner, q, point.lam)
    state = newton.solve(new, q, point.lam, new.bounded, where, predicted_stress=stress)
    if new.effects:
        new = new.let_go(state.q)
    along = point.tangent.q[problem.n :] if len(to) == len(here) else row
    towards = Tangent(np.concatenate([np.zeros(new.n), along]), point.tangent.lam)
    return BranchPoint(new, continuation.evaluate(new.sliding, state, towards, point.arc))


def contact_changes(problem: MovingContact) -> dict[Event, Callable[[BranchPoint], BranchPoint]]:
    """The events that change the contact, and the states behind them."""
    topology = problem.mesh.topology

    def to_point(at: BranchPoint) -> BranchPoint:
        """The sag's lowest point, or the middle of an interval, is held on the floor."""
        *interval, lift_off = at.contact
        place = np.mean(interval) if interval else clearance(problem, at.point.q)[1]
        return transferred(at, np.array([place, lift_off]), Topology.POINT, constraint=(np.zeros(2), 1.0))

    def to_lying(at: BranchPoint) -> BranchPoint:
        return transferred(at, at.contact[1:], Topology.LYING, constraint=(np.zeros(1), 1.0))

    def to_interval(at: BranchPoint) -> BranchPoint:
        place, lift_off = at.contact
        contact = np.array([place - 0.5 * FIRST_INTERVAL, place + 0.5 * FIRST_INTERVAL, lift_off])
        return transferred(at, contact, Topology.INTERVAL, constraint=(np.array([-1.0, 1.0, 0.0]), 0.0))

    def length(point: Point) -> float:
        ends = problem.contact(point.q)
        return float(ends[1] - ends[0]) - 0.5 * FIRST_INTERVAL

    if topology is Topology.LYING:
        return {touch(problem): to_point}
    if topology is Topology.POINT:
        return {
            zero("release of the sag", lambda point: reaction(problem, point), TOUCH_TOLERANCE): to_lying,
            zero("flattening of the sag", lambda point: curvature(problem, point)): to_interval,
        }
    if topology is Topology.INTERVAL:
        return {zero("end of the interval of contact", length): to_point}
    return {}


def follow(
    first: BranchPoint,
    options: StepOptions,
    stops: Callable[[MovingContact], Sequence[Event]],
    through_contact: bool = True,
    end: float = inf,
) -> Iterator[BranchPoint | BranchCrossing]:
    """Yield ``first``, then point after point along its branch, and the events of ``stops`` as they happen.

    :data:`UNHELD` is an event of its own, between the states on either side of a change of the contact.  The point at
    ``end``, a value of lambda, is the last; events behind it do not count.

    Raises SolveError: the branch could not be followed, or its contact is none of :class:`.Topology`.
    """

    def with_changes(problem: MovingContact) -> tuple[dict[Event, Callable[[BranchPoint], BranchPoint]], list[Event]]:
        changes = contact_changes(problem) if through_contact else {}
        # An event that is not located may be behind a change of the contact in the same step.
        return changes, [*changes, *stops(problem)]

    at = first
    yield at
    while True:
        problem = at.problem
        if at.point.lam >= end:
            yield BranchPoint(problem, continuation.step_to(problem, at.point, end, options))
            return
        changes, events = with_changes(problem)
        branch = continuation.follow(problem, at.point, options, events)
        next(branch)
        for item in branch:
            if isinstance(item, Crossing):
                if item.before.lam >= end:
                    continue
                before, after = (BranchPoint(problem, p) for p in (item.before, item.after))
                if item.event not in changes:
                    yield BranchCrossing(item.event, before, after)
                    continue
                if before.point is not at.point:
                    yield before
                last, at = before, changes[item.event](after)
                yield from _changed(last, at)
                break
            if item.lam >= end:
                yield BranchPoint(problem, continuation.step_to(problem, at.point, end, options))
                return
            step = item.arc - at.point.arc
            at = BranchPoint(problem, item)
            yield at
            if problem.mesh.drifted(at.contact):
                try:
                    moved = transferred(at)
                except NewtonError:
                    # The critical point can lie a little before, too: there is no such state on them then.
                    continue
                # Between other nodes an event can lie a little before.  It is located on the elements it is ahead on.
                both = zip(events, with_changes(moved.problem)[1], strict=True)
                if all(here.passed(at.point, None) or not there.passed(moved.point, None) for here, there in both):
                    at, options = moved, replace(options, first=step)
                    break


def _changed(before: BranchPoint, after: BranchPoint) -> Iterator[BranchPoint | BranchCrossing]:
    """The state behind a change of the contact, preceded by :data:`UNHELD` where it is one."""
    if is_unheld(before, after):
        yield BranchCrossing(UNHELD, before, after)
    yield after


def is_unheld(before: BranchPoint, after: BranchPoint) -> bool:
    """Whether the strip is stable before a change of the contact, and not behind it."""
    return critical.is_past(after.point) and not critical.is_past(before.point)


@dataclass(frozen=True, eq=False)
class BranchCrossing:
    """An event between two points of a branch."""

    event: Event
    before: BranchPoint
    after: BranchPoint

"""Branches of a strip on the floor, through the changes of its contact.

The strip starts flat or from a state of the elastica.  Along the branch elements are planned anew as its parts become
longer or shorter, and the contact changes at events: a sag touches in a point, the point becomes an interval, the
whole strip leaves the floor; and back.  Lengths in L*.  Source: docs/physics.md, section 5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NewtonError
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import Crossing, Event, StepOptions
from stripfold.solve.newton import Constraint, Linearised
from stripfold.solve.problem import Point, Tangent
from stripfold.strip.contact_mesh import LYING, ContactMesh, Topology
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Lift, Motion, clamp_of

STEPS = StepOptions(
    first=0.05, largest=0.7, max_correction=0.5, max_attempts=300, newton=newton.NewtonOptions(max_iterations=8)
)
"""A step that needs more iterations is halved: where there is no state it would not end."""
LOW = 1e-3
"""Height, L*, below which a gripper beside a layer that lies is on the floor: there the part between them, a beam of
length (24 z)^(1/4) where nothing is curled, shrinks without bound."""
LOOP = 2.0
"""That length over the beam's from which the part beside a gripper on the floor is a loop that friction keeps up."""
NEAR_FLOOR = 1e-2
"""Arc length to which the landing of a gripper is located: almost all of it is change of that part."""
FIRST_INTERVAL = 0.02
"""Length of an interval of contact when it is first solved for, L*."""
TOUCH_TOLERANCE = 1e-6
"""Arc length to which a touch of the sag and its release are located, L*."""
LEAST_LYING = 1e-3
"""Length of the lying part at which the whole strip of a rod is taken to lift off, L*."""
LIFTED = "lift-off of the whole strip"
LEAST_SAG = 0.02
"""Height of the strip on either side over the lowest point of a sag, L*."""
SAMPLES = np.linspace(0.0, 1.0, 5)[:-1]
"""Places in an element where the height over the floor is looked at."""
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
        return self.topology != LYING


Planned = Callable[[Array], ContactMesh]
"""A mesh of a strip with one lift-off, planned for its place."""


def from_flat(mesh: Planned, motion: Motion, lam: float) -> BranchPoint:
    """A state with the gripper just lifted: straight up, as a beam under its weight, and then along x.

    A gripper that advances makes a thin strip buckle at once, into the shape to which its branch leads.

    ``mesh``: plans a mesh with one lift-off.  ``motion``, ``lam``: where the gripper is: above the floor by much less
    than L*.

    Raises InvalidInputError: the gripper is still on the floor; SolveError: the branch could not be followed there.
    """
    place = motion.values(lam)
    dx, height = (0.0, *place)[-2:]
    if height <= 0.0:
        allowed = "a path that lifts the end of the strip from its start"
        raise InvalidInputError("path", "along the floor", allowed, "leave out what is on the floor before the lift")
    curl = mesh(np.array([1.0])).model.curl
    free = _beside(height, curl)
    planned = mesh(np.array([free]))
    model, reaction = planned.model, curl / free + 0.5 * free
    a = np.clip(free - model.s, 0.0, None)
    position = np.stack([model.s - model.length / 2.0, reaction * a**3 / 6.0 - a**4 / 24.0], axis=1)
    u = model.unknowns_of(position, -(reaction * a**2 / 2.0 - a**3 / 6.0))
    lifted = solved(MovingContact(planned, Lift()), np.append(u, free), height)
    if isinstance(motion, Lift):
        return lifted
    clamp = clamp_of(motion, model, lam)
    start = lifted.point.q[model.middle[0, 0]]
    at = solved(MovingContact(planned, AlongX(height, clamp.angle if clamp else None)), lifted.point.q, float(start))
    there = continuation.step_to(at.problem, at.point, float(dx), STEPS)
    return solved(MovingContact(planned, motion), there.q, lam)


def _beside(height: float, curl: float) -> float:
    """Length of the part beside a gripper near the floor, a beam under its weight, whose end has the curl's curvature.

    Its height there is curl a^2 / 6 + a^4 / 24; where the curl is down, it is an arch even on the floor.
    """
    return float(np.sqrt(2.0 * (np.hypot(curl, np.sqrt(6.0 * height)) - curl)))


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
    plane of the branch, of that with the new contact where it has more or fewer coordinates.  Of the state guessed, its
    value is kept.  ``motion``, ``mesh``: motion of the gripper and elements; by default the same motion, and elements
    planned for the contact.
    """
    problem, point = at.problem, at.point
    here = at.contact
    to = here if contact is None else contact
    mesh = mesh or problem.mesh.replanned(to, topology)
    before = problem.at(here)
    u = before.model.resampled(at.u, mesh.model.s)
    effects = tuple(effect.carried_over(at.u, mesh.model) for effect in before.effects)
    new = MovingContact(mesh, motion or problem.motion, effects, to)
    q = np.concatenate([u, to])
    # Between other nodes the same shape is stretched: the stress is not that of the shape.
    stress = before.model.resampled_stress(at.u, mesh.model)
    if constraint is None and (new.effects or len(to) != len(here)):
        # The branch of another contact, or of friction that is held, has its own direction: the normal plane of this
        # one may not meet it, and it may turn back at this very lambda.
        guess = Linearised(new, q, point.lam, new.bounded, stress)
        new_tangent = guess.tangent(new.metric, Tangent(np.zeros(new.size), point.tangent.lam))
        constraint = (new.metric * new_tangent.q)[new.n :], new_tangent.lam
    row, corner = constraint or (point.tangent.q[problem.n :], point.tangent.lam)
    rows = np.concatenate([np.zeros(new.n), row])
    where = Constraint(rows, corner, q, point.lam)
    state = newton.solve(new, q, point.lam, new.bounded, where, predicted_stress=stress)
    if new.effects:
        # Held, friction gives way to what other elements and a new contact move, and each time a little more is lost.
        held, new = new, new.let_go(state.q, resists=True)
        try:
            state = newton.solve(new, state.q, state.lam, new.bounded, where)
        except NewtonError:
            # Elements stick and slide in turn.
            new = held.let_go(state.q, resists=False)
    along = point.tangent.q[problem.n :] if len(to) == len(here) else row
    towards = Tangent(np.concatenate([np.zeros(new.n), along]), point.tangent.lam)
    found = continuation.evaluate(new.sliding, state, towards, point.arc)
    if found.negatives == 0 and point.tangent.lam > 0.0 > found.tangent.lam:
        # Just behind a fold of the new branch that of the guess may have pointed back to it.
        found = replace(found, tangent=Tangent(-found.tangent.q, -found.tangent.lam))
    return BranchPoint(new, found)


def contact_changes(problem: MovingContact) -> dict[Event, Callable[[BranchPoint], BranchPoint]]:
    """The events that change the contact, and the states behind them.

    Each changes one interval or point: it opens, closes, flattens or is released, whatever the others are.
    """
    topology = problem.mesh.topology
    changes: dict[Event, Callable[[BranchPoint], BranchPoint]] = {touch(problem): _touched}
    for i in problem.points.tolist():
        released = zero("release of the sag", partial(reaction, problem, i), TOUCH_TOLERANCE)
        changes[released] = partial(_changed_to, number=i, parts=(False,))
        flattened = zero("flattening of the sag", partial(curvature, problem, i))
        changes[flattened] = partial(_flattened, number=i)
    height = partial(_height_over_low, problem)
    if topology[0]:
        changes[zero("take-off of the gripper", lambda point: -height(point), NEAR_FLOOR)] = _taken_off
    elif len(topology) > 2 and topology[1]:
        landing = partial(_height_of_landing, problem)
        changes[zero("landing of the gripper", landing, NEAR_FLOOR)] = _landed
    for i in range(1, len(topology) - 1):
        if topology[i]:
            ends = zero("end of the interval of contact", partial(_length, problem, i))
            changes[ends] = partial(_changed_to, number=i - 1, parts=(False, False))
    if topology[-1]:
        changes[lift_off_of_all(problem)] = partial(_changed_to, number=len(topology) - 2, parts=(False,))
    else:
        changes[zero("landing of the end", partial(height_beside_end, problem))] = _landed_end
    return changes


def _length(problem: MovingContact, part: int, point: Point) -> float:
    """Length of a lying part over the least that one has."""
    return float(problem.mesh.parts(problem.contact(point.q))[part]) - 0.5 * FIRST_INTERVAL


def _height_over_low(problem: MovingContact, point: Point) -> float:
    return float(problem.motion.values(point.lam)[:2][-1]) - LOW


def _height_of_landing(problem: MovingContact, point: Point) -> float:
    """Height over LOW; of a loop that stands beside the gripper, which does not land, one that is positive."""
    loop = problem.contact(point.q)[0] > LOOP * _beside(LOW, problem.mesh.model.curl)
    return 1.0 if loop else _height_over_low(problem, point)


def _landed(at: BranchPoint) -> BranchPoint:
    """The upper layer lies up to the gripper."""
    return transferred(at, at.contact[1:], at.topology[1:], (np.zeros(len(at.contact) - 1), 1.0))


def _flattened(at: BranchPoint, number: int) -> BranchPoint:
    """The point becomes an interval; beside a gripper that is on the floor by now, the layer lies up to there."""
    flat = _changed_to(at, number, (False, True, False))
    lies = number == 0 and flat is not at and _height_of_landing(flat.problem, flat.point) < 0.0
    return _landed(flat) if lies else flat


def _taken_off(at: BranchPoint) -> BranchPoint:
    """The upper layer lies from some way beside the gripper on."""
    beside = min(_beside(LOW, at.model.curl), 0.5 * float(at.contact[0]))
    contact = np.append(beside, at.contact)
    return transferred(at, contact, (False, *at.topology), (np.zeros(len(contact)), 1.0))


def _touched(at: BranchPoint) -> BranchPoint:
    """The sag's lowest point is held on the floor."""
    lowest = sags(at.problem, at.point.q)
    part = int(np.argmin([height for height, _ in lowest]))
    contact = np.insert(at.contact, part, lowest[part][1])
    topology = (*at.topology[:part], False, *at.topology[part:])
    return transferred(at, contact, topology, constraint=(np.zeros(len(contact)), 1.0))


def _landed_end(at: BranchPoint) -> BranchPoint:
    """The strip lies beside its held end."""
    contact = np.append(at.contact, longest_free(at.model))
    return transferred(at, contact, (*at.topology, True), constraint=(np.eye(len(contact))[-1], 0.0))


def _changed_to(at: BranchPoint, number: int, parts: tuple[bool, ...]) -> BranchPoint:
    """The parts on either side of a contact coordinate, or of the interval that it begins, become these."""
    topology, contact = at.topology, at.contact
    after = number + (3 if len(parts) == 2 else 2)
    place = float(np.mean(contact[number : after - 1]))
    topology = (*topology[:number], *parts, *topology[after:])

    new = {1: [], 2: [place], 3: [place - 0.5 * FIRST_INTERVAL, place + 0.5 * FIRST_INTERVAL]}[len(parts)]
    there = np.concatenate([contact[:number], new, contact[after - 1 :]])
    if len(parts) < 3:
        return transferred(at, there, topology)

    def opened(length_given: bool) -> BranchPoint:
        row, corner = np.zeros(len(there)), 1.0
        if length_given:
            row[number : number + 2], corner = (-1.0, 1.0), 0.0
        return transferred(at, there, topology, constraint=(row, corner))

    # A new interval has its first length, wherever lambda is.
    if not at.problem.effects:
        return opened(length_given=True)
    # With friction, which does not go back, it may be there ahead, or have another length by now, or not be there yet.
    for length_given in (True, False):
        with suppress(NewtonError):
            found = opened(length_given)
            if found.lam > at.lam or not length_given:
                return found
    return at


def follow(
    first: BranchPoint,
    options: StepOptions,
    stops: Callable[[MovingContact], Sequence[Event]],
    through_contact: bool = True,
    end: float = inf,
) -> Iterator[BranchPoint | BranchCrossing]:
    """Yield ``first``, then point after point along its branch, and the events of ``stops`` as they happen.

    :data:`UNHELD` is an event of its own, between the states on either side of a change of the contact.  The point at
    ``end``, a value of lambda, is the last.

    Raises SolveError: the branch could not be followed.
    """

    def with_changes(problem: MovingContact) -> tuple[dict[Event, Callable[[BranchPoint], BranchPoint]], list[Event]]:
        ends = stops(problem)
        names, changes = {event.name for event in ends}, contact_changes(problem) if through_contact else {}
        changes = {event: change for event, change in changes.items() if event.name not in names}
        # An event that is not located may be behind a change of the contact in the same step.
        return changes, [*changes, *ends]

    at = first
    yield at
    while True:
        problem = at.problem
        if at.point.lam >= end:
            yield BranchPoint(problem, continuation.step_to(problem, at.point, end, options))
            return
        changes, events = with_changes(problem)
        branch = continuation.follow(problem, at.point, options, events, end)
        next(branch)
        for item in branch:
            if isinstance(item, Crossing):
                before, after = (BranchPoint(problem, p) for p in (item.before, item.after))
                if item.event not in changes:
                    yield BranchCrossing(item.event, before, after)
                    continue
                if before.point is not at.point:
                    yield before
                last, at = before, changes[item.event](after)
                if at.lam >= end:
                    # Behind the end a new interval has its first length.
                    yield BranchPoint(problem, continuation.step_to(problem, last.point, end, options))
                    return
                if is_unheld(last, at):
                    yield BranchCrossing(UNHELD, last, at)
                yield at
                break
            if item.lam >= end:
                yield BranchPoint(problem, item)
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


def is_unheld(before: BranchPoint, after: BranchPoint) -> bool:
    """Whether the strip is stable before a change of the contact, and not behind it."""
    return critical.is_past(after.point) and not critical.is_past(before.point)


@dataclass(frozen=True, eq=False)
class BranchCrossing:
    """An event between two points of a branch."""

    event: Event
    before: BranchPoint
    after: BranchPoint


def sags(problem: MovingContact, q: Array) -> list[tuple[float, float]]:
    """The smallest height over the floor where each part sags, inf where it does not, and its place along the strip."""
    mesh, n = problem.mesh, problem.n
    model = problem.at(q[n:]).model
    columns = model.middle[:, 1]
    height = q[columns[:: (len(columns) - 1) // len(mesh.on_floor)]]
    ends = [0, *mesh.elements_at.tolist(), len(height) - 1]
    return [
        (np.inf, np.nan) if lies else _sag(model, q[:n], height[first : last + 1], first)
        for lies, first, last in zip(mesh.topology, ends[:-1], ends[1:], strict=True)
    ]


def _sag(model: Model, u: Array, height: Array, first: int) -> tuple[float, float]:
    """That of a free part with these heights of its elements' ends, from the one of number ``first`` on."""
    least = np.flatnonzero((height[1:-1] < height[:-2]) & (height[1:-1] < height[2:])) + 1
    # Beside a contact a coarse mesh waves a little.
    found = [i for i in least if min(height[:i].max(), height[i:].max()) - height[i] > LEAST_SAG]
    if not found:
        return np.inf, np.nan
    i = first + min(found, key=lambda i: float(height[i]))
    left, middle, right = model.ends[i - 1 : i + 2]
    s = np.concatenate([left + (middle - left) * SAMPLES, middle + (right - middle) * SAMPLES, [right]])
    z = model.resampled_mid_surface(u, s)[:, 1]
    # The lowest point of a parabola through three samples.
    k = int(np.argmin(z[1:-1])) + 1
    a, b = s[k - 1] - s[k], s[k + 1] - s[k]
    to_left, to_right = (z[k - 1] - z[k]) / a, (z[k + 1] - z[k]) / b
    curve = (to_right - to_left) / (b - a)
    slope = to_left - curve * a
    lowest = min(max(-slope / (2.0 * curve), a), b)
    return float(z[k] + lowest * (slope + lowest * curve)), float(s[k] + lowest)


def clearance(problem: MovingContact, q: Array) -> tuple[float, float]:
    """The smallest height of a sag over the floor, inf without one, and its place along the strip."""
    return min(sags(problem, q), key=lambda sag: sag[0])


def zero(name: str, value: Callable[[Point], float], tolerance: float = 1e-4) -> Event:
    """The event that a value, positive before, becomes negative."""
    return Event(name, lambda point, _: value(point) < 0.0, tolerance, value)


def touch(problem: MovingContact) -> Event:
    """The event that a sag touches the floor."""
    return zero("touch of the sag", lambda point: clearance(problem, point.q)[0], TOUCH_TOLERANCE)


def longest_free(model: Model) -> float:
    """Largest lift-off coordinate: beyond, the whole strip is taken to lift off.

    The solid's lift-off is as wide as the strip is thick: of less the held end carries a part.
    """
    return model.length - (LEAST_LYING if model.slopes is not None else max(LEAST_LYING, model.thickness))


def lift_off_of_all(problem: MovingContact) -> Event:
    """The event that nothing is left lying."""
    most, lies = longest_free(problem.mesh.model), problem.mesh.topology[-1]
    return zero(LIFTED, lambda point: most - float(problem.contact(point.q)[-1]) if lies else 1.0)


def reaction(problem: MovingContact, number: int, point: Point) -> float:
    """Reaction of the floor in the point of contact that is this contact coordinate."""
    return float(point.state.force[problem.mesh.model.middle[problem.columns[number], 1]])


def curvature(problem: MovingContact, number: int, point: Point) -> float:
    """Curvature of the strip over the floor in a point of contact, 1/L*: by its height at :data:`FIRST_INTERVAL`.

    On the solid a force in a point shears the strip: without a length it would be flat in any contact.
    """
    place = problem.contact(point.q)[number]
    at = place + FIRST_INTERVAL * np.array([-1.0, 1.0])
    model = problem.at(problem.contact(point.q)).model
    height = model.resampled_mid_surface(point.q[: problem.n], at)[:, 1].sum()
    # The reaction is the jump of the shear force, and so of the third derivative.
    return float(height / FIRST_INTERVAL**2 - reaction(problem, number, point) * FIRST_INTERVAL / 6.0)


def height_beside_end(problem: MovingContact, point: Point) -> float:
    """Height of a strip that is held at its end and free beside it, where a lying part would begin."""
    model = problem.at(problem.contact(point.q)).model
    return float(model.resampled_mid_surface(point.q[: problem.n], np.array([longest_free(model)]))[0, 1])

"""A strip whose gripper follows a path: statics along it, from the flat strip to its end or a critical point.

All in units of L*; lambda is the length travelled.  Corners of the path are states of their own: the branch is
followed to the corner, and from there with the direction of the next piece.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

from stripfold.base.errors import SolveError
from stripfold.base.percent import Percent
from stripfold.follow import contact_branch
from stripfold.follow.contact import lift_off
from stripfold.follow.contact_branch import STEPS, UNHELD, BranchPoint, Planned
from stripfold.follow.contact_events import clearance, lift_off_of_all
from stripfold.follow.contact_set import ROBUST_NEWTON, SHORT, from_nodes, on_nodes
from stripfold.follow.landing import LOW, landed, place_of_low, taken_off
from stripfold.follow.static import LAMBDA_TOLERANCE
from stripfold.paths.curve import GripperPath, Piece
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint, is_past
from stripfold.solve.events import Event, never
from stripfold.solve.problem import Point
from stripfold.strip.contact_mesh import Topology
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, StripProblem

State = tuple[StripProblem, Point]
"""A state on its own mesh, with contact at nodes."""

LIMIT = critical.critical_point(LAMBDA_TOLERANCE)
"""The event that ends an advance."""
FIRST = 0.01
"""Largest length travelled at the first state, L*."""
PENETRATION = 1e-3
"""Depth under the floor that a sag beside a contact must reach to count as another contact, L*."""
NODAL_STEPS = StepOptions(first=0.05, largest=0.5, target_iterations=10, max_attempts=1000, newton=ROBUST_NEWTON)
"""Steps with contact at nodes: the contact of several may change in one, which takes more iterations."""
MAX_RETURNS = 3
"""Returns from contact at nodes along one part of a path."""
MOVING, NODAL = "moving", "nodal"


@dataclass(frozen=True, eq=False)
class StaticSegment:
    """Statics along a part of a path.

    ``states``: accepted states, in order; at a corner two, one for each direction.  ``pieces``: for each state the
    index of its piece.  ``critical``: the critical point that ends it, or None at the end of the path.  ``unheld``:
    where that is a change of the contact, the state behind it, whose mode is the critical one; else None.  ``last``:
    the last state with its contact coordinates; None if its contact is at nodes.  ``nodal``: why the contact was found
    node by node in some states, where it was none of :class:`.Topology`; else empty.
    """

    path: GripperPath
    states: tuple[State, ...]
    pieces: tuple[int, ...]
    critical: CriticalPoint | None
    unheld: State | None
    last: BranchPoint | None
    nodal: str = ""

    @property
    def points(self) -> tuple[Point, ...]:
        """The states without their problems."""
        return tuple(point for _, point in self.states)


def from_flat(mesh: Planned, path: GripperPath, length: float) -> BranchPoint:
    """The first state of a path, its gripper just lifted."""
    piece = path.pieces[0]
    first = min(FIRST, place_of_low(piece, piece.start, piece.end))
    return contact_branch.from_flat(mesh, AlongPath(piece, length), first)


def follow(
    mesh: Planned,
    path: GripperPath,
    length: float,
    first: BranchPoint | State | None = None,
    piece: int = 0,
    options: StepOptions = STEPS,
    progress: Callable[[str], None] | None = None,
) -> StaticSegment:
    """Follow a path from the flat strip, or from a state on one of its pieces.

    ``mesh``: plans a mesh of the strip with one lift-off: :meth:`.StripModel.contact_mesh`.  ``path``, ``length``: the
    path, and the length of the strip, L*.  ``first``, ``piece``: the state to begin with, and the index of its piece.
    ``options``: of the steps.  ``progress``: called with a line on how much of the path is done.  Raises SolveError:
    when a state or the branch cannot be computed.
    """
    at: BranchPoint | State = first or from_flat(mesh, path, length)
    follower = _Follower(mesh, path, length, options, at, piece, Percent(progress, "following the path"))
    while follower.critical is None and follower.lam < path.length:
        follower.advance()
    last = follower.at if isinstance(follower.at, BranchPoint) else None
    states, pieces = tuple(follower.states), tuple(follower.pieces)
    return StaticSegment(path, states, pieces, follower.critical, follower.unheld, last, follower.nodal)


@dataclass
class _Follower:
    """The states so far, and the one to go on from."""

    mesh: Planned
    path: GripperPath
    length: float
    options: StepOptions
    at: BranchPoint | State
    piece: int
    followed: Percent
    states: list[State] = field(default_factory=list)
    pieces: list[int] = field(default_factory=list)
    critical: CriticalPoint | None = None
    unheld: State | None = None
    nodal: str = ""
    returns: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.at, BranchPoint):
            self.nodal = "the contact at rest is none of the known kinds"
        self.add(self.at)

    def add(self, at: BranchPoint | State) -> None:
        self.at = at
        self.states.append(at.problem.on_mesh(at.point) if isinstance(at, BranchPoint) else at)
        self.pieces.append(self.piece)
        self.followed(self.lam / self.path.length)

    @property
    def lam(self) -> float:
        return self.states[-1][1].lam

    def advance(self) -> None:
        """To the end of the piece, a critical point, or a change between contact coordinates and nodes."""
        piece = self.path.pieces[self.piece]
        if isinstance(self.at, BranchPoint):
            try:
                self.with_coordinates(self.at, piece)
            except SolveError as error:
                self.nodal = self.nodal or str(error)
                self.to_nodes()
        else:
            self.at_nodes(*self.at, piece)
        if self.critical is None and self.lam >= piece.end and self.piece + 1 < len(self.path.pieces):
            self.turn()

    def turn(self) -> None:
        """The state at the corner with the motion of the next piece."""
        self.piece += 1
        motion, lam = AlongPath(self.path.pieces[self.piece], self.length), self.lam
        if isinstance(self.at, BranchPoint):
            problem = MovingContact(self.at.problem.mesh, motion)
            self.add(contact_branch.solved(problem, self.at.point.q, lam))
        else:
            before, point = self.at
            onward = replace(before, motion=motion)
            self.add((onward, continuation.start(onward, point.q, lam, point.active, 1.0, NODAL_STEPS)))

    def with_coordinates(self, at: BranchPoint, piece: Piece) -> None:
        """Follow the branch with contact coordinates as unknowns."""
        start, end = (piece.position(lam)[1] <= LOW for lam in (at.point.lam, piece.end))
        highest = max((at.point.lam, 0.5 * (at.point.lam + piece.end), piece.end), key=lambda s: piece.position(s)[1])
        if start and at.topology is Topology.FOLDED and piece.position(highest)[1] > LOW:
            at = taken_off(at, place_of_low(piece, at.point.lam, highest))
            self.add(at)
        before_end = place_of_low(piece, piece.end, highest) if end and piece.position(highest)[1] > LOW else piece.end
        for to in (before_end, piece.end):
            if self.critical is None and at.point.lam < to:
                at = self.along_branch(at, to)
            if self.critical is None and to < piece.end and at.topology is Topology.INTERVAL:
                at = landed(at, piece.end)
                self.add(at)
        if self.critical is None and is_past(at.point):
            raise SolveError("the strip is not stable at a corner of the path", parameter=at.point.lam)

    def along_branch(self, at: BranchPoint, end: float) -> BranchPoint:
        """Add the states up to this one or a critical point, and return the last."""
        branch = contact_branch.follow(at, self.options, _stops, end=end)
        next(branch)
        for item in branch:
            if isinstance(item, BranchPoint):
                at = item
                self.add(at)
                continue
            if item.event not in (LIMIT, UNHELD):
                raise SolveError(f"{item.event.name}: none of the known kinds of contact", parameter=at.point.lam)
            at, after = item.before, item.after
            if at.point is not self.at.point:  # type: ignore[union-attr]
                self.add(at)
            if item.event is UNHELD:
                self.critical, self.unheld = _at_change(at.point, after.point), after.problem.on_mesh(after.point)
            else:
                self.critical = critical.locate(at.problem, at.point, after.point, LAMBDA_TOLERANCE, self.options)
            break
        return at

    def to_nodes(self) -> None:
        """The present state with its contact at nodes."""
        assert isinstance(self.at, BranchPoint)
        problem, point = on_nodes(self.at)
        point = continuation.start(problem, point.q, self.lam, point.active, 1.0, NODAL_STEPS)
        self.at = (problem, point)

    def may_return(self, problem: StripProblem, point: Point) -> bool:
        """Whether contact coordinates may do again."""
        lies = self.length - lift_off(problem.model, point) > SHORT
        return lies and self.returns < MAX_RETURNS and problem.self_contact is None

    def at_nodes(self, problem: StripProblem, point: Point, piece: Piece) -> None:
        """Follow the branch with contact at nodes, as long as it is none of the known kinds."""
        end = Event("end of the piece", lambda point, _: point.lam >= piece.end, located=never)
        branch = continuation.follow(problem, point, NODAL_STEPS, [LIMIT, end])
        next(branch)
        for item in branch:
            if isinstance(item, Point):
                self.add((problem, item))
                if self.may_return(problem, item):
                    with suppress(SolveError):
                        self.at = from_nodes(self.mesh, problem, item)
                        self.returns += 1
                        return
            elif item.event is end:
                self.add((problem, continuation.step_to(problem, item.before, piece.end, NODAL_STEPS)))
                return
            elif item.before.lam < piece.end:
                self.add((problem, item.before))
                self.critical = critical.locate(problem, item.before, item.after, LAMBDA_TOLERANCE, NODAL_STEPS)
                return


def _stops(problem: MovingContact) -> list[Event]:
    """What ends a branch, and what its kind of contact cannot describe."""
    lifted = lift_off_of_all(problem)
    if problem.mesh.topology is Topology.LYING:
        return [lifted, LIMIT]
    sag = Event("another touch of a sag", lambda point, _: clearance(problem, point.q)[0] < -PENETRATION)
    return [sag, lifted, LIMIT]


def _at_change(before: Point, after: Point) -> CriticalPoint:
    """The critical point at a change of the contact, between the states on either side."""
    return CriticalPoint(
        before.lam, before.lam, after.lam, before.lam, agree=False, before=before, after=after, mode=after.mode,
        evaluations=0,
    )  # fmt: skip

"""A strip whose gripper follows a path: statics along it, from the flat strip to its end or a critical point.

All in units of L*; lambda is the length travelled.  Corners of the path are states of their own: the branch is
followed to the corner, and from there with the direction of the next piece.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from stripfold.base.errors import SolveError
from stripfold.base.percent import Percent
from stripfold.follow import contact_branch
from stripfold.follow.contact_branch import STEPS, UNHELD, BranchPoint, Planned
from stripfold.follow.landing import LOW, landed, place_of_low, taken_off
from stripfold.follow.static import LAMBDA_TOLERANCE
from stripfold.paths.curve import GripperPath
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import LIMIT, CriticalPoint, is_past
from stripfold.solve.problem import Point
from stripfold.strip.contact_mesh import FOLDED, INTERVAL
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, StripProblem

State = tuple[StripProblem, Point]
"""A state on its own mesh, with the floor as a bound."""

FIRST = 0.01
"""Largest length travelled at the first state, L*."""
MOVING, NODAL = "moving", "nodal"


@dataclass(frozen=True, eq=False)
class StaticSegment:
    """Statics along a part of a path.

    ``states``: accepted states, in order; at a corner two, one for each direction.  ``pieces``: for each state the
    index of its piece.  ``critical``: the critical point that ends it, or None at the end of the path.  ``unheld``:
    where that is a change of the contact, the state behind it, whose mode is the critical one; else None.  ``last``:
    the last state with its contact coordinates.
    """

    path: GripperPath
    states: tuple[State, ...]
    pieces: tuple[int, ...]
    critical: CriticalPoint | None
    unheld: State | None
    last: BranchPoint

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
    first: BranchPoint | None = None,
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
    at = first or from_flat(mesh, path, length)
    follower = _Follower(path, length, options, at, piece, Percent(progress, "following the path"))
    while follower.critical is None and follower.lam < path.length:
        follower.advance()
    states, pieces = tuple(follower.states), tuple(follower.pieces)
    return StaticSegment(path, states, pieces, follower.critical, follower.unheld, follower.at)


@dataclass
class _Follower:
    """The states so far, and the one to go on from."""

    path: GripperPath
    length: float
    options: StepOptions
    at: BranchPoint
    piece: int
    followed: Percent
    states: list[State] = field(default_factory=list)
    pieces: list[int] = field(default_factory=list)
    critical: CriticalPoint | None = None
    unheld: State | None = None

    def __post_init__(self) -> None:
        self.add(self.at)

    def add(self, at: BranchPoint) -> None:
        self.at = at
        self.states.append(at.problem.on_mesh(at.point))
        self.pieces.append(self.piece)
        self.followed(self.lam / self.path.length)

    @property
    def lam(self) -> float:
        return self.states[-1][1].lam

    def advance(self) -> None:
        """To the end of the piece or a critical point."""
        at, piece = self.at, self.path.pieces[self.piece]
        start, end = (piece.position(lam)[1] <= LOW for lam in (at.point.lam, piece.end))
        highest = max((at.point.lam, 0.5 * (at.point.lam + piece.end), piece.end), key=lambda s: piece.position(s)[1])
        if start and at.topology == FOLDED and piece.position(highest)[1] > LOW:
            at = taken_off(at, place_of_low(piece, at.point.lam, highest))
            self.add(at)
        before_end = place_of_low(piece, piece.end, highest) if end and piece.position(highest)[1] > LOW else piece.end
        for to in (before_end, piece.end):
            if self.critical is None and at.point.lam < to:
                at = self.along_branch(at, to)
            if self.critical is None and to < piece.end and at.topology == INTERVAL:
                at = landed(at, piece.end)
                self.add(at)
        if self.critical is None and is_past(at.point):
            raise SolveError("the strip is not stable at a corner of the path", parameter=at.point.lam)
        if self.critical is None and self.lam >= piece.end and self.piece + 1 < len(self.path.pieces):
            self.turn()

    def turn(self) -> None:
        """Add the state at the corner with the motion of the next piece."""
        self.piece += 1
        motion = AlongPath(self.path.pieces[self.piece], self.length)
        problem = MovingContact(self.at.problem.mesh, motion)
        self.add(contact_branch.solved(problem, self.at.point.q, self.lam))

    def along_branch(self, at: BranchPoint, end: float) -> BranchPoint:
        """Add the states up to this one or a critical point, and return the last."""
        branch = contact_branch.follow(at, self.options, lambda _: [LIMIT], end=end)
        next(branch)
        for item in branch:
            if isinstance(item, BranchPoint):
                at = item
                self.add(at)
                continue
            before, after, problem = item.before.point, item.after.point, item.before.problem
            if item.event is UNHELD:
                self.critical, self.unheld = _at_change(before, after), item.after.problem.on_mesh(after)
            else:
                found = critical.locate(problem, before, after, LAMBDA_TOLERANCE, self.options)
                if found.lam < end:
                    self.critical, before = found, found.before
                else:
                    before = continuation.step_to(problem, before, end, self.options)
            if before is not at.point:
                at = BranchPoint(problem, before)
                self.add(at)
            break
        return at


def _at_change(before: Point, after: Point) -> CriticalPoint:
    """The critical point at a change of the contact, between the states on either side."""
    return CriticalPoint(
        before.lam, before.lam, after.lam, before.lam, agree=False, before=before, after=after, mode=after.mode,
        evaluations=0,
    )  # fmt: skip

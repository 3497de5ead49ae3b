"""A strip whose gripper follows a path: statics along it, from the flat strip to its end or a critical point.

All in units of L*; lambda is the length travelled.  Corners of the path are states of their own: the branch is
followed to the corner, and from there with the direction of the next piece.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stripfold.analysis import planning
from stripfold.analysis.advance import LAMBDA_TOLERANCE, LIMIT, follow_to_event
from stripfold.analysis.contact import touch, touches
from stripfold.analysis.static import ROBUST_NEWTON
from stripfold.errors import CoarseMeshError, NewtonError, SolveError
from stripfold.models.model import Model
from stripfold.paths.curve import GripperPath
from stripfold.problem import AlongPiece, StripProblem
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions, step_to
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.events import Event
from stripfold.solve.problem import Point

SIZES = planning.Sizes(free=0.15, lying=0.15, grasp=0.05)
"""The lift-off sweeps the whole strip, and what is laid down rolls over it: no part may be coarse."""
STEPS = StepOptions(first=0.05, largest=0.5, slow_below=0.4, target_iterations=10, max_attempts=600)
ROBUST_STEPS = replace(STEPS, newton=ROBUST_NEWTON)
FIRST_HEIGHT = 0.01
"""Length travelled at the first state, L*: nearer to the flat strip every contact would be about to change."""
NEAR_ZERO = 0.2
"""Eigenvalue, g/L*, below which a critical point is the strip's own whatever came before."""
NEXT = 1e-4
"""How far behind a critical point of the strip's own, as it is located, its least eigenvalue may go to zero, L*.

Before a fold the square of that eigenvalue falls linearly to zero. Where it would do so farther away, or does not fall
at all, a single contact of the mesh has opened (docs/method.md)."""
LARGEST_LOCAL_SNAP = 0.3
"""Largest way by which the strip may pop when that happens, L*, and go on from there."""
LARGEST_SPURIOUS_MOVE = 0.05
"""Largest way by which a place of the strip goes through a tooth of the contact, L*: one that is longer may be the
strip's own small snap, and whether it is passed hangs on the mesh."""
NEARLY = 10.0
"""Eigenvalue, g/L*, to which the least one must not dip while the strip is all but flat: on another mesh such a strip
snaps, since the ripple that decides is no longer than a few elements."""
DIP = 2.0
"""How many times larger it is again behind a dip: a long strip that rises passes a shallow minimum as low."""
ALL_BUT_FLAT = 0.7
"""Height of the highest place of such a strip, L*: higher up a sound path may well pass a minimum of that depth."""
BEYOND = (0.01, 0.03, 0.1)
"""How far behind such a point the strip is looked for, L*."""


@dataclass(frozen=True)
class StaticSegment:
    """Statics along a part of a path.

    Attributes
    ----------
    points
        Accepted points, in order; at a corner two, one for each direction.
    pieces
        For each point the index of its piece.
    critical
        What ended it: the critical point, or None at the end of the path.
    contact_folds
        Maxima of lambda that were the mesh's own (docs/method.md), passed: one contact held the strip back.
    """

    model: Model
    path: GripperPath
    points: tuple[Point, ...]
    pieces: tuple[int, ...]
    critical: CriticalPoint | None
    contact_folds: int

    def problem(self, i: int) -> StripProblem:
        """What the point ``i`` solves."""
        return problem_on(self.model, self.path, self.pieces[i])


def problem_on(model: Model, path: GripperPath, piece: int) -> StripProblem:
    """The strip with its gripper on one piece of a path."""
    return StripProblem(model, AlongPiece(path.pieces[piece], model.length))


def from_flat(model: Model, path: GripperPath) -> Point:
    """The first state of a path, its gripper just lifted."""
    problem = problem_on(model, path, 0)
    travelled = min(FIRST_HEIGHT, path.pieces[0].end / 4.0)
    return continuation.start(problem, np.zeros(model.size), travelled, problem.bounded, 1.0, ROBUST_STEPS)


def follow(
    model: Model,
    path: GripperPath,
    first: Point | None = None,
    piece: int = 0,
    options: StepOptions = STEPS,
    max_spurious_move: float = LARGEST_SPURIOUS_MOVE,
) -> StaticSegment:
    """Follow a path from the flat strip, or from a state on one of its pieces.

    Raises
    ------
    SolveError
        When a state or the branch cannot be computed.
    """
    point = first or from_flat(model, path)
    points, pieces, folds = [point], [piece], 0
    for i in range(piece, len(path.pieces)):
        problem = problem_on(model, path, i)
        while points[-1].lam < path.pieces[i].end:
            points_on_piece, found, contact_folds = _along_piece(
                problem, points[-1], path.pieces[i].end, options, max_spurious_move
            )
            snapped = _local_snap(problem, found, points_on_piece) if found is not None else None
            points_on_piece += [snapped] if snapped is not None else []
            points += points_on_piece[1:]
            pieces += [i] * (len(points_on_piece) - 1)
            folds += contact_folds + (snapped is not None)
            if found is not None and snapped is None:
                return StaticSegment(model, path, tuple(points), tuple(pieces), found, folds)
        if i + 1 < len(path.pieces):
            onward = problem_on(model, path, i + 1)
            corner = points[-1].state
            point = continuation.start(onward, corner.q, path.pieces[i + 1].start, corner.active, 1.0, STEPS)
            points.append(point)
            pieces.append(i + 1)
            if point.negatives:
                raise SolveError("the strip is not stable at a corner of the path", parameter=point.lam)
    return StaticSegment(model, path, tuple(points), tuple(pieces), None, folds)


def _local_snap(problem: StripProblem, found: CriticalPoint, points_on_piece: list[Point]) -> Point | None:
    """The state just behind a place where one contact opened and the strip snapped; None at other critical points.

    Raises
    ------
    CoarseMeshError
        It snapped far: that is not the strip's doing.
    """
    before = found.before
    if before.eigenvalues[0] < NEAR_ZERO or _to_zero(before, points_on_piece) < NEXT:
        return None
    for beyond in BEYOND:
        try:
            point = continuation.start(problem, before.q, before.lam + beyond, before.active, 1.0, ROBUST_STEPS)
        except NewtonError:
            continue
        if problem.model.largest_move(before.q, point.q) < LARGEST_LOCAL_SNAP and not critical.is_past(point):
            return point
    if touches(problem.model, before):
        # The part that touched comes off: what it held is let go at once, on any mesh.
        return None
    raise CoarseMeshError(
        f"one contact's opening lets the strip go at lambda = {before.lam:.6g}",
        parameter=before.lam,
        advice="refine the mesh",
    )


def _to_zero(point: Point, points_on_piece: list[Point]) -> float:
    """How much farther on the least eigenvalue of a state near a fold is zero, by the points before it; in lambda."""
    earlier = [p for p in points_on_piece if p.lam < point.lam - LAMBDA_TOLERANCE]
    now = float(point.eigenvalues[0]) ** 2
    fallen = float(earlier[-1].eigenvalues[0]) ** 2 - now if earlier else 0.0
    return now / fallen * (point.lam - earlier[-1].lam) if fallen > 0.0 else np.inf


def _along_piece(
    problem: StripProblem, first: Point, end: float, options: StepOptions, max_spurious_move: float
) -> tuple[list[Point], CriticalPoint | None, int]:
    """Points up to ``end`` or a critical point, which is returned too, and the number of spurious limit points."""
    model = problem.model

    def check_dip(points: list[Point]) -> None:
        if (least := _near_critical_dip(model, points)) is not None:
            raise CoarseMeshError(
                f"the strip nearly snaps at lambda = {least.lam:.6g}: the mesh decides whether it does",
                parameter=least.lam,
                advice="refine the mesh",
            )

    def check_move(before: Point, after: Point) -> None:
        if model.largest_move(before.q, after.q) > max_spurious_move:
            raise CoarseMeshError(
                f"the strip snaps locally at lambda = {before.lam:.6g}: the mesh decides whether it goes",
                parameter=before.lam,
                advice="refine the mesh",
            )

    found = follow_to_event(
        problem,
        first,
        (LIMIT, Event("end of the piece", lambda point, _: point.lam >= end, located=False)),
        options,
        # The floor under the sag stops the fall: no spurious limit point, however soon lambda rises again.
        confirm=(touch(model, located=False),),
        watch=check_dip,
        on_spurious=check_move,
    )
    points, at = list(found.points), found.critical
    if at is not None and at.lam < end:
        return points[: points.index(at.before) + 1], at, found.spurious
    # A critical point behind the end of the piece is not on the path.
    kept = points[: points.index(found.end.before) + 1]
    return [*kept, step_to(problem, kept[-1], end, options)], None, found.spurious


def _near_critical_dip(model: Model, points: list[Point]) -> Point | None:
    """Where a strip, all but flat, was nearest to losing its hold, if it came near that and recovered."""
    least = min(points, key=lambda point: float(point.eigenvalues[0]))
    value, now = float(least.eigenvalues[0]), points[-1]
    recovered = value < NEARLY and float(now.eigenvalues[0]) > DIP * value
    return least if recovered and model.mid_surface(now.q)[:, 1].max() < ALL_BUT_FLAT else None

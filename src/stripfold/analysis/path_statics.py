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
from stripfold.analysis.nodal import ROBUST_NEWTON
from stripfold.errors import CoarseMeshError, NewtonError, SolveError
from stripfold.models.model import Model
from stripfold.paths.curve import GripperPath
from stripfold.problem import AlongPiece, StripProblem
from stripfold.solve import continuation, critical
from stripfold.solve.continuation import StepOptions, step_to
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.events import Event, never
from stripfold.solve.problem import Point

SIZES = planning.Sizes(free=0.15, lying=0.15, grasp=0.05)
"""The lift-off point sweeps the whole strip, and the fold rolls over it: no part may be coarse."""
STEPS = StepOptions(first=0.05, largest=0.5, slow_below=0.4, target_iterations=10, max_attempts=600)
ROBUST_STEPS = replace(STEPS, newton=ROBUST_NEWTON)
FIRST_HEIGHT = 0.01
"""Length travelled at the first state, L*: closer to the flat strip every contact is about to change."""
NEAR_ZERO = 0.2
"""Eigenvalue, g/L*, below which a critical point is never spurious."""
NEXT = 1e-4
"""Largest distance from a located critical point to the extrapolated zero of its smallest eigenvalue, L*.

Before a fold the square of that eigenvalue falls linearly to zero.  If the extrapolated zero is farther away, a single
contact of the mesh has opened: a spurious limit point (docs/method.md)."""
LARGEST_LOCAL_SNAP = 0.3
"""Largest displacement of the strip in a local snap, L*, from which it is followed on."""
LARGEST_SPURIOUS_MOVE = 0.05
"""Largest displacement of the strip at a spurious limit point, L*: a larger one may be a real, small
snap."""
NEAR_CRITICAL = 10.0
"""Eigenvalue, g/L*, that marks a near-critical dip of a nearly flat strip: on another mesh it snaps, since the critical
mode is no longer than a few elements."""
DIP = 2.0
"""Factor by which the eigenvalue rises again after a dip: a long strip passes shallow minima as low."""
NEARLY_FLAT = 0.7
"""Largest height of a nearly flat strip, L*."""
BEYOND = (0.01, 0.03, 0.1)
"""Distances past a spurious limit point at which an equilibrium is searched for, L*."""


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
        The critical point that ends it, or None at the end of the path.
    spurious_limit_points
        Number of those passed (docs/method.md).
    """

    model: Model
    path: GripperPath
    points: tuple[Point, ...]
    pieces: tuple[int, ...]
    critical: CriticalPoint | None
    spurious_limit_points: int

    def problem(self, i: int) -> StripProblem:
        """The problem of the point ``i``."""
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
    points, pieces, spurious = [point], [piece], 0
    for i in range(piece, len(path.pieces)):
        problem = problem_on(model, path, i)
        while points[-1].lam < path.pieces[i].end:
            points_on_piece, found, spurious_limit_points = _along_piece(
                problem, points[-1], path.pieces[i].end, options, max_spurious_move
            )
            snapped = _local_snap(problem, found, points_on_piece) if found is not None else None
            points_on_piece += [snapped] if snapped is not None else []
            points += points_on_piece[1:]
            pieces += [i] * (len(points_on_piece) - 1)
            spurious += spurious_limit_points + (snapped is not None)
            if found is not None and snapped is None:
                return StaticSegment(model, path, tuple(points), tuple(pieces), found, spurious)
        if i + 1 < len(path.pieces):
            onward = problem_on(model, path, i + 1)
            corner = points[-1].state
            point = continuation.start(onward, corner.q, path.pieces[i + 1].start, corner.active, 1.0, STEPS)
            points.append(point)
            pieces.append(i + 1)
            if point.negatives:
                raise SolveError("the strip is not stable at a corner of the path", parameter=point.lam)
    return StaticSegment(model, path, tuple(points), tuple(pieces), None, spurious)


def _local_snap(problem: StripProblem, found: CriticalPoint, points_on_piece: list[Point]) -> Point | None:
    """The state past a spurious critical point, where one contact opened; None at other critical points.

    Raises
    ------
    CoarseMeshError
        The strip moves too far: the mesh is too coarse.
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
        # The upper layer lifts off the lower one and is released at once, on any mesh.
        return None
    raise CoarseMeshError(
        f"the strip is released by one contact that opens at lambda = {before.lam:.6g}",
        parameter=before.lam,
        advice="refine the mesh",
    )


def _to_zero(point: Point, points_on_piece: list[Point]) -> float:
    """Distance in lambda to the extrapolated zero of the smallest eigenvalue near a fold, from the points before."""
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
        (LIMIT, Event("end of the piece", lambda point, _: point.lam >= end, located=never)),
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
    """The point of smallest eigenvalue of a nearly flat strip, if it came near zero and has risen again."""
    least = min(points, key=lambda point: float(point.eigenvalues[0]))
    value, now = float(least.eigenvalues[0]), points[-1]
    recovered = value < NEAR_CRITICAL and float(now.eigenvalues[0]) > DIP * value
    return least if recovered and model.mid_surface(now.q)[:, 1].max() < NEARLY_FLAT else None

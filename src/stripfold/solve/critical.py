"""The critical point: the first maximum of lambda along a branch, solved for directly or between two accepted points.

A limit point found by :mod:`.limit_point` is checked by a state on either side; where there is none, as where a contact
opens, the point is bracketed.

Three detectors: the sign of the tangent's lambda component, the number of negative eigenvalues, and the smallest
eigenvalue.  While the contact set stays the same they change together; :attr:`CriticalPoint.agree` says whether they
do.  A failure of Newton's method is never a detector.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.solve import continuation, limit_point, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.events import Crossing, Event
from stripfold.solve.limit_point import LimitPoint
from stripfold.solve.newton import Constraint
from stripfold.solve.problem import Point, Problem, Tangent, inner

NEAR = 0.05
"""Arc length from the maximum within which the smallest eigenvalue is zero: with contact coordinates the two differ by
the discretisation."""

FARTHEST = 0.01
"""Largest arc length from a limit point to the states that check it."""
SHARE, SLOPE = 0.3, 0.1
"""Of the square root of the bracket's width: distance of those states times that of the curvature, and slope of lambda
to which the limit point is solved."""


@dataclass(frozen=True)
class CriticalPoint:
    """A located critical point.

    Attributes
    ----------
    lam
        lambda_c: of the limit point, or of the higher end of a bracket; at a bifurcation, where lambda rises on, of the
        eigenvalue's zero.
    lower, upper
        Bracket of the maximum: the largest value of a computed point, and what the slopes of both ends allow beyond it.
    eigenvalue_lam
        lambda where the smallest eigenvalue, extrapolated linearly along the branch, is zero.
    agree
        Whether all detectors change sign between the two ends, the eigenvalue at most :data:`NEAR` from there.
    before, after
        Last stable and first unstable point.
    mode
        Critical eigenvector, shape (n,), unit mass norm.
    evaluations
        Points computed to narrow the bracket; 0 for a limit point that was solved for directly.
    """

    lam: float
    lower: float
    upper: float
    eigenvalue_lam: float
    agree: bool
    before: Point
    after: Point
    mode: Array
    evaluations: int

    @property
    def width(self) -> float:
        """Width of the bracket."""
        return self.upper - self.lower


def is_past(point: Point, before: Point | None = None) -> bool:
    """Whether a point lies past the critical point: by tangent, by inertia, or because lambda is below ``before``.

    The last detects a maximum and a minimum within one step.
    """
    return point.tangent.lam <= 0.0 or point.negatives > 0 or (before is not None and point.lam < before.lam)


def critical_point(tolerance: float) -> Event:
    """The event, located until the bracket of lambda_c is narrower than ``tolerance``."""

    def width(before: Point, after: Point) -> float:
        lower, upper = _bracket(before, after)
        return upper - lower

    def directly(problem: Problem, before: Point, after: Point, options: StepOptions) -> tuple[Point, Point]:
        found = _between(problem, before, after, tolerance, options)
        return found.before, found.after

    return Event("critical point", is_past, tolerance, width, _next_share, directly=directly)


def checked(
    problem: Problem, limit: LimitPoint, tolerance: float, options: StepOptions, arc: float = 0.0
) -> CriticalPoint:
    """A limit point as the critical point, by a state on either side: lambda has its first maximum between them.

    They are so near that the bracket of lambda_c is narrower than ``tolerance``.  ``arc`` is the limit point's place on
    the branch.

    Raises SolveError: it is no maximum, or not of a stable branch.
    """
    lam, bend = limit.state.lam, limit.bend.lam
    if bend >= 0.0:
        raise SolveError("lambda has no maximum at the limit point", parameter=lam)
    distance = min(SHARE * sqrt(tolerance / -bend), FARTHEST)
    before, after = (_beside(problem, limit, ds, options, arc) for ds in (-distance, distance))
    if is_past(before) or not is_past(after) or lam < max(before.lam, after.lam):
        raise SolveError("the branch does not lose its stability at the limit point", parameter=lam)
    found = _of_bracket(before, after)
    return replace(found, lam=lam, lower=lam, upper=max(lam, found.upper))


def _beside(problem: Problem, limit: LimitPoint, ds: float, options: StepOptions, arc: float) -> Point:
    """The point at a small arc length from a limit point."""
    q, lam = limit.beside(ds)
    plane = Constraint(problem.metric * limit.tangent.q, limit.tangent.lam, q, lam)
    state = newton.solve(problem, q, lam, limit.state.active, plane, options.newton)
    if not np.array_equal(state.active, limit.state.active):
        raise SolveError("a contact changes at the limit point", parameter=lam)
    return continuation.evaluate(problem, state, limit.tangent, arc + ds)


def near(problem: Problem, point: Point, tolerance: float, options: StepOptions) -> CriticalPoint:
    """The critical point near a point of the branch, solved for directly.

    Raises SolveError: there is none near.
    """
    q, lam = point.q, point.lam
    slope = SLOPE * sqrt(tolerance)
    limit = limit_point.solve(problem, q, lam, point.tangent, point.active, options.newton, tolerance=slope)
    arc = point.arc + inner(problem.metric, point.tangent, Tangent(limit.state.q - q, limit.state.lam - lam))
    return checked(problem, limit, tolerance, options, arc)


def _between(problem: Problem, before: Point, after: Point, tolerance: float, options: StepOptions) -> CriticalPoint:
    """The limit point between two points, by :func:`near`."""
    if after.tangent.lam > 0.0 or not np.array_equal(before.active, after.active):
        raise SolveError("no limit point of a smooth branch", parameter=before.lam)
    found = near(problem, min(before, after, key=lambda p: abs(p.tangent.lam)), tolerance, options)
    if found.before.arc < before.arc or found.after.arc > after.arc:
        raise SolveError("the limit point found is another one", parameter=found.lam)
    return found


def locate(
    problem: Problem, before: Point, after: Point, tolerance: float, options: StepOptions, max_evaluations: int = 60
) -> CriticalPoint:
    """Locate the critical point between a stable point and one that :func:`is_past` it, lambda_c to ``tolerance``.

    Raises SolveError: it is not between the points, or the bracket cannot be made that narrow.
    """
    if is_past(before) or not is_past(after, before):
        raise SolveError("the critical point is not between the two points given")
    event = replace(critical_point(tolerance), directly=None)
    if event.width(before, after) > tolerance:
        with suppress(SolveError):
            return _between(problem, before, after, tolerance, options)
    found = continuation.locate(problem, Crossing(event, before, after), options, max_evaluations)
    return _of_bracket(found.before, found.after, found.evaluations)


def _of_bracket(before: Point, after: Point, evaluations: int = 0) -> CriticalPoint:
    """The critical point in a bracket."""
    lower, upper = _bracket(before, after)
    zero, eigenvalue_lam = _eigenvalue_zero(before, after)
    nearer = min(before, after, key=lambda p: abs(p.eigenvalues[0]))
    return CriticalPoint(
        lam=lower if after.tangent.lam <= 0.0 else eigenvalue_lam,
        lower=lower,
        upper=upper,
        eigenvalue_lam=eigenvalue_lam,
        agree=bool(after.tangent.lam <= 0.0 and after.negatives > 0 and abs(zero) <= NEAR),
        before=before,
        after=after,
        mode=nearer.mode,
        evaluations=evaluations,
    )


def _bracket(before: Point, after: Point) -> tuple[float, float]:
    """Bounds of the maximum of lambda between two points, from their values and slopes.

    The steeper slope bounds the rise between them.  No concavity is assumed: the slope jumps where a contact changes.
    """
    if after.tangent.lam > 0.0 and after.lam >= before.lam:
        # Only the inertia has changed: at a bifurcation lambda goes on rising.
        return before.lam, after.lam
    lower = max(before.lam, after.lam)
    steepest = max(abs(before.tangent.lam), abs(after.tangent.lam))
    return lower, lower + steepest * (after.arc - before.arc)


def _eigenvalue_zero(before: Point, after: Point) -> tuple[float, float]:
    """Arc length from the nearer end of a bracket to the zero of the smallest eigenvalue, and lambda there.

    Between the ends the arc length is zero; outside, eigenvalue and slope of lambda are extrapolated linearly.
    """
    a, b, width = float(before.eigenvalues[0]), float(after.eigenvalues[0]), after.arc - before.arc
    if a > 0.0 > b:
        return 0.0, before.lam + _zero(a, b) * (after.lam - before.lam)
    if width <= 0.0 or a <= b:
        return inf, before.lam
    zero = a / (a - b) * width
    bend = (after.tangent.lam - before.tangent.lam) / width
    return (zero - width if zero > 0.0 else zero), before.lam + (before.tangent.lam + 0.5 * bend * zero) * zero


def _zero(a: float, b: float) -> float:
    """Where between 0 and 1 a straight line from ``a`` > 0 to ``b`` crosses zero."""
    return 0.5 if a <= b else min(max(a / (a - b), 0.0), 1.0)


def _next_share(before: Point, after: Point, evaluation: int) -> float:
    """Next to the zero of the interpolated slope, on either side in turn, so that both ends close in.

    Every third evaluation bisects, which converges where the slope jumps.
    """
    if evaluation % 3 == 0 or after.tangent.lam > 0.0:
        return 0.5
    guess = _zero(before.tangent.lam, after.tangent.lam)
    return min(max(guess + (0.02 if evaluation % 2 else -0.02), 0.02), 0.98)

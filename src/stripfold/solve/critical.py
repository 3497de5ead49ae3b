"""Locating the critical point: the first maximum of lambda along a branch, between two accepted points.

Three detectors: the sign of the tangent's lambda component, the number of negative eigenvalues, and the smallest
eigenvalue.  While the contact set stays the same they change together; :attr:`CriticalPoint.agree` says whether they
do.  A failure of Newton's method is never a detector.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.solve import continuation
from stripfold.solve.continuation import StepOptions
from stripfold.solve.events import Crossing, Event
from stripfold.solve.problem import Point, Problem

NEAR = 0.05
"""Arc length from the maximum within which the smallest eigenvalue is zero: with contact coordinates the two differ by
the discretisation."""


@dataclass(frozen=True)
class CriticalPoint:
    """A located critical point.

    Attributes
    ----------
    lam
        lambda_c: the largest value reached by a computed point; at a bifurcation, where lambda rises on, that at which
        the eigenvalue is zero.
    lower, upper
        Bracket of the maximum: the larger value of both ends, and what their slopes allow beyond it.
    eigenvalue_lam
        lambda where the smallest eigenvalue, extrapolated linearly along the branch, is zero.
    agree
        Whether all detectors change sign between the two ends, the eigenvalue at most :data:`NEAR` from there.
    before, after
        Last stable and first unstable point.
    mode
        Critical eigenvector, shape (n,), unit mass norm.
    evaluations
        Points computed to locate it.
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

    return Event("critical point", is_past, tolerance, width, _next_share)


def locate(
    problem: Problem, before: Point, after: Point, tolerance: float, options: StepOptions, max_evaluations: int = 60
) -> CriticalPoint:
    """Locate the critical point between a stable point and one that :func:`is_past` it, lambda_c to ``tolerance``.

    Raises
    ------
    SolveError
        It is not between the points, or the bracket cannot be made that narrow.
    """
    if is_past(before) or not is_past(after, before):
        raise SolveError("the critical point is not between the two points given")
    found = continuation.locate(problem, Crossing(critical_point(tolerance), before, after), options, max_evaluations)
    before, after = found.before, found.after
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
        evaluations=found.evaluations,
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

"""Locating the critical point: the first maximum of lambda along a branch, between two accepted points.

Three detectors look at it: the sign of the tangent's lambda component, the number of negative eigenvalues, and the
smallest eigenvalue.  On a branch whose contact set does not change they vanish together; where they do not agree the
record says so.  A failure of Newton is never one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

from stripfold.arrays import Array
from stripfold.errors import CoarseMeshError, NewtonError, SolveError
from stripfold.solve.continuation import CONTACT_CHANGE_RANGE, StepOptions, step, turn
from stripfold.solve.problem import Point, Problem


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
        lambda where the smallest eigenvalue, interpolated, is zero.
    agree
        Whether all detectors change sign between the two ends.
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
    """Whether a point lies past the critical point: by tangent, by inertia, or as lambda has fallen since ``before``.

    The last sees what the others miss: a maximum and a minimum in one step.
    """
    return point.tangent.lam <= 0.0 or point.negatives > 0 or (before is not None and point.lam < before.lam)


def locate(
    problem: Problem, before: Point, after: Point, tolerance: float, options: StepOptions, most: int = 60
) -> CriticalPoint:
    """Shrink the bracket between a stable and a :func:`is_past` point until it is narrower than ``tolerance``.

    Raises
    ------
    SolveError
        When the bracket cannot be made that narrow.
    """
    if is_past(before) or not is_past(after, before):
        raise SolveError("the critical point is not between the two points given")
    evaluations = 0
    while True:
        lower, upper = _bracket(before, after)
        if upper - lower <= tolerance:
            break
        if evaluations == most:
            raise CoarseMeshError(
                f"the critical point was only bracketed to {upper - lower:.1e}",
                parameter=lower,
                advice="refine the mesh",
            )
        evaluations += 1
        ds = _next_share(before, after, evaluations) * (after.arc - before.arc)
        middle = _between(problem, before, ds, options)
        if is_past(middle, before):
            after = middle
        else:
            before = middle
    zero = _share(before.eigenvalues[0], after.eigenvalues[0])
    agree = after.tangent.lam <= 0.0 and after.negatives > 0 and before.eigenvalues[0] > 0.0 > after.eigenvalues[0]
    nearer = min(before, after, key=lambda p: abs(p.eigenvalues[0]))
    return CriticalPoint(
        lam=lower if after.tangent.lam <= 0.0 else before.lam + zero * (after.lam - before.lam),
        lower=lower,
        upper=upper,
        eigenvalue_lam=before.lam + zero * (after.lam - before.lam),
        agree=bool(agree),
        before=before,
        after=after,
        mode=nearer.mode,
        evaluations=evaluations,
    )


def _between(problem: Problem, before: Point, ds: float, options: StepOptions) -> Point:
    """A point up to ``ds`` ahead of ``before``; the nearer, the shorter the way on which the branch has no kink."""
    while True:
        try:
            return step(problem, before, ds, options)
        except NewtonError as error:
            ds /= 4.0
            if ds >= options.smallest:
                continue
            # Nothing lies ahead: a contact opens here and the branch turns back.
            turned = turn(problem, before, CONTACT_CHANGE_RANGE)
            if turned is not None and is_past(turned):
                return turned
            raise SolveError(
                f"a point between the bracket's ends was not found: {error}", parameter=before.lam
            ) from error


def _bracket(before: Point, after: Point) -> tuple[float, float]:
    """Bounds of the maximum between two points, from their values and slopes.

    The steeper of both ends bounds what can be gained between them.  No concavity is assumed: where the contact set
    changes, the slope jumps.
    """
    if after.tangent.lam > 0.0 and after.lam >= before.lam:
        # Only the inertia has changed, a bifurcation: lambda goes on rising through it.
        return before.lam, after.lam
    lower = max(before.lam, after.lam)
    steepest = max(abs(before.tangent.lam), abs(after.tangent.lam))
    return lower, lower + steepest * (after.arc - before.arc)


def _share(a: float, b: float) -> float:
    """Where between 0 and 1 a straight line from ``a`` > 0 to ``b`` crosses zero."""
    return 0.5 if a <= b else min(max(a / (a - b), 0.0), 1.0)


def _next_share(before: Point, after: Point, evaluation: int) -> float:
    """Where to look next: just beside the place where the slope should vanish, on either side in turn.

    Both ends have to close in.  Every third time the middle is taken, which keeps the pace where the slope jumps.
    """
    if evaluation % 3 == 0 or after.tangent.lam > 0.0:
        return 0.5
    guess = _share(before.tangent.lam, after.tangent.lam)
    return min(max(guess + (0.02 if evaluation % 2 else -0.02), 0.02), 0.98)

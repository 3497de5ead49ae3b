"""Limit points of lambda, and the critical point: the first maximum of lambda along a branch.

It is solved for directly (:func:`limit_point`) and checked by a state on either side; where that fails, as where an
element begins to slide, it is bracketed.  Three detectors: the sign of the tangent's lambda component, the number of
negative eigenvalues, and the smallest eigenvalue.  While the contact set stays the same they change together;
:attr:`CriticalPoint.agree` says whether they do.  A failure of Newton's method is never a detector.
"""

from __future__ import annotations

import logging
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import inf, sqrt
from typing import Any

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import NewtonError, SolveError
from stripfold.solve import continuation, newton
from stripfold.solve.continuation import MAX_EVALUATIONS, Crossing, Event, StepOptions
from stripfold.solve.newton import Constraint, Linearised, NewtonOptions
from stripfold.solve.problem import Equilibrium, Point, Problem, Tangent, inner

logger = logging.getLogger(__name__)
DIFFERENCE = 5e-5
"""Arc length of the second differences."""
SLOPE_TOLERANCE = 1e-4
"""Largest slope of lambda at a limit point; lambda is then wrong by its square."""
LAST_CORRECTION = 1e-6
"""Largest correction that a limit point may still need, in the problem's lengths: where rounding limits the forces of a
thin strip, its bending may be out of balance by less."""
NEAR_BALANCE = 0.1
"""Unbalanced force of a state below which the iteration for a limit point moves along the branch."""
NEAR_MAXIMUM = 0.05
"""Arc length from the maximum within which the smallest eigenvalue is zero: with contact coordinates the two differ by
the discretisation."""
FARTHEST = 0.01
"""Largest arc length from a limit point to the states that check it."""
SHARE, SLOPE = 0.3, 0.1
"""For a bracket of lambda_c of some width the states that check a limit point are ``SHARE sqrt(width / |lambda''|)``
away, and it is solved to a slope of lambda of ``SLOPE sqrt(width)``."""


@dataclass(frozen=True, eq=False)
class LimitPoint:
    """A limit point of lambda.

    ``state``: the equilibrium; its residuals are the history of the largest unbalanced force.  ``tangent``: unit
    tangent.  ``bend``: second derivatives by the arc length; that of lambda is negative at a maximum.  ``slopes``:
    history of the slope of lambda, by the arc length in the direction given.
    """

    state: Equilibrium
    tangent: Tangent
    bend: Tangent
    slopes: tuple[float, ...]

    def beside(self, ds: float) -> tuple[Array, float]:
        """Unknowns and lambda on the parabola of the branch at this arc length from here."""
        return _on_parabola(self.state.q, self.state.lam, self.tangent, self.bend, ds)


def limit_point(
    problem: Problem,
    q: Array,
    lam: float,
    towards: Tangent,
    active: Index,
    options: NewtonOptions | None = None,
    predicted_stress: Any = None,
    tolerance: float = SLOPE_TOLERANCE,
) -> LimitPoint:
    """Find the limit point near a state, which need not be an equilibrium; the active unknowns stay active.

    With the equations F(y, lambda) = 0 of the unknowns that are not held and a direction c near the branch's, the
    tangent T = (y', lambda') solves ``[F_y, F_lambda; c] T = [0; 1]``, which is regular at a limit point: the minimally
    augmented system with F_lambda as its bordering column.  The same matrix with ``[-F''TT; 0]`` on the right gives the
    second derivatives; F''TT is a difference of three residuals.  An iteration corrects the state in the plane normal
    to c and moves it along the parabola of the branch to where lambda' = 0.
    Source: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM, 2000), chapters 3 and 4.

    ``problem``: what to solve.  ``q``, ``lam``, ``active``: the state: unknowns of shape (n,), control parameter, and
    the bounded unknowns on their bounds.  ``towards``: direction of the branch, roughly.  ``options``: Newton's
    tolerances and limits.  ``predicted_stress``: of the state, if its own is not good: see :meth:`.Problem.linearise`.
    ``tolerance``: largest slope of lambda.  Raises NewtonError: with the history of the residuals, when it does not
    converge.
    """
    options = options or NewtonOptions()
    along = towards
    history: list[float] = []
    slopes: list[float] = []
    try:
        for _ in range(options.max_iterations):
            at = Linearised(problem, q, lam, active, predicted_stress)
            history.append(at.unbalanced)
            if not np.isfinite(at.unbalanced):
                raise SolveError("Newton's method met a value that is not finite")
            # Far from equilibrium the plane normal to the branch is the nearest; near it a fixed one.
            along = towards if at.unbalanced <= NEAR_BALANCE else at.tangent(problem.metric, along)
            row = problem.metric * along.q
            bordered = partial(at.bordered, row, along.lam)
            tangent = Tangent(*bordered(np.zeros(problem.size), 1.0))
            slopes.append(tangent.lam)
            dq, dlam = bordered(at.imbalance, -float(row @ at.gap))
            dq = dq + at.gap
            size = problem.largest_change(q, dq)
            damping = min(1.0, options.largest_step / size) if size > 0.0 else 1.0
            bend, ds = Tangent(np.zeros_like(q), 0.0), 0.0
            if at.unbalanced <= NEAR_BALANCE:
                bend = Tangent(*bordered(-at.free(_second_derivative(problem, q, lam, tangent)), 0.0))
                if abs(tangent.lam) <= tolerance and size <= LAST_CORRECTION and at.is_balanced(options):
                    said = "limit point at lambda = %.9g L*, %d unknowns, %d iterations"
                    logger.debug(said, lam, problem.size, len(history) - 1)
                    square = inner(problem.metric, tangent, tangent)
                    unit = Tangent(tangent.q / sqrt(square), tangent.lam / sqrt(square))
                    state = Equilibrium(q, lam, active, tuple(history), at.force)
                    return LimitPoint(state, unit, Tangent(bend.q / square, bend.lam / square), tuple(slopes))
                if bend.lam == 0.0:
                    raise SolveError("the slope of lambda does not change along the branch")
                ds = -tangent.lam / bend.lam
                ds *= options.largest_step / max(problem.largest_change(q, ds * tangent.q), options.largest_step)
            # Predicted along the tangent: what the parabola adds bends the strip without stretching it.
            predicted_stress = problem.stepped(q, damping * dq + ds * tangent.q)[1]
            q, lam = _on_parabola(q + damping * dq, lam + damping * dlam, tangent, bend, ds)
    except SolveError as error:
        raise NewtonError(str(error), parameter=lam, residuals=history) from error
    raise NewtonError(
        f"no limit point of lambda in {options.max_iterations} iterations: largest unbalanced force {history[-1]:.1e}, "
        f"slope {slopes[-1]:.1e}",
        parameter=lam,
        residuals=history,
        advice="start nearer",
    )


def _second_derivative(problem: Problem, q: Array, lam: float, tangent: Tangent) -> Array:
    """Second derivative of the forces along the tangent."""
    ahead, here, behind = (
        problem.residual(q + ds * tangent.q, lam + ds * tangent.lam) for ds in (DIFFERENCE, 0.0, -DIFFERENCE)
    )
    return np.asarray((ahead - 2.0 * here + behind) / DIFFERENCE**2)


def _on_parabola(q: Array, lam: float, tangent: Tangent, bend: Tangent, ds: float) -> tuple[Array, float]:
    return q + ds * (tangent.q + 0.5 * ds * bend.q), lam + ds * (tangent.lam + 0.5 * ds * bend.lam)


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
        Whether all detectors change sign between the two ends, the eigenvalue at most :data:`NEAR_MAXIMUM` from there.
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

    @classmethod
    def of_bracket(cls, before: Point, after: Point, evaluations: int = 0) -> CriticalPoint:
        """The critical point between two points."""
        lower, upper = _maximum(before, after)
        zero, eigenvalue_lam = _eigenvalue_zero(before, after)
        turns = after.tangent.lam <= 0.0
        return cls(
            lam=lower if turns else eigenvalue_lam,
            lower=lower,
            upper=upper,
            eigenvalue_lam=eigenvalue_lam,
            agree=bool(turns and after.negatives > 0 and abs(zero) <= NEAR_MAXIMUM),
            before=before,
            after=after,
            mode=min(before, after, key=lambda p: abs(p.eigenvalues[0])).mode,
            evaluations=evaluations,
        )


def is_past(point: Point, before: Point | None = None) -> bool:
    """Whether a point lies past the critical point: by tangent, by inertia, or because lambda is below ``before``.

    The last detects a maximum and a minimum within one step.
    """
    return point.tangent.lam <= 0.0 or point.negatives > 0 or (before is not None and point.lam < before.lam)


LIMIT = Event("limit point", is_past, inf, lambda point: point.tangent.lam)
"""The event that a step passes the critical point, which :func:`locate` finds in it."""


def checked(
    problem: Problem, limit: LimitPoint, tolerance: float, options: StepOptions, arc: float = 0.0
) -> CriticalPoint:
    """Check by a state on either side that a limit point is critical: lambda has its first maximum between them.

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
    found = CriticalPoint.of_bracket(before, after)
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
    """Solve for the critical point near a point of the branch; raises SolveError where there is none."""
    q, lam = point.q, point.lam
    slope = SLOPE * sqrt(tolerance)
    limit = limit_point(problem, q, lam, point.tangent, point.active, options.newton, tolerance=slope)
    arc = point.arc + inner(problem.metric, point.tangent, Tangent(limit.state.q - q, limit.state.lam - lam))
    return checked(problem, limit, tolerance, options, arc)


def locate(
    problem: Problem,
    before: Point,
    after: Point,
    tolerance: float,
    options: StepOptions,
    max_evaluations: int = MAX_EVALUATIONS,
) -> CriticalPoint:
    """Locate the critical point between a stable point and one that :func:`is_past` it, lambda_c to ``tolerance``.

    Raises SolveError: it is not between the points, or the bracket cannot be made that narrow.
    """
    if is_past(before) or not is_past(after, before):
        raise SolveError("the critical point is not between the two points given")

    def width(before: Point, after: Point) -> float:
        lower, upper = _maximum(before, after)
        return upper - lower

    if width(before, after) > tolerance and after.tangent.lam <= 0.0 and np.array_equal(before.active, after.active):
        with suppress(SolveError):
            nearer = min(before, after, key=lambda p: abs(p.tangent.lam))
            found = near(problem, nearer, tolerance, options)
            if before.arc <= found.before.arc and found.after.arc <= after.arc:
                return found
    crossing = Crossing(replace(LIMIT, name="critical point", tolerance=tolerance), before, after)
    at = continuation.locate(problem, crossing, options, max_evaluations, width)
    return CriticalPoint.of_bracket(at.before, at.after, at.evaluations)


def _maximum(before: Point, after: Point) -> tuple[float, float]:
    """Bound the maximum of lambda between two points by their values and slopes.

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
        return 0.0, before.lam + a / (a - b) * (after.lam - before.lam)
    if width <= 0.0 or a <= b:
        return inf, before.lam
    zero = a / (a - b) * width
    bend = (after.tangent.lam - before.tangent.lam) / width
    return (zero - width if zero > 0.0 else zero), before.lam + (before.tangent.lam + 0.5 * bend * zero) * zero

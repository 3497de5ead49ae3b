"""Limit points solved for directly: Newton's method on the slope of lambda and the equilibrium together.

With the equations F(y, lambda) = 0 of the unknowns that are not held and a direction c near the branch's, the tangent
T = (y', lambda') solves ``[F_y, F_lambda; c] T = [0; 1]``, which is regular at a limit point: the minimally augmented
system with F_lambda as its bordering column.  The same matrix with ``[-F''TT; 0]`` on the right gives the second
derivatives; F''TT is a difference of three residuals.  An iteration corrects the state in the plane normal to c and
moves it along the parabola of the branch to where lambda' = 0.
Source: Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM, 2000), chapters 3 and 4.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import NewtonError, SolveError
from stripfold.solve.newton import Linearised, NewtonOptions
from stripfold.solve.problem import Equilibrium, Problem, Tangent, inner

logger = logging.getLogger(__name__)
DIFFERENCE = 5e-5
"""Arc length of the second differences."""
SLOPE_TOLERANCE = 1e-4
"""Largest slope of lambda at a limit point; lambda is then wrong by its square."""
NEAR = 0.1
"""Largest unbalanced force of a state from which the iteration moves along the branch."""


@dataclass(frozen=True, eq=False)
class LimitPoint:
    """A limit point of lambda.

    Attributes
    ----------
    state
        The equilibrium; its residuals are the history of the largest unbalanced force.
    tangent
        Unit tangent.
    bend
        Second derivatives by the arc length; that of lambda is negative at a maximum.
    slopes
        History of the slope of lambda, by the arc length in the direction given.
    """

    state: Equilibrium
    tangent: Tangent
    bend: Tangent
    slopes: tuple[float, ...]

    def beside(self, ds: float) -> tuple[Array, float]:
        """Unknowns and lambda on the parabola of the branch at this arc length from here."""
        return _moved(self.state.q, self.state.lam, self.tangent, self.bend, ds)


def solve(
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
            at = Linearised.at(problem, q, lam, active, predicted_stress)
            history.append(at.unbalanced)
            if not np.isfinite(at.unbalanced):
                raise SolveError("Newton's method met a value that is not finite")
            # Far from equilibrium the plane normal to the branch is the nearest; near it a fixed one.
            along = towards if at.unbalanced <= NEAR else at.tangent(problem.metric, along)
            row = problem.metric * along.q
            bordered = at.bordered(row, along.lam)
            tangent = Tangent(*bordered(np.zeros(problem.size), 1.0))
            slopes.append(tangent.lam)
            dq, dlam = bordered(at.imbalance, -float(row @ at.gap))
            dq = dq + at.gap
            size = problem.largest_change(q, dq)
            damping = min(1.0, options.largest_step / size) if size > 0.0 else 1.0
            bend, ds = Tangent(np.zeros_like(q), 0.0), 0.0
            if at.unbalanced <= NEAR:
                bend = Tangent(*bordered(-at.free(_second(problem, q, lam, tangent)), 0.0))
                if abs(tangent.lam) <= tolerance and at.is_balanced(options):
                    state = Equilibrium(q, lam, active, tuple(history), at.force)
                    done = len(history) - 1
                    logger.debug("limit point at lambda = %.9g L*, %d unknowns, %d iterations", lam, problem.size, done)
                    return _limit_point(state, tangent, bend, inner(problem.metric, tangent, tangent), slopes)
                if bend.lam == 0.0:
                    raise SolveError("the slope of lambda does not change along the branch")
                ds = -tangent.lam / bend.lam
                ds *= options.largest_step / max(problem.largest_change(q, ds * tangent.q), options.largest_step)
            # Predicted along the tangent: what the parabola adds bends the strip without stretching it.
            predicted_stress = problem.stepped(q, damping * dq + ds * tangent.q)[1]
            q, lam = _moved(q + damping * dq, lam + damping * dlam, tangent, bend, ds)
    except SolveError as error:
        raise NewtonError(str(error), parameter=lam, residuals=history) from error
    raise NewtonError(
        f"no limit point of lambda in {options.max_iterations} iterations: largest unbalanced force {history[-1]:.1e}, "
        f"slope {slopes[-1]:.1e}",
        parameter=lam,
        residuals=history,
        advice="start nearer",
    )


def _limit_point(state: Equilibrium, tangent: Tangent, bend: Tangent, square: float, slopes: list[float]) -> LimitPoint:
    """With derivatives by the arc length, given the square of the tangent's length."""
    length = sqrt(square)
    unit = Tangent(tangent.q / length, tangent.lam / length)
    return LimitPoint(state, unit, Tangent(bend.q / square, bend.lam / square), tuple(slopes))


def _second(problem: Problem, q: Array, lam: float, tangent: Tangent) -> Array:
    """Second derivative of the forces along the tangent."""
    ahead, here, behind = (
        problem.residual(q + step * tangent.q, lam + step * tangent.lam) for step in (DIFFERENCE, 0.0, -DIFFERENCE)
    )
    return np.asarray((ahead - 2.0 * here + behind) / DIFFERENCE**2)


def _moved(q: Array, lam: float, tangent: Tangent, bend: Tangent, ds: float) -> tuple[Array, float]:
    """The parabola of a branch."""
    return q + ds * (tangent.q + 0.5 * ds * bend.q), lam + ds * (tangent.lam + 0.5 * ds * bend.lam)

"""Newton's method for equilibria with bounds: a primal-dual active-set (semismooth) iteration.

Each iteration solves the linearised problem with the active unknowns held on their bounds, then releases those with a
tensile reaction and adds those that penetrate.  At convergence the bounds hold exactly, no reaction is tensile, and all
other forces are below the tolerance; a small update alone never counts as convergence.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import CrushedError, NewtonError, SolveError
from stripfold.solve.linear import Matrix, solve_bordered
from stripfold.solve.problem import Equilibrium, Problem, Tangent, inner

EPS = float(np.finfo(float).eps)
SETTLED = 1e-4
"""Change of an unknown by an iteration from which no stress is predicted: the next tangent is that of the state."""


@dataclass(frozen=True, slots=True)
class NewtonOptions:
    """Settings; forces and lengths in the problem's units."""

    force_tolerance: float = 1e-8
    """Largest unbalanced force of an equilibrium."""
    gap_tolerance: float = 1e-12
    """Largest violation of a bound at convergence."""
    largest_step: float = 0.3
    """Largest change of one unknown of positive metric per iteration, by damping."""
    max_iterations: int = 25
    max_distance: float = np.inf
    """Largest distance of the state from the guess, in any unknown of positive metric: beyond, it is another state."""


@dataclass(frozen=True)
class Constraint:
    """The equation that picks a point of the branch: ``row . (q - q0) + corner (lam - lam0) = 0``."""

    row: Array
    corner: float
    q0: Array
    lam0: float

    def defect(self, q: Array, lam: float) -> float:
        return float(self.row @ (q - self.q0)) + self.corner * (lam - self.lam0)


class Linearised:
    """The equations linearised at a state; prescribed unknowns move with lambda, active ones are held.

    ``force``, ``matrix``, ``load_rate``: of :meth:`.Problem.linearise`.  ``held``: prescribed and active unknowns.
    ``gap``: what the held unknowns are away from their values, shape (n,), zero elsewhere.  ``rate``: derivatives of
    the prescribed unknowns by lambda, shape (n,), zero elsewhere.
    """

    def __init__(self, problem: Problem, q: Array, lam: float, active: Index, predicted_stress: Any = None) -> None:
        self.q, prescribed = q, problem.prescribed
        self.force, self.matrix, self.load_rate = problem.linearise(q, lam, predicted_stress)
        self.held = np.concatenate([prescribed, active]) if len(active) else prescribed
        self.gap, self.rate = np.zeros(problem.size), np.zeros(problem.size)
        self.gap[prescribed] = problem.prescribed_values(lam) - q[prescribed]
        if len(active):
            self.gap[active] = problem.lower[np.isin(problem.bounded, active)] - q[active]
        self.rate[prescribed] = problem.prescribed_rates(lam)

    def free(self, forces: Array) -> Array:
        """Forces without those on held unknowns."""
        forces = forces.copy()
        forces[self.held] = 0.0
        return forces

    @cached_property
    def unbalanced(self) -> float:
        """Largest unbalanced force."""
        return float(np.abs(self.free(self.force)).max(initial=0.0))

    def is_balanced(self, options: NewtonOptions) -> bool:
        """Whether held unknowns are in place and all other forces within the tolerance or the unknowns' rounding."""
        if np.abs(self.gap).max(initial=0.0) > options.gap_tolerance:
            return False
        # The rounding of q limits the residual: in a thin strip far above any fixed tolerance, and far below any force
        # that moves the strip.
        worst, tolerance = self.unbalanced, options.force_tolerance
        if worst > tolerance and worst < 1.0:
            least = np.maximum(rounding(self.matrix, self.q), tolerance)
            return bool(np.all(np.abs(self.free(self.force)) <= least))
        return worst <= tolerance

    @cached_property
    def kept(self) -> Matrix:
        """The matrix of the unknowns that are not held."""
        return self.matrix.with_fixed(self.held)

    @property
    def imbalance(self) -> Array:
        """Minus the forces once the held unknowns are where they belong, zero on these."""
        return self.free(-(self.force + self.matrix @ self.gap if self.gap.any() else self.force))

    def corrected(self) -> Array:
        """Change of the unknowns at this lambda."""
        # With an equation of its own for lambda, so that it is refined: near a fold the tangent is nearly singular.
        none = np.zeros(len(self.gap))
        return solve_bordered(self.matrix, none, none, 1.0, self.imbalance, 0.0, self.held)[0] + self.gap

    def tangent(self, metric: Array, towards: Tangent) -> Tangent:
        """Unit tangent of the branch in the direction of ``towards``."""
        # Bordered with the direction of travel, the system stays regular at a limit point.
        q, lam = self.bordered(metric * towards.q, towards.lam, np.zeros(len(metric)), 1.0)
        length = sqrt(inner(metric, Tangent(q, lam), Tangent(q, lam)))
        return Tangent(q / length, lam / length)

    def bordered(self, row: Array, corner: float, forces: Array, value: float) -> tuple[Array, float]:
        """Solve with lambda as an unknown, too, and ``row . dq + corner dlam = value``, for dq and dlam.

        ``forces`` are zero on held unknowns.
        """
        border = self.load_rate, row, corner
        return solve_bordered(self.matrix, *border, forces, value, self.held, self.rate)


def solve(
    problem: Problem,
    q: Array,
    lam: float,
    active: Index,
    constraint: Constraint | None = None,
    options: NewtonOptions | None = None,
    predicted_stress: Any = None,
) -> Equilibrium:
    """Find the equilibrium near ``q`` on the plane of ``constraint`` (by default at this ``lam``).

    ``problem``: what to solve.  ``q``, ``lam``, ``active``: guess: unknowns of shape (n,), control parameter, and the
    bounded unknowns on their bounds.  ``constraint``: point of the branch to find; by default the control parameter
    stays as it is.  ``options``: tolerances and limits.  Raises NewtonError: with the residual history, when it does
    not converge, or not near enough to the guess; CrushedError: when the equilibrium found is inadmissible.
    """
    options = options or NewtonOptions()
    guess, begin, q = q, lam, q.copy()
    bounded, lower = problem.bounded, problem.lower
    is_active = np.isin(bounded, active)
    history: list[float] = []
    sets = np.zeros((4, len(bounded)), bool)

    def failed(why: str, advice: str = "") -> NewtonError:
        # Where it failed lambda may be anything.
        return NewtonError(why, parameter=begin, residuals=history, advice=advice)

    for iteration in range(options.max_iterations):
        at = Linearised(problem, q, lam, bounded[is_active], predicted_stress)
        history.append(at.unbalanced)
        if not np.isfinite(at.unbalanced):
            raise failed("Newton's method met a value that is not finite")
        if (
            at.is_balanced(options)
            and (constraint is None or abs(constraint.defect(q, lam)) <= 1e-10)
            and not np.any(~is_active & (q[bounded] - lower < -options.gap_tolerance))
            and not np.any(is_active & (at.force[bounded] < -options.force_tolerance))
        ):
            violation = problem.admissibility(q)
            if violation:
                raise CrushedError(violation, parameter=lam, residuals=history)
            moved = float(np.abs(q - guess)[problem.metric > 0.0].max(initial=0.0))
            if moved > options.max_distance:
                allowed = f"allowed {options.max_distance:.2g}: another branch"
                raise failed(f"the state found is {moved:.2g} away from its guess, {allowed}", "start nearer")
            return Equilibrium(q, lam, bounded[is_active], tuple(history), at.force)
        sets[iteration % 4] = is_active
        if len(bounded) and kernels.step.is_cycling(sets, np.array(history), iteration):
            why = f"a contact opens and closes in turn, largest unbalanced force {history[-1]:.1e}"
            raise failed(f"active-set cycling: {why}", "take a smaller step")
        try:
            if constraint is None:
                dq, dlam = at.corrected(), 0.0
            else:
                last = -constraint.defect(q, lam) - float(constraint.row @ at.gap)
                dq, dlam = at.bordered(constraint.row, constraint.corner, at.imbalance, last)
                dq = dq + at.gap
        except SolveError as error:
            raise failed(str(error)) from error
        longest = problem.largest_change(q, dq)
        damping = min(1.0, options.largest_step / longest) if longest > 0.0 else 1.0
        q, predicted_stress = problem.stepped(q, damping * dq)
        if longest < SETTLED:
            predicted_stress = None
        lam = lam + damping * dlam
        if len(bounded):
            predicted_force = (at.force + at.matrix @ dq + at.load_rate * dlam)[bounded]
            single = iteration >= kernels.step.SINGLE
            kernels.step.next_active(is_active, predicted_force, q[bounded] - lower, single)
    raise failed(
        f"Newton's method did not converge in {options.max_iterations} iterations: largest unbalanced force "
        f"{history[-1]:.1e}, allowed {options.force_tolerance:.1e}",
        "take a smaller step or start nearer",
    )


def rounding(k: Matrix, q: Array) -> Array:
    """Change of the forces due to the rounding of ``q``, shape (n,), given their derivative ``k``."""
    # The unknowns are added to lengths and directors of order one.
    return 8.0 * EPS * (abs(k) @ (np.abs(q) + 1.0))

"""A time step of the energy-momentum method in compiled code, for a strip with its weight and internal friction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array
from stripfold.base.errors import CrushedError, NewtonError
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Equilibrium

if TYPE_CHECKING:
    from stripfold.solve.schemes import DynamicProblem, StepStart

REASONS = (
    "",
    "met a value that is not finite",
    "found active-set cycling: a contact opens and closes in turn",
    "",
    "did not converge",
)
"""By status of the kernel."""


def solve(
    problem: DynamicProblem,
    begin: StepStart,
    guess: Array,
    lam: float,
    inertia: float,
    drag: float,
    kappa: float,
    options: NewtonOptions,
) -> Equilibrium | None:
    """The end of a step as :func:`.schemes.solve_step` finds it.

    None where the compiled code does not know the forces, or a matrix needs pivots.

    Raises NewtonError: no convergence; CrushedError: the state found is inadmissible.
    """
    # That nothing else acts at its end is seen from the end found, not from the guess.
    known = problem.elements_over_step(begin.q, begin.q)
    if known is None:
        return None
    elements, springs, weight = known
    step = kernels.step
    q, force = guess.copy(), np.empty(len(guess))
    active = np.zeros(len(problem.bounded), bool)
    active[np.searchsorted(problem.bounded, begin.active)] = True
    status, history = step.solve(
        elements,
        springs,
        problem.mass.flat,
        problem.mass.width,
        weight,
        begin.q,
        begin.v,
        q,
        force,
        problem.prescribed,
        problem.prescribed_values(lam),
        problem.bounded,
        problem.lower,
        active,
        problem.metric > 0.0,
        np.array([begin.dt, inertia, drag, kappa]),
        np.array([options.force_tolerance, options.gap_tolerance, options.largest_step, options.max_iterations]),
    )
    if status == step.SINGULAR:
        return None
    residuals: dict[str, Any] = {"parameter": lam, "step": begin.dt, "residuals": list(history)}
    if status != step.CONVERGED:
        message = f"Newton's method {REASONS[status]} in {len(history)} iterations: {history[-1]:.1e}"
        raise NewtonError(message, advice="take a smaller step", **residuals)
    violation = problem.admissibility(q)
    if violation:
        raise CrushedError(violation, advice="take a smaller step or a thinner strip", **residuals)
    if problem.elements_over_step(begin.q, q) is None:
        return None
    return Equilibrium(q, lam, problem.bounded[active], tuple(history), force)

"""Time integration schemes that the energy-momentum method is compared with; undamped problems only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band, Sparse
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Equilibrium, FixedUnknowns
from stripfold.solve.schemes import Damping, DynamicProblem, StepResult, StepStart, solve_step

AT_REST = 1e-12
"""A gripper that moves by less in a step is taken to be at rest."""


class WithoutMemory(FixedUnknowns):
    """The part of a :class:`.DynamicProblem` that concerns a floor, effects with a memory and compiled code: none."""

    @property
    def bounded(self) -> Index:
        """None."""
        return np.zeros(0, dtype=np.intp)

    @property
    def lower(self) -> Array:
        """None."""
        return np.zeros(0)

    def elements_over_step(self, q0: Array, q1: Array) -> None:
        """None."""

    def friction_work(self, q0: Array, q1: Array) -> float:
        """Nothing."""
        return 0.0

    def accepted(self, q: Array) -> Self:
        """The same problem."""
        return self


@dataclass(frozen=True, slots=True)
class GeneralisedAlpha:
    """The generalised-alpha method (Chung and Hulbert, 1993); undamped problems only.

    ``radius`` is the spectral radius at infinite frequency: 1 dissipates nothing, 0 all that is faster than the step.
    """

    radius: float = 0.8

    def step(
        self, problem: DynamicProblem, begin: StepStart, lam: float, damping: Damping, options: NewtonOptions
    ) -> StepResult:
        """See :class:`Scheme`."""
        _refuse(damping)
        dt, mass, r = begin.dt, problem.mass, self.radius
        alpha_m, alpha_f = (2.0 * r - 1.0) / (r + 1.0), r / (r + 1.0)
        beta, gamma = 0.25 * (1.0 - alpha_m + alpha_f) ** 2, 0.5 - alpha_m + alpha_f
        force_0 = problem.residual(begin.q, lam)
        inertia = (1.0 - alpha_m) / (beta * dt**2)

        def acceleration(q: Array) -> Array:
            return (q - begin.q - dt * begin.v) / (beta * dt**2) - (0.5 / beta - 1.0) * begin.a

        def evaluate(q: Array, predicted_stress: Any) -> tuple[Array, Band | Sparse]:
            force, tangent, _ = problem.linearise(q, lam, predicted_stress)
            mean = (1.0 - alpha_m) * acceleration(q) + alpha_m * begin.a
            both = (1.0 - alpha_f) * force + alpha_f * force_0
            return mass @ mean + both, tangent.scaled(1.0 - alpha_f) + mass.scaled(inertia)

        guess = begin.q + dt * begin.mean_v
        state = solve_step(problem, evaluate, begin.q, guess, lam, begin.active, options)
        a = acceleration(state.q)
        v = begin.v + dt * ((1.0 - gamma) * begin.a + gamma * a)
        return _result(problem, begin, state, (v, a), state.force, len(state.residuals) - 1)


@dataclass(frozen=True, slots=True)
class Bathe:
    """Bathe's composite method (Bathe and Baig, 2005): half a trapezoidal step, then a backward difference.

    Undamped problems with a gripper at rest only; dissipates all that is faster than the step.
    """

    def step(
        self, problem: DynamicProblem, begin: StepStart, lam: float, damping: Damping, options: NewtonOptions
    ) -> StepResult:
        """See :class:`Scheme`."""
        _refuse(damping)
        if np.any(np.abs(problem.prescribed_values(lam) - begin.q[problem.prescribed]) > AT_REST):
            # Halfway it would already be where it is at the end.
            raise ValueError("this scheme is kept for comparison, with the gripper at rest")
        dt, mass, half = begin.dt, problem.mass, 0.5 * begin.dt

        def first(q: Array, predicted_stress: Any) -> tuple[Array, Band | Sparse]:
            force, tangent, _ = problem.linearise(q, lam, predicted_stress)
            acceleration = 4.0 / half**2 * (q - begin.q - half * begin.v) - begin.a
            return mass @ acceleration + force, tangent + mass.scaled(4.0 / half**2)

        guess = begin.q + half * begin.mean_v
        middle = solve_step(problem, first, begin.q, guess, lam, begin.active, options)
        v_middle = 2.0 / half * (middle.q - begin.q) - begin.v

        def velocity(q: Array) -> Array:
            return (begin.q - 4.0 * middle.q + 3.0 * q) / dt

        def second(q: Array, predicted_stress: Any) -> tuple[Array, Band | Sparse]:
            force, tangent, _ = problem.linearise(q, lam, predicted_stress)
            acceleration = (begin.v - 4.0 * v_middle + 3.0 * velocity(q)) / dt
            return mass @ acceleration + force, tangent + mass.scaled(9.0 / dt**2)

        state = solve_step(problem, second, middle.q, middle.q + half * begin.mean_v, lam, middle.active, options)
        iterations = len(middle.residuals) + len(state.residuals) - 2
        v = velocity(state.q)
        a = (begin.v - 4.0 * v_middle + 3.0 * v) / dt
        return _result(problem, begin, state, (v, a), state.force, iterations)


def _refuse(damping: Damping) -> None:
    if damping != Damping():
        raise ValueError("this scheme is kept for comparison, without damping")


def _result(
    problem: DynamicProblem,
    begin: StepStart,
    state: Equilibrium,
    rates: tuple[Array, Array],
    force: Array,
    iterations: int,
) -> StepResult:
    """The end of a step of a scheme that does not account for its energy: work and losses to its own order only."""
    moved = state.q - begin.q
    work = float(force[problem.prescribed] @ moved[problem.prescribed])
    contact = -float(force[state.active] @ moved[state.active])
    return StepResult(state.q, *rates, state.active, iterations, work, contact)

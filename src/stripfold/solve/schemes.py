"""One time step as an equilibrium problem for :mod:`.newton`: the energy-momentum method.

The study ``schemes`` compares others with it (docs/method.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import CrushedError, NewtonError
from stripfold.solve import newton
from stripfold.solve.linear import Band, Sparse
from stripfold.solve.newton import NewtonOptions
from stripfold.solve.problem import Equilibrium, Problem

if TYPE_CHECKING:
    from stripfold.kernels.bending import Springs
    from stripfold.kernels.elements import Elements
    from stripfold.solve.dynamics import TimeState


REASONS = (
    "",
    "met a value that is not finite",
    "found active-set cycling: a contact opens and closes in turn",
    "",
    "did not converge",
)
"""Why the compiled iteration ended, by its status."""


class DynamicProblem(Problem, Protocol):
    """A problem that can be integrated in time."""

    @property
    def mass(self) -> Band: ...

    def predict_stress(self, q: Array, dq: Array) -> Any:
        """The stress predicted for ``q + dq``, used in the next tangent only."""

    def linearise(self, q: Array, lam: float, predicted_stress: Any = None) -> tuple[Array, Band | Sparse, Array]: ...

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Any = None
    ) -> tuple[Array, Band | Sparse]:
        """Force over a time step and its derivative by ``q1``.

        Its work over the step is the gain of elastic and gravity energy plus ``kappa`` :meth:`strain_distance` plus
        :meth:`friction_work`.
        """

    def elements_over_step(self, q0: Array, q1: Array) -> tuple[Elements, Springs, Array] | None:
        """A strip's elements, friction in them and weight, shape (n,), if nothing else acts over a step; else None."""

    def strain_distance(self, q0: Array, q1: Array) -> float:
        """Squared distance of two states in strain, weighted with the stiffness."""

    def energies(self, q: Array) -> tuple[float, float]:
        """Elastic and gravity energy."""

    def friction_work(self, q0: Array, q1: Array) -> float:
        """Work done on effects with a memory: heat, and energy in their springs."""

    def accepted(self, q: Array) -> Self:
        """The problem after an accepted step to ``q``: its effects have updated their memory."""


@dataclass(frozen=True, slots=True)
class Damping:
    """Physical damping, in solver units.

    ``air``: mass-proportional: force per mass and velocity, sqrt(g/L*).  ``stiffness``: stiffness-proportional: the
    stress is that of the strain plus this time times its rate, sqrt(L*/g).
    """

    air: float = 0.0
    stiffness: float = 0.0


@dataclass(frozen=True, eq=False)
class StepResult:
    """The end of a step, the gripper's work in it and the losses; ``a`` is for the scheme's next step."""

    q: Array
    v: Array
    a: Array
    active: Index
    iterations: int
    work: float
    contact: float
    air: float = 0.0
    viscous: float = 0.0
    friction: float = 0.0
    numerical: float = 0.0


class Scheme(Protocol):
    """A time integration scheme."""

    def step(
        self, problem: DynamicProblem, begin: TimeState, dt: float, lam: float, damping: Damping, options: NewtonOptions
    ) -> StepResult:
        """Take one step of duration ``dt``; raises :class:`.NewtonError` when it is too long.

        The mean velocity of the previous step predicts the next state: unlike ``v`` and ``a`` it does not oscillate
        after an impact.
        """
        ...


Evaluate = Callable[[Array, Any], tuple[Array, Band | Sparse]]


@dataclass(frozen=True, eq=False)
class _Implicit:
    """One step as an equilibrium problem: the given one with other forces."""

    problem: DynamicProblem
    evaluate: Evaluate

    def __getattr__(self, name: str) -> Any:
        return getattr(self.problem, name)

    def linearise(self, q: Array, lam: float, predicted_stress: Any = None) -> tuple[Array, Band | Sparse, Array]:
        force, tangent = self.evaluate(q, predicted_stress)
        return force, tangent, np.zeros(len(q))


def solve_step(
    problem: DynamicProblem, evaluate: Evaluate, q: Array, guess: Array, lam: float, active: Index, o: NewtonOptions
) -> Equilibrium:
    """Newton from a guess that respects the bounds."""
    guess[problem.bounded] = np.maximum(guess[problem.bounded], problem.lower)
    implicit: Any = _Implicit(problem, evaluate)
    return newton.solve(implicit, guess, lam, active, options=o, predicted_stress=problem.predict_stress(q, guess - q))


def solve_compiled(
    problem: DynamicProblem, begin: TimeState, step: Array, guess: Array, lam: float, options: NewtonOptions
) -> Equilibrium | None:
    """Find the end of a step as :func:`solve_step` does, for a strip with its weight and internal friction.

    ``step``: duration, factors of the mass for inertia and drag, viscosity over duration.  None where the compiled code
    does not know the forces, or a matrix needs pivots.

    Raises NewtonError: no convergence; CrushedError: the state found is inadmissible.
    """
    # That nothing else acts at its end is seen from the end found, not from the guess.
    known = problem.elements_over_step(begin.q, begin.q)
    if known is None:
        return None
    elements, springs, weight = known
    q, force = guess.copy(), np.empty(len(guess))
    active = np.zeros(len(problem.bounded), bool)
    active[np.searchsorted(problem.bounded, begin.active)] = True
    status, history = kernels.step.solve(
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
        step,
        np.array([options.force_tolerance, options.gap_tolerance, options.largest_step, options.max_iterations]),
    )
    if status == kernels.step.SINGULAR:
        return None
    residuals: dict[str, Any] = {"parameter": lam, "step": float(step[0]), "residuals": list(history)}
    if status != kernels.step.CONVERGED:
        message = f"Newton's method {REASONS[status]} in {len(history)} iterations: {history[-1]:.1e}"
        raise NewtonError(message, advice="take a smaller step", **residuals)
    violation = problem.admissibility(q)
    if violation:
        raise CrushedError(violation, **residuals)
    if problem.elements_over_step(begin.q, q) is None:
        return None
    return Equilibrium(q, lam, problem.bounded[active], tuple(history), force)


@dataclass(frozen=True, slots=True)
class EnergyMomentum:
    """The energy-momentum method (Simo and Tarnow, 1992), with the velocity's dissipation of Armero and Romero (2001).

    Without damping it conserves energy to the tolerance of Newton's method at any step size; the loss due to
    ``dissipation`` is computed exactly and never negative.

    ``dissipation``: r, one per time.  The velocity is weighted towards the end of the step by chi = r dt (at most 1).
    Vibrations that the step does not resolve decay as exp(-2 r t); the scheme stays of second order, and a slow motion
    of frequency omega has the damping ratio r omega dt^2 / 4.  The displacement is not weighted: that would brake a
    slow fall as well.
    """

    dissipation: float = 1.0

    def step(
        self, problem: DynamicProblem, begin: TimeState, dt: float, lam: float, damping: Damping, options: NewtonOptions
    ) -> StepResult:
        """See :class:`Scheme`."""
        mass = problem.mass
        chi = min(self.dissipation * dt, 1.0)
        kappa = damping.stiffness / dt
        inertia, drag = 2.0 / (dt**2 * (1.0 + chi)), damping.air / dt

        def evaluate(q: Array, predicted_stress: Any) -> tuple[Array, Band | Sparse]:
            force, tangent = problem.force_over_step(begin.q, q, kappa, predicted_stress)
            moved = q - begin.q
            force = force + mass @ (inertia * (moved - dt * begin.v) + drag * moved)
            return force, tangent + mass.scaled(inertia + drag)

        guess = begin.q + dt * begin.mean_v
        guess[problem.bounded] = np.maximum(guess[problem.bounded], problem.lower)
        step = np.array([dt, inertia, drag, kappa])
        state = solve_compiled(problem, begin, step, guess, lam, options)
        if state is None:
            state = solve_step(problem, evaluate, begin.q, guess, lam, begin.active, options)
        moved = state.q - begin.q
        v = (2.0 * moved / dt - (1.0 - chi) * begin.v) / (1.0 + chi)
        force = state.force
        strain, jump = problem.strain_distance(begin.q, state.q), v - begin.v
        return StepResult(
            state.q,
            v,
            (v - begin.v) / dt,
            state.active,
            len(state.residuals) - 1,
            work=float(force[problem.prescribed] @ moved[problem.prescribed]),
            contact=-float(force[state.active] @ moved[state.active]),
            air=drag * float(moved @ (mass @ moved)),
            viscous=damping.stiffness / dt * strain,
            friction=problem.friction_work(begin.q, state.q),
            numerical=0.5 * chi * float(jump @ (mass @ jump)),
        )

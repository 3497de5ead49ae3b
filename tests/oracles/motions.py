"""Problems whose motion is known: a strip that is held and has no floor, and a linear oscillator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band
from stripfold.solve.problem import FixedUnknowns
from stripfold.strip.model import Model


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


@dataclass(frozen=True)
class HeldStrip(WithoutMemory):
    """A strip without a floor: some unknowns are held, and move with lambda.

    ``prescribed``, ``values``, ``direction``: held unknowns, what they are at lambda = 0, and their change per lambda;
    shape (m,).  ``gravity``: factor on the weight.
    """

    model: Model
    prescribed: Index
    values: Array
    direction: Array
    gravity: float = 1.0

    @property
    def size(self) -> int:
        return self.model.size

    @property
    def metric(self) -> Array:
        """Mean square of the mid-surface displacement."""
        metric = np.zeros(self.size)
        metric[self.model.middle] = (np.gradient(self.model.s) / self.model.length)[:, None]
        return metric

    @property
    def mass(self) -> Band:
        return self.model.mass

    def residual(self, q: Array, lam: float) -> Array:
        return self.model.internal_force(q) + self.gravity * self.model.weight

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Band, Array]:
        force, tangent = self.model.force_and_tangent(q, predicted_stress)
        return force + self.gravity * self.model.weight, tangent, np.zeros(self.size)

    def predict_stress(self, q: Array, dq: Array) -> Array:
        return self.model.predict_stress(q, dq)

    def admissibility(self, q: Array) -> str:
        return self.model.admissibility(q)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        force, tangent = self.model.force_over_step(q0, q1, kappa, predicted_stress)
        return force + self.gravity * self.model.weight, tangent

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return self.model.strain_distance(q0, q1)

    def energies(self, q: Array) -> tuple[float, float]:
        return self.model.energy(q), self.gravity * float(self.model.weight @ q)

    def prescribed_values(self, lam: float) -> Array:
        return self.values + lam * self.direction

    def prescribed_rates(self, lam: float) -> Array:
        return self.direction

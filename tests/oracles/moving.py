"""A mass on an elastic bar: small motions with a known energy, for the time integration."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from oracles.motions import WithoutMemory
from oracles.toys import Dense
from stripfold.base.arrays import Array, Index

NONE = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class Small(Dense):
    """A dense matrix with what the time integration asks of one besides."""

    def __add__(self, other: Dense) -> Small:
        return Small(self.a + other.a)

    def scaled(self, factor: float) -> Small:
        return Small(factor * self.a)


@dataclass(frozen=True)
class Pendulum(WithoutMemory):
    """A unit mass in the plane on a bar of length one from the origin, at rest at (1, 0); gravity acts along -y.

    The bar's energy is ``stiffness (d . d - 1)^2 / 8`` with d the place of the mass (Green's strain).  Unknowns are the
    displacement; ``held`` ones are zero, ``moved`` ones follow lambda, and ``floor`` bounds the second from below.
    """

    stiffness: float = 50.0
    gravity: float = 1.0
    moved: Index = field(default_factory=lambda: NONE)
    floor: float | None = None
    breaks_below: float = -np.inf

    size = 2
    metric = np.ones(2)
    mass = Small(np.eye(2))

    @property
    def prescribed(self) -> Index:
        return self.moved

    @property
    def bounded(self) -> Index:
        return NONE if self.floor is None else np.array([1])

    @property
    def lower(self) -> Array:
        return np.zeros(0) if self.floor is None else np.array([self.floor])

    @property
    def weight(self) -> Array:
        return np.array([0.0, self.gravity])

    def place(self, q: Array) -> Array:
        return q + np.array([1.0, 0.0])

    def strain(self, q: Array) -> float:
        d = self.place(q)
        return 0.5 * float(d @ d - 1.0)

    def residual(self, q: Array, lam: float) -> Array:
        return self.stiffness * self.strain(q) * self.place(q) + self.weight

    def linearise(self, q: Array, lam: float, predicted_stress: None = None) -> tuple[Array, Small, Array]:
        d = self.place(q)
        return self.residual(q, lam), Small(self.stiffness * (np.outer(d, d) + self.strain(q) * np.eye(2))), np.zeros(2)

    def predict_stress(self, q: Array, dq: Array) -> None:
        return None

    def admissibility(self, q: Array) -> str:
        return ""

    def force_over_step(self, q0: Array, q1: Array, kappa: float, predicted_stress: None = None) -> tuple[Array, Small]:
        e0, e1 = self.strain(q0), self.strain(q1)
        middle = 0.5 * (self.place(q0) + self.place(q1))
        share = 0.5 + kappa
        stress = self.stiffness * ((1.0 - share) * e0 + share * e1)
        tangent = self.stiffness * share * np.outer(middle, self.place(q1)) + 0.5 * stress * np.eye(2)
        force = stress * middle + self.weight
        return (force if q1[1] >= self.breaks_below else np.full(2, np.nan)), Small(tangent)

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return self.stiffness * (self.strain(q1) - self.strain(q0)) ** 2

    def energies(self, q: Array) -> tuple[float, float]:
        return 0.5 * self.stiffness * self.strain(q) ** 2, float(self.weight @ q)

    def prescribed_values(self, lam: float) -> Array:
        return np.full(len(self.moved), lam)

    def prescribed_rates(self, lam: float) -> Array:
        return np.ones(len(self.moved))

    def truth(self, q: Array, v: Array, t: float) -> tuple[Array, Array]:
        """Displacement and velocity after a time, undamped and with neither floor nor moved unknowns."""

        def rate(_: float, y: Array) -> Array:
            return np.concatenate([y[2:], -self.residual(y[:2], 0.0)])

        end = solve_ivp(rate, (0.0, t), np.concatenate([q, v]), method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        return end[:2], end[2:]

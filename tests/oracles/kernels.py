"""The compiled integrals in NumPy: the readable reference of :mod:`stripfold.kernels`."""

from __future__ import annotations

import numpy as np

from stripfold.base.arrays import Array
from stripfold.solve.linear import Band
from stripfold.strip import laws
from stripfold.strip.rod import AT_BEND, AT_STRETCH, VISCOUS, Rod, hermite
from stripfold.strip.solid import Solid

X, Z = np.array([0, 2, 4, 6]), np.array([1, 3, 5, 7])
"""Positions of an element's x and z unknowns: displacement, slope; left end, right end."""


def _strains() -> tuple[Array, Array]:
    """The strains of an element of length one are ``linear . y + y . quadratic . y / 2``; shapes (9, 8), (9, 8, 8)."""
    linear, quadratic = np.zeros((9, 8)), np.zeros((9, 8, 8))
    first = hermite(AT_STRETCH)[1]
    linear[:3, X] = first
    for own in (X, Z):
        quadratic[:3, own[:, None], own] = first[:, :, None] * first[:, None, :]
    _, first, second = hermite(AT_BEND)
    linear[3:5, Z] = linear[5:7, X] = linear[7:, Z] = second
    # x' z'' - z' x'', made symmetric.
    cross = first[:, :, None] * second[:, None, :] - second[:, :, None] * first[:, None, :]
    quadratic[3:5, X[:, None], Z] = cross
    quadratic[3:5, Z[:, None], X] = cross.transpose(0, 2, 1)
    return linear, quadratic


LINEAR, QUADRATIC = _strains()


class RodReference:
    """The integrals of a rod from its strains' first and second derivatives."""

    def __init__(self, model: Rod) -> None:
        self.model = model

    def strains(self, q: Array) -> tuple[Array, Array]:
        """The strains, shape (n_elements, 9), and their derivatives by the scaled unknowns, (n_elements, 9, 8)."""
        local = q[self.model.element_unknowns] * self.model.scale
        rate = LINEAR + np.einsum("pab,eb->epa", QUADRATIC, local)
        return 0.5 * np.einsum("epa,ea->ep", LINEAR + rate, local), rate

    def energy(self, q: Array) -> float:
        return 0.5 * float(np.sum(self.model.stiffness * self.strains(q)[0] ** 2))

    def strain_distance(self, q0: Array, q1: Array) -> float:
        change = self.strains(q1)[0] - self.strains(q0)[0]
        return float(np.sum(VISCOUS * self.model.stiffness * change**2))

    def predict_stress(self, q: Array, dq: Array) -> Array:
        strain, rate = self.strains(q)
        change = np.einsum("epa,ea->ep", rate, dq[self.model.element_unknowns] * self.model.scale)
        return self.model.stiffness * (strain + change)

    def force_of(self, q: Array, stress: Array) -> Array:
        return self._scatter(stress, self.strains(q)[1])

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        strain, rate = self.strains(q)
        stress = self.model.stiffness * strain
        geometric = stress if predicted_stress is None else predicted_stress
        return self._scatter(stress, rate), self._band(rate, self.model.stiffness, rate, geometric)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        (strain_0, rate_0), (strain_1, rate_1) = self.strains(q0), self.strains(q1)
        middle, share = 0.5 * (rate_0 + rate_1), 0.5 + kappa * VISCOUS
        begin, end = self.model.stiffness * strain_0, self.model.stiffness * strain_1
        force = self._scatter((1.0 - share) * begin + share * end, middle)
        geometric = 0.5 * ((1.0 - share) * begin + share * (end if predicted_stress is None else predicted_stress))
        return force, self._band(middle, share * self.model.stiffness, rate_1, geometric)

    def _scatter(self, stress: Array, rate: Array) -> Array:
        local = np.einsum("ep,epa->ea", stress, rate) * self.model.scale
        return np.bincount(self.model.element_unknowns.ravel(), local.ravel(), minlength=self.model.size)

    def _band(self, left: Array, stiffness: Array, right: Array, stress: Array) -> Band:
        matrices = np.einsum("epa,ep,epb->eab", left, stiffness, right) + np.einsum("ep,pab->eab", stress, QUADRATIC)
        scale = self.model.scale
        return self.model.pattern.assemble(scale[:, :, None] * matrices * scale[:, None, :])


class SolidReference:
    """The integrals of a solid of St Venant-Kirchhoff material from the law at each quadrature point."""

    def __init__(self, model: Solid) -> None:
        self.model = model
        n_el, n_q = model.mesh.weights.shape
        self.gradient = model.gradient_t.reshape(n_el, n_q, 2, 2, -1)

    def energy(self, q: Array) -> float:
        f = self.model.deformation_gradient(q)
        return float(np.sum(self.model.mesh.weights * laws.svk_energy(f, self.model.lame)))

    def strain_distance(self, q0: Array, q1: Array) -> float:
        f0, f1 = (self.model.deformation_gradient(q) for q in (q0, q1))
        change = laws.green_lagrange(f1) - laws.green_lagrange(f0)
        stress = laws.stress_of_strain(change, self.model.lame)
        return float(np.einsum("eq,eqij,eqij", self.model.mesh.weights, stress, change))

    def predict_stress(self, q: Array, dq: Array) -> Array:
        f = self.model.deformation_gradient(q)
        df = np.einsum("eqija,ea->eqij", self.gradient, dq[self.model.mesh.element_unknowns])
        ft_df = np.einsum("eqki,eqkj->eqij", f, df)
        strain = laws.green_lagrange(f) + 0.5 * (ft_df + np.swapaxes(ft_df, -1, -2))
        return laws.stress_of_strain(strain, self.model.lame)

    def force_of(self, q: Array, stress: Array) -> Array:
        return self._scatter(self.model.deformation_gradient(q) @ stress)

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        f, lame = self.model.deformation_gradient(q), self.model.lame
        return self._scatter(laws.svk_stress(f, lame)), self._band(laws.svk_tangent(f, lame, predicted_stress))

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        lame = self.model.lame
        f0, f1 = self.model.deformation_gradient(q0), self.model.deformation_gradient(q1)
        middle = 0.5 * (f0 + f1)
        s0, s1 = (laws.stress_of_strain(laws.green_lagrange(f), lame) for f in (f0, f1))
        share = 0.5 + kappa
        stress = middle @ ((1.0 - share) * s0 + share * s1)
        geometric = 0.5 * ((1.0 - share) * s0 + share * (s1 if predicted_stress is None else predicted_stress))
        one, lam, mu = np.eye(2), share * lame.lam, share * lame.mu
        rate = (
            lam * np.einsum("eqij,eqkm->eqijkm", middle, f1)
            + mu * np.einsum("eqia,eqka,jm->eqijkm", middle, f1, one)
            + mu * np.einsum("eqim,eqkj->eqijkm", middle, f1)
            + np.einsum("ik,eqjm->eqijkm", one, geometric)
        )
        return self._scatter(stress), self._band(rate)

    def _scatter(self, stress: Array) -> Array:
        local = np.einsum("eq,eqij,eqija->ea", self.model.mesh.weights, stress, self.gradient)
        return np.bincount(self.model.mesh.element_unknowns.ravel(), local.ravel(), minlength=self.model.size)

    def _band(self, rate: Array) -> Band:
        weights, g = self.model.mesh.weights, self.gradient
        return self.model.pattern.assemble(np.einsum("eq,eqija,eqijkm,eqkmb->eab", weights, g, rate, g, optimize=True))

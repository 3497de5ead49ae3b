"""The compiled integrals in NumPy: the readable reference of :mod:`stripfold.kernels`."""

from __future__ import annotations

import numpy as np

from stripfold.base.arrays import Array
from stripfold.solve.linear import Band
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
        # From the unknowns to those of an element of length one: displacements, then slopes, of either end.
        self.scale = np.where([True, True, False, False] * 2, 1.0 / np.diff(model.s)[:, None], 1.0)

    def strains(self, q: Array) -> tuple[Array, Array]:
        """The strains, shape (n_elements, 9), and their derivatives by the scaled unknowns, (n_elements, 9, 8)."""
        local = q[self.model.element_unknowns] * self.scale
        rate = LINEAR + np.einsum("pab,eb->epa", QUADRATIC, local)
        return 0.5 * np.einsum("epa,ea->ep", LINEAR + rate, local), rate

    def energy(self, q: Array) -> float:
        return 0.5 * float(np.sum(self.model.stiffness * self.strains(q)[0] ** 2))

    def strain_distance(self, q0: Array, q1: Array) -> float:
        change = self.strains(q1)[0] - self.strains(q0)[0]
        return float(np.sum(VISCOUS * self.model.stiffness * change**2))

    def predict_stress(self, q: Array, dq: Array) -> Array:
        strain, rate = self.strains(q)
        change = np.einsum("epa,ea->ep", rate, dq[self.model.element_unknowns] * self.scale)
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
        local = np.einsum("ep,epa->ea", stress, rate) * self.scale
        return np.bincount(self.model.element_unknowns.ravel(), local.ravel(), minlength=self.model.size)

    def _band(self, left: Array, stiffness: Array, right: Array, stress: Array) -> Band:
        matrices = np.einsum("epa,ep,epb->eab", left, stiffness, right) + np.einsum("ep,pab->eab", stress, QUADRATIC)
        scale = self.scale
        return self.model.pattern.assemble(scale[:, :, None] * matrices * scale[:, None, :])


class SolidReference:
    """The integrals of a solid of St Venant-Kirchhoff material from the law at each quadrature point."""

    def __init__(self, model: Solid) -> None:
        self.model = model
        shape, self.weights = model.elements.shape, model.elements.stiffness
        n_el, n_q, _, nodes = shape.shape
        gradient = np.zeros((n_el, n_q, 2, 2, nodes, 2))
        for i in range(2):
            gradient[:, :, i, :, :, i] = shape
        self.gradient = gradient.reshape(n_el, n_q, 2, 2, 2 * nodes)

    def f(self, q: Array) -> Array:
        """Deformation gradient at the quadrature points, shape (n_elements, n_quadrature, 2, 2)."""
        return np.eye(2) + np.einsum("eqija,ea->eqij", self.gradient, q[self.model.element_unknowns])

    def stress(self, strain: Array) -> Array:
        """``C : E``."""
        lam, mu = self.model.lame
        return lam * np.trace(strain, axis1=2, axis2=3)[..., None, None] * np.eye(2) + 2.0 * mu * strain

    def energy(self, q: Array) -> float:
        return 0.5 * self.strain_distance(np.zeros_like(q), q)

    def strain_distance(self, q0: Array, q1: Array) -> float:
        change = green_lagrange(self.f(q1)) - green_lagrange(self.f(q0))
        return float(np.einsum("eq,eqij,eqij", self.weights, self.stress(change), change))

    def predict_stress(self, q: Array, dq: Array) -> Array:
        f = self.f(q)
        half = np.swapaxes(f, -1, -2) @ (self.f(dq) - np.eye(2))
        return self.stress(green_lagrange(f) + 0.5 * (half + np.swapaxes(half, -1, -2)))

    def force_of(self, q: Array, stress: Array) -> Array:
        return self._scatter(self.f(q) @ stress)

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        return self._over_step(q, q, 1.0, 1.0, predicted_stress)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        return self._over_step(q0, q1, 0.5 + kappa, 0.5, predicted_stress)

    def _over_step(
        self, q0: Array, q1: Array, share: float, half: float, predicted: Array | None
    ) -> tuple[Array, Band]:
        lam, mu = (share * value for value in self.model.lame)
        f0, f1, one = self.f(q0), self.f(q1), np.eye(2)
        middle = 0.5 * (f0 + f1)
        s0, s1 = (self.stress(green_lagrange(f)) for f in (f0, f1))
        stress = middle @ ((1.0 - share) * s0 + share * s1)
        geometric = half * ((1.0 - share) * s0 + share * (s1 if predicted is None else predicted))
        rate = (
            lam * np.einsum("eqij,eqkm->eqijkm", middle, f1)
            + mu * np.einsum("eqia,eqka,jm->eqijkm", middle, f1, one)
            + mu * np.einsum("eqim,eqkj->eqijkm", middle, f1)
            + np.einsum("ik,eqjm->eqijkm", one, geometric)
        )
        return self._scatter(stress), self._band(rate)

    def _scatter(self, stress: Array) -> Array:
        local = np.einsum("eq,eqij,eqija->ea", self.weights, stress, self.gradient)
        return np.bincount(self.model.element_unknowns.ravel(), local.ravel(), minlength=self.model.size)

    def _band(self, rate: Array) -> Band:
        g = self.gradient
        return self.model.pattern.assemble(
            np.einsum("eq,eqija,eqijkm,eqkmb->eab", self.weights, g, rate, g, optimize=True)
        )


def green_lagrange(f: Array) -> Array:
    """``(F^T F - I) / 2``."""
    return 0.5 * (np.swapaxes(f, -1, -2) @ f - np.eye(2))

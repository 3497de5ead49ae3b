"""Constitutive laws in the plane, as functions of the deformation gradient.

Each law maps ``F`` of shape (..., 2, 2) to the first Piola-Kirchhoff stress ``P = F S`` and its
derivative ``A = dP/dF``; plane strain, as the paper's Voigt matrix with the strip's width held.

Source: the paper's section III-C; ``docs/physics.md``, section 2, for why its printed law is not used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from stripfold.base.arrays import Array

_EYE = np.eye(2)
"""Unit matrix."""


@dataclass(frozen=True, slots=True)
class Lame:
    """Lame parameters of an isotropic law, in the unit of the stress."""

    lam: float
    mu: float

    @classmethod
    def from_young(cls, young: float, nu: float) -> Lame:
        """From Young's modulus and Poisson's ratio (the paper's Voigt matrix)."""
        return cls(lam=young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), mu=young / (2.0 * (1.0 + nu)))


# Products of 2 x 2 matrices are written out: NumPy's matrix product takes several times as long (docs/performance.md).


def times(a: Array, b: Array) -> Array:
    """``a b`` of matrices, shape (..., 2, 2) each."""
    out = np.empty_like(a)
    for i, j in product(range(2), repeat=2):
        out[..., i, j] = a[..., i, 0] * b[..., 0, j] + a[..., i, 1] * b[..., 1, j]
    return out


def green_lagrange(f: Array) -> Array:
    """Green-Lagrange strain ``E = (F^T F - I)/2``, shape (..., 2, 2)."""
    strain = 0.5 * times(np.swapaxes(f, -1, -2), f)
    strain[..., 0, 0] -= 0.5
    strain[..., 1, 1] -= 0.5
    return strain


def stress_of_strain(strain: Array, lame: Lame) -> Array:
    """``C : E`` of the isotropic tensor ``C``, shape (..., 2, 2)."""
    trace = strain[..., 0, 0] + strain[..., 1, 1]
    return lame.lam * trace[..., None, None] * _EYE + 2.0 * lame.mu * strain


def _stress_rate(f: Array, lame: Lame) -> Array:
    """``d(C : E)_IJ / dF_kL`` as an array (..., I, J, k, L)."""
    rate = np.zeros((*f.shape[:-2], 2, 2, 2, 2))
    for i in range(2):
        rate[..., i, i, :, :] += lame.lam * f
        for j in range(2):
            rate[..., i, j, :, j] += lame.mu * f[..., :, i]
            rate[..., i, j, :, i] += lame.mu * f[..., :, j]
    return rate


def svk_energy(f: Array, lame: Lame) -> Array:
    """Strain energy per reference area of the St Venant-Kirchhoff law, shape (...)."""
    strain = green_lagrange(f)
    trace = strain[..., 0, 0] + strain[..., 1, 1]
    return np.asarray(0.5 * lame.lam * trace**2 + lame.mu * np.sum(strain * strain, axis=(-1, -2)))


def svk_stress(f: Array, lame: Lame) -> Array:
    """``P = F (C : E)``: St Venant-Kirchhoff, the law the paper's weak form needs."""
    return times(f, stress_of_strain(green_lagrange(f), lame))


def svk_tangent(f: Array, lame: Lame, stress: Array | None = None) -> Array:
    """``dP_iJ / dF_kL`` of St Venant-Kirchhoff, shape (..., 2, 2, 2, 2).

    ``stress``, shape (..., 2, 2), replaces ``S = C : E`` in the geometric part; see :meth:`.Model.predict_stress`.
    """
    s = stress_of_strain(green_lagrange(f), lame) if stress is None else stress
    material = np.einsum("...iI,...IJkL->...iJkL", f, _stress_rate(f, lame))
    return np.asarray(material + np.einsum("ik,...JL->...iJkL", _EYE, s))


def printed_stress(f: Array, lame: Lame) -> Array:
    """``P = F S`` with the paper's printed ``S = J F^-1 (C : E) F^-T``; not objective."""
    return times(stress_of_strain(green_lagrange(f), lame), _cofactor(f))


def printed_tangent(f: Array, lame: Lame, stress: Array | None = None) -> Array:
    """``dP_iJ / dF_kL`` of the printed law, shape (..., 2, 2, 2, 2); not symmetric, ``stress`` is not used."""
    sigma = stress_of_strain(green_lagrange(f), lame)
    a = np.einsum("...imkl,...mj->...ijkl", _stress_rate(f, lame), _cofactor(f))
    # J F^-T is linear in F in the plane, so its derivative is a matrix of signs.
    for (m, j), (k, length), sign in (
        ((0, 0), (1, 1), 1.0),
        ((0, 1), (1, 0), -1.0),
        ((1, 0), (0, 1), -1.0),
        ((1, 1), (0, 0), 1.0),
    ):
        a[..., :, j, k, length] += sign * sigma[..., :, m]
    return np.asarray(a)


def _cofactor(f: Array) -> Array:
    """``J F^-T``."""
    c = np.empty_like(f)
    c[..., 0, 0], c[..., 0, 1] = f[..., 1, 1], -f[..., 1, 0]
    c[..., 1, 0], c[..., 1, 1] = -f[..., 0, 1], f[..., 0, 0]
    return c


@dataclass(frozen=True, slots=True)
class Law:
    """A law: stress and tangent, and its energy if it has one."""

    name: str
    stress: Callable[[Array, Lame], Array]
    tangent: Callable[[Array, Lame, Array | None], Array]
    energy: Callable[[Array, Lame], Array] | None = None


LAWS = {
    "svk": Law("svk", svk_stress, svk_tangent, svk_energy),
    "printed": Law("printed", printed_stress, printed_tangent),
}

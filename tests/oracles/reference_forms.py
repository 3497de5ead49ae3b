"""The solid as its formulas read, in scikit-fem's forms: the reference of the fast kernels in :mod:`.solid`.

Thirty times slower, and nothing is shared with the kernels but the basis: the laws are written out anew from the
printed formulas.  Forms act on nodal displacements in scikit-fem's numbering; :class:`Reference` carries them to the
unknowns of :class:`.StripMesh` by the chain rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from skfem import BilinearForm, Functional, LinearForm
from skfem.helpers import ddot, det, dot, eye, grad, inv, trace, transpose

from oracles.nodal import Nodal
from stripfold.base.arrays import Array
from stripfold.strip.laws import Lame
from stripfold.strip.strip_mesh import StripMesh


def product(a: Array, b: Array) -> Array:
    """Product of two fields of matrices, indices first: ``(a b)_ij``."""
    return np.einsum("ik...,kj...->ij...", a, b)


def sym(a: Array) -> Array:
    """Symmetric part of a field of matrices."""
    return 0.5 * (a + transpose(a))


def deformation_gradient(u: Any) -> Array:
    """``F = I + grad u``."""
    du = grad(u)
    return eye(np.ones(du.shape[2:]), 2) + du


def c_of(strain: Array, w: Any) -> Array:
    """``C : E = lam tr(E) I + 2 mu E``."""
    return w.lam * eye(trace(strain), 2) + 2.0 * w.mu * strain


def strain_of(f: Array) -> Array:
    """``E = (F^T F - I)/2``."""
    return 0.5 * (product(transpose(f), f) - eye(np.ones(f.shape[2:]), 2))


@Functional
def svk_energy(w: Any) -> Array:
    """``integral of (C : E) : E / 2``."""
    strain = strain_of(deformation_gradient(w.u))
    return 0.5 * ddot(c_of(strain, w), strain)


@LinearForm
def svk_force(v: Any, w: Any) -> Array:
    """``integral of F S : grad v`` with ``S = C : E``."""
    f = deformation_gradient(w.u)
    return ddot(product(f, c_of(strain_of(f), w)), grad(v))


@BilinearForm
def svk_tangent(du: Any, v: Any, w: Any) -> Array:
    """``integral of (dF S + F dS) : grad v`` with ``dF = grad du``, ``dS = C : sym(F^T dF)``."""
    f, df = deformation_gradient(w.u), grad(du)
    s = c_of(strain_of(f), w)
    ds = c_of(sym(product(transpose(f), df)), w)
    return ddot(product(df, s) + product(f, ds), grad(v))


def printed_s(f: Array, w: Any) -> Array:
    """The printed ``S = J F^-1 (C : E) F^-T``."""
    f_inv = inv(f)
    return det(f) * product(product(f_inv, c_of(strain_of(f), w)), transpose(f_inv))


@LinearForm
def printed_force(v: Any, w: Any) -> Array:
    """``integral of F S : grad v`` with the printed ``S``."""
    f = deformation_gradient(w.u)
    return ddot(product(f, printed_s(f, w)), grad(v))


@BilinearForm
def printed_tangent(du: Any, v: Any, w: Any) -> Array:
    """``integral of (dF S + F dS) : grad v`` with the printed ``S``.

    ``dJ = J tr(F^-1 dF)`` and ``d(F^-1) = -F^-1 dF F^-1``.
    """
    f, df = deformation_gradient(w.u), grad(du)
    f_inv = inv(f)
    s = printed_s(f, w)
    turn = product(f_inv, df)
    d_sigma = c_of(sym(product(transpose(f), df)), w)
    ds = trace(turn) * s - product(turn, s) - product(s, transpose(turn))
    ds += det(f) * product(product(f_inv, d_sigma), transpose(f_inv))
    return ddot(product(df, s) + product(f, ds), grad(v))


@BilinearForm
def mass(u: Any, v: Any, w: Any) -> Array:
    """``integral of rho u . v``."""
    return w.rho * dot(u, v)


@LinearForm
def weight(v: Any, w: Any) -> Array:
    """``integral of rho v_z``: what holds the strip up, gravity being -1."""
    return w.rho * v[1]


FORCES = {"svk": svk_force, "printed": printed_force}
TANGENTS = {"svk": svk_tangent, "printed": printed_tangent}


@dataclass(frozen=True)
class Reference:
    """The forms assembled on a strip's mesh, in its unknowns; dense, for small meshes.

    Nodal displacements are linear, u = T q: a force transforms as ``T^T r``, a tangent as ``T^T K T``.
    """

    mesh: StripMesh
    lame: Lame
    law: str = "svk"

    @cached_property
    def nodal(self) -> Nodal:
        """The mesh in scikit-fem's numbering."""
        return Nodal(self.mesh)

    def _nodal(self, q: Array) -> dict[str, Any]:
        u = self.nodal.basis.interpolate(self.nodal.displacements(q))
        return {"u": u, "lam": self.lame.lam, "mu": self.lame.mu}

    def energy(self, q: Array) -> float:
        """Elastic energy of the St Venant-Kirchhoff law."""
        return float(svk_energy.assemble(self.nodal.basis, **self._nodal(q)))

    def internal_force(self, q: Array) -> Array:
        """Internal force, shape (n,)."""
        nodal = FORCES[self.law].assemble(self.nodal.basis, **self._nodal(q))
        return np.asarray(self.nodal.transformation().T @ nodal)

    def tangent(self, q: Array) -> Array:
        """Its derivative, shape (n, n)."""
        t = self.nodal.transformation()
        return np.asarray(t.T @ TANGENTS[self.law].assemble(self.nodal.basis, **self._nodal(q)) @ t)

    def mass(self) -> Array:
        """Mass matrix of a strip of unit mass per length, shape (n, n)."""
        t = self.nodal.transformation()
        return np.asarray(t.T @ mass.assemble(self.nodal.full, rho=1.0 / self.mesh.thickness) @ t)

    def weight(self) -> Array:
        """Force that holds the strip's weight up, shape (n,)."""
        return np.asarray(
            self.nodal.transformation().T @ weight.assemble(self.nodal.full, rho=1.0 / self.mesh.thickness)
        )

"""The strip's solid as it reads on the page, in scikit-fem's forms: the judge of the compiled one.

Many times slower than :class:`.Solid`, with which it shares the unknowns and none of the integrals.  Only here are the
paper's printed law, elements of order one, two elements across the thickness, and meshes of any shape.
Source: the paper's section III-C; ``docs/physics.md``, section 2, for why its printed law is not used elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import skfem
from skfem import BilinearForm, DiscreteField, Functional, LinearForm
from skfem.helpers import ddot, det, dot, eye, grad, inv, trace, transpose

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import Band, BandPattern
from stripfold.strip.effects import Directors
from stripfold.strip.model import NO_GROWTH, NONE, lengths_of
from stripfold.strip.solid import Solid, gauss, numbering

LAWS = "svk", "printed"
CORNERS = np.array([[0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
"""Of scikit-fem's unit square, shape (2, 4)."""


def product(a: Array, b: Array) -> Array:
    """``(a b)_ij`` of two fields of matrices, indices first."""
    return np.einsum("ik...,kj...->ij...", a, b)


def green_lagrange(f: Array) -> Array:
    """``E = (F^T F - I) / 2``."""
    return 0.5 * (product(transpose(f), f) - eye(np.ones(f.shape[2:]), 2))


def c_of(strain: Array, w: Any) -> Array:
    """``C : E = lam tr(E) I + 2 mu E``, with the Lame parameters of ``w``."""
    return w["lam"] * eye(trace(strain), 2) + 2.0 * w["mu"] * strain


def second_piola(f: Array, w: Any, law: str) -> Array:
    """``S = C : E`` (St Venant-Kirchhoff), or as printed: ``S = J F^-1 (C : E) F^-T``."""
    s = c_of(green_lagrange(f), w)
    return s if law == "svk" else det(f) * product(product(inv(f), s), transpose(inv(f)))


def second_piola_rate(f: Array, df: Array, w: Any, law: str) -> Array:
    """Its change with ``F``: ``dE = sym(F^T dF)``, ``dJ = J tr(F^-1 dF)`` and ``d(F^-1) = -F^-1 dF F^-1``."""
    half = product(transpose(f), df)
    ds = c_of(0.5 * (half + transpose(half)), w)
    if law == "svk":
        return ds
    s, turn = second_piola(f, w, law), product(inv(f), df)
    ds = det(f) * product(product(inv(f), ds), transpose(inv(f)))
    return ds + trace(turn) * s - product(turn, s) - product(s, transpose(turn))


def deformation_gradient(u: Any) -> Array:
    """``F = I + grad u``."""
    return eye(np.ones(grad(u).shape[2:]), 2) + grad(u)


@Functional
def energy(w: Any) -> Array:
    """``integral of (C : E) : E / 2``, of St Venant-Kirchhoff material."""
    strain = green_lagrange(deformation_gradient(w["u"]))
    return 0.5 * ddot(c_of(strain, w), strain)


def force(law: str) -> LinearForm:
    """``integral of F S : grad v``."""

    def form(v: Any, w: Any) -> Array:
        f = deformation_gradient(w["u"])
        return ddot(product(f, second_piola(f, w, law)), grad(v))

    return LinearForm(form)


def tangent(law: str) -> BilinearForm:
    """``integral of (dF S + F dS) : grad v``, ``dF = grad du``; a predicted stress stands for S in the first term."""

    known: list[Any] = [None, None]

    def form(du: Any, v: Any, w: Any) -> Array:
        if known[0] is not du:  # scikit-fem takes all v for one du
            f, df = deformation_gradient(w["u"]), grad(du)
            s = w["predicted"] if "predicted" in w else second_piola(f, w, law)
            known[:] = du, product(df, s) + product(f, second_piola_rate(f, df, w, law))
        return ddot(known[1], grad(v))

    return BilinearForm(form)


def by_length(law: str) -> LinearForm:
    """The force's derivative where the logarithm of each element's length changes by a share.

    Derivatives along the strip are proportional to 1 / length, areas to the length.
    """

    def form(v: Any, w: Any) -> Array:
        f = deformation_gradient(w["u"])
        s, df = second_piola(f, w, law), np.zeros_like(f)
        df[:, 0] = -grad(w["u"])[:, 0]
        rate = product(df, s) + product(f, second_piola_rate(f, df, w, law))
        return w["share"] * (ddot(rate, grad(v)) + dot(product(f, s)[:, 1], grad(v)[:, 1]))

    return LinearForm(form)


@BilinearForm
def inertia(u: Any, v: Any, w: Any) -> Array:
    """``integral of rho u . v``."""
    return w["rho"] * dot(u, v)


@LinearForm
def gravity(v: Any, w: Any) -> Array:
    """``integral of rho v_z``: what holds the strip up."""
    return w["rho"] * v[1]


@dataclass(frozen=True)
class Reference(Solid):
    """A strip by these forms; make it with :meth:`of`.  It is no subject of motions in time, and of no effects.

    ``order``: 1 or 2: bilinear or biquadratic.  ``across``: elements across the thickness.  ``law``: one of
    :data:`LAWS`.  ``distort``: map of the mesh's points, shape (2, n) to (2, n).
    """

    order: int = 2
    across: int = 1
    law: str = "svk"
    distort: Callable[[Array], Array] | None = field(default=None, repr=False)

    @classmethod
    def of(  # type: ignore[override]
        cls,
        length: float,
        thickness: float,
        *,
        nu: float = 0.0,
        elements: int | Array = 200,
        order: int = 2,
        across: int = 1,
        law: str = "svk",
        distort: Callable[[Array], Array] | None = None,
    ) -> Reference:
        """Discretise a strip that lies from x = -length/2 (grasped) to +length/2 (held), |z| <= thickness/2.

        Raises InvalidInputError: order, counts, ends or a map that cannot be used.
        """
        if order not in (1, 2):
            raise InvalidInputError("order", order, "1 or 2")
        if across not in (1, 2) or order * across % 2:
            why = "the mid-surface needs a row of nodes of its own"
            raise InvalidInputError("elements_across", across, "2, or 1 with order 2", why)
        new = cls(length, thickness, nu, lengths_of(length, elements), order, across, law, distort)
        # Quadrature weights are absolute values: an element inside out would count as if nothing were wrong.
        if distort is not None and np.ptp(np.sign(new.basis.mapping.detDF(CORNERS))) > 0.0:
            raise InvalidInputError("distort", distort, "a map that turns no part of an element inside out")
        return new

    def with_lengths(self, lengths: Array) -> Reference:
        return Reference(self.length, self.thickness, self.nu, lengths, self.order, self.across, self.law)

    @property
    def _numbering(self) -> tuple[Index, Index, BandPattern]:
        return numbering(len(self.lengths), self.order, self.across)

    def _basis(self, points: int) -> skfem.Basis:
        """A basis with this number of Gauss points along an element."""
        levels = np.linspace(-0.5, 0.5, self.across + 1) * self.thickness
        mesh = skfem.MeshQuad.init_tensor(self.ends - self.ends[-1] / 2.0, levels)
        if self.distort is not None:
            mesh = skfem.MeshQuad(self.distort(mesh.p), mesh.t)
        element = skfem.ElementVector({1: skfem.ElementQuad1, 2: skfem.ElementQuad2}[self.order]())
        # The first local axis of scikit-fem's tensor mesh runs across the strip, the second along it.
        (x, wx), (z, wz) = gauss(points), gauss(self.order + 1)
        rule = np.stack([np.tile(z, len(x)), np.repeat(x, len(z))]), np.outer(wx, wz).ravel()
        return skfem.Basis(mesh, element, quadrature=rule)

    @cached_property
    def basis(self) -> skfem.Basis:
        """With one Gauss point fewer along the strip than for full integration: no membrane locking."""
        return self._basis(self.order)

    @cached_property
    def full(self) -> skfem.Basis:
        """With full integration, for mass and weight."""
        return self._basis(self.order + 1)

    @cached_property
    def nodal_of(self) -> Index:
        """scikit-fem's number of the nodal displacement that sits at each of our unknowns, shape (size,)."""
        straight = self if self.distort is None else self.with_lengths(self.lengths)
        (x, z), component = straight.basis.doflocs, np.zeros(self.size, dtype=int)
        for dofs in (self.basis.nodal_dofs, self.basis.facet_dofs, self.basis.interior_dofs):
            component[dofs[1::2]] = 1
        # Equal columns differ by rounding only: compare them on a grid much finer than any element.
        column = np.unique(np.round(x / np.ptp(x) * 1e10), return_inverse=True)[1]
        return np.lexsort((component, z, column))

    @cached_property
    def transformation(self) -> Any:
        """Sparse matrix T of the nodal displacements, u = T q: a force is ``T^T f`` in our unknowns."""
        from scipy.sparse import coo_matrix

        unknowns, middle = self.unknowns, np.repeat(self.middle[:, None], self.unknowns.shape[1], axis=1)
        own = np.where(unknowns == middle, 0.0, self.thickness)
        rows = np.tile(self.nodal_of[unknowns.ravel()], 2)
        columns = np.concatenate([unknowns.ravel(), middle.ravel()])
        values = np.concatenate([own.ravel(), np.ones(self.size)])
        return coo_matrix((values, (rows, columns)), shape=(self.size, self.size)).tocsc()

    def _fields(self, q: Array) -> dict[str, Any]:
        lam, mu = self.lame
        return {"u": self.basis.interpolate(self.transformation @ q), "lam": lam, "mu": mu}

    def _band(self, nodal: Any) -> Band:
        """A matrix of nodal displacements in our unknowns."""
        entries, band = (self.transformation.T @ nodal @ self.transformation).tocoo(), self.pattern
        out = Band.zeros(band.size, band.width)
        out.columns[entries.col, band.width + entries.row - entries.col] = entries.data
        return out

    @cached_property
    def mass(self) -> Band:
        return self._band(inertia.assemble(self.full, rho=1.0 / self.thickness))

    def weighted(self, share: Array) -> Array:
        of_elements = np.repeat(share, self.across)[:, None] / self.thickness
        rho = DiscreteField(np.broadcast_to(of_elements, self.full.dx.shape))
        return np.asarray(self.transformation.T @ gravity.assemble(self.full, rho=rho))

    def weighted_rate(self, share: Array) -> Array:
        return self.weighted(share)

    def energy(self, q: Array) -> float:
        """Elastic energy; nan for the printed law, which has none."""
        return float(energy.assemble(self.basis, **self._fields(q))) if self.law == "svk" else np.nan

    def _least_strain(self, q: Array) -> float:
        (along, shear), (_, across) = green_lagrange(deformation_gradient(self._fields(q)["u"]))
        return float((0.5 * (along + across) - np.hypot(0.5 * (along - across), shear)).min())

    def predict_stress(self, q: Array, dq: Array, growth: Array = NO_GROWTH) -> Array:
        """As :meth:`.Model.predict_stress`; shape (2, 2, n_elements, n_quadrature).  Not used with the printed law."""
        fields = self._fields(q)
        f, df = deformation_gradient(fields["u"]), np.array(grad(self.basis.interpolate(self.transformation @ dq)))
        if len(growth):
            df[:, 0] -= np.repeat(growth, self.across)[:, None] * (f - eye(np.ones(f.shape[2:]), 2))[:, 0]
        half = product(transpose(f), df)
        return c_of(green_lagrange(f) + 0.5 * (half + transpose(half)), fields)

    def resampled_stress(self, q: Array, other: Any) -> Array:
        """That of the resampled state: elements of other orders have no points of Gauss's where they are accurate."""
        return np.asarray(other.predict_stress(self.resampled(q, other.s), np.zeros(other.size)))

    def _assemble(
        self,
        q0: Array,
        q1: Array,
        kappa: float,
        in_state: bool,
        stress: Array | None,
        with_tangent: bool,
        growth: Array = NONE,
    ) -> tuple[Array, Any, Array]:
        if not in_state:
            raise InvalidInputError("model", "reference", "solid or rod", "the reference does not move in time")
        fields, back = self._fields(q1), self.transformation.T
        internal = back @ force(self.law).assemble(self.basis, **fields)
        if not with_tangent:
            return internal, None, np.zeros((self.size, 0))
        predicted = {} if stress is None or self.law != "svk" else {"predicted": DiscreteField(stress)}
        stiffness = self._band(tangent(self.law).assemble(self.basis, **fields, **predicted))
        shares = [np.repeat(share, self.across)[:, None] + np.zeros_like(self.basis.dx) for share in growth]
        forms = [by_length(self.law).assemble(self.basis, **fields, share=DiscreteField(share)) for share in shares]
        return internal, stiffness, np.array([back @ each for each in forms]).T.reshape(self.size, -1)

    @property
    def directors(self) -> Directors:
        raise InvalidInputError(
            "model", "reference", "solid or rod", "the reference has no effects and no second contact"
        )

"""A strip's mesh in scikit-fem's numbering: its bases, and nodal displacements from our unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem

from stripfold.arrays import Array, Index
from stripfold.models.strip_mesh import StripMesh


@dataclass(frozen=True, eq=False)
class Nodal:
    """The same mesh, made by scikit-fem."""

    mesh: StripMesh

    @cached_property
    def _bases(self) -> tuple[skfem.Basis, skfem.Basis, Index]:
        """With the reduced and the full rule, and scikit-fem's numbers of our unknowns."""
        ends, thickness, order, across = self.mesh.ends, self.mesh.thickness, self.mesh.order, self.mesh.across
        levels = np.linspace(-thickness / 2.0, thickness / 2.0, across + 1)
        mesh = skfem.MeshQuad.init_tensor(ends - ends[-1] / 2.0, levels)
        elements = {1: skfem.ElementQuad1, 2: skfem.ElementQuad2}
        element, rule = skfem.ElementVector(elements[order]()), _tensor_rule(order, order + 1)
        basis = skfem.Basis(mesh, element, quadrature=rule)
        nodal_of = _number(basis)
        if self.mesh.distort is not None:
            basis = skfem.Basis(skfem.MeshQuad(self.mesh.distort(mesh.p), mesh.t), element, quadrature=rule)
        return basis, skfem.Basis(basis.mesh, element, quadrature=_tensor_rule(order + 1, order + 1)), nodal_of

    @property
    def basis(self) -> skfem.Basis:
        """scikit-fem basis (vector-valued) in scikit-fem's own numbering."""
        return self._bases[0]

    @property
    def full(self) -> skfem.Basis:
        """With a full rule."""
        return self._bases[1]

    @property
    def nodal_of(self) -> Index:
        """Shape (n_unknowns,): scikit-fem's number of the nodal displacement that sits at each of our unknowns."""
        return self._bases[2]

    def displacements(self, q: Array) -> Array:
        """Nodal displacements in scikit-fem's numbering, shape (n,), from the unknowns ``q``, shape (n,)."""
        unknowns = self.mesh.unknowns
        middle, columns = unknowns.shape[1] // 2, q[unknowns]
        nodal = columns[:, middle, None, :] + self.mesh.thickness * columns
        nodal[:, middle, :] = columns[:, middle, :]
        out = np.empty_like(q)
        out[self.nodal_of[unknowns]] = nodal
        return out

    def transformation(self) -> Array:
        """The matrix T of :meth:`displacements`, shape (n, n): a nodal force is ``T^T f`` in our unknowns."""
        return np.column_stack([self.displacements(e) for e in np.eye(self.mesh.size)])


def _tensor_rule(along: int, across: int) -> tuple[Array, Array]:
    """Gauss rule on the unit square with different counts along and across the strip."""
    x, wx = np.polynomial.legendre.leggauss(along)
    z, wz = np.polynomial.legendre.leggauss(across)
    # scikit-fem's tensor mesh runs its elements' first local axis across the strip (z), the second along it (x).
    points = np.stack([np.tile((z + 1) / 2, along), np.repeat((x + 1) / 2, across)])
    return points, np.tile(wz / 2, along) * np.repeat(wx / 2, across)


def _number(basis: skfem.Basis) -> Index:
    """Scikit-fem's numbers of our unknowns, which are numbered by column, node, component."""
    x, z = basis.doflocs
    component = np.zeros(len(x), dtype=int)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        if dofs.size:
            component[dofs[1]] = 1
    # Equal columns differ by rounding only: compare them on a grid much finer than any element.
    column = np.unique(np.round(x / np.ptp(x) * 1e10), return_inverse=True)[1]
    return np.lexsort((component, z, column))

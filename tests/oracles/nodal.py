"""A strip's mesh in scikit-fem's numbering: its bases, and nodal displacements from our unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem

from stripfold.base.arrays import Array, Index
from stripfold.strip import element_integrals
from stripfold.strip.strip_mesh import StripMesh


@dataclass(frozen=True, eq=False)
class Nodal:
    """The same mesh, made by scikit-fem."""

    mesh: StripMesh

    @cached_property
    def _bases(self) -> tuple[skfem.Basis, skfem.Basis, Index]:
        mesh = self.mesh
        return element_integrals.bases(mesh.ends, mesh.thickness, mesh.order, mesh.across, mesh.distort)

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

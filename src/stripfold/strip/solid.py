"""The strip as a two-dimensional nonlinear solid: the paper's finite-element model.

Holds no algorithm: from the unknowns it gives energy, internal force, tangent, mass and mid-surface.  Units: lengths
in L*, forces per width in rho_a g L* (``docs/physics.md``, section 1); the bending stiffness is then one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band, BandPattern
from stripfold.strip import laws
from stripfold.strip.directors import Directors
from stripfold.strip.model import Model
from stripfold.strip.strip_mesh import StripMesh, build, numbering

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements


@dataclass(frozen=True)
class Solid(Model):
    """A strip of St Venant-Kirchhoff material; make it with :meth:`of`.

    The unknowns ``q``, shape (size,), are described in :mod:`stripfold.strip.strip_mesh`.
    """

    mesh: StripMesh
    length: float
    thickness: float
    nu: float
    law: laws.Law
    lame: laws.Lame
    pattern: BandPattern = field(repr=False)

    @classmethod
    def of(
        cls,
        length: float,
        thickness: float,
        *,
        nu: float = 0.0,
        order: int = 2,
        elements: int | Array = 200,
        across: int = 1,
        law: str = "svk",
        distort: Callable[[Array], Array] | None = None,
    ) -> Solid:
        """Discretise a strip; lengths in L*, ``law`` "svk" or "printed".  See :func:`.strip_mesh.build`."""
        mesh = build(length, thickness, order=order, elements=elements, across=across, distort=distort)
        # Bending stiffness E h^3 / 12 (1 - nu^2) = 1 in these units.
        young = 12.0 * (1.0 - nu**2) / thickness**3
        pattern = numbering(len(mesh.ends) - 1, order, across)[2]
        return cls(mesh, length, thickness, nu, laws.LAWS[law], laws.Lame.from_young(young, nu), pattern)

    def with_ends(self, ends: Array) -> Solid:
        """See :meth:`.Model.with_ends`; for straight meshes."""
        mesh = self.mesh.stretched(ends)
        return Solid(mesh, self.length, self.thickness, self.nu, self.law, self.lame, self.pattern)

    @property
    def slopes(self) -> None:
        return None

    @cached_property
    def mass(self) -> Band:
        density = self.mesh.lengths / self.thickness
        return self.pattern.assemble(density[:, None, None] * self.mesh.unit_mass)

    def mass_rate(self, q: Array) -> Array:
        density = self.mesh.lengths / self.thickness
        local = q[self.mesh.element_unknowns][:, None, :]
        return np.asarray(density[:, None] * np.matmul(local, self.mesh.unit_mass)[:, 0])

    @cached_property
    def element_weight(self) -> Array:
        density = self.mesh.lengths / self.thickness
        return np.asarray(density[:, None] * self.mesh.unit_weight)

    @property
    def weight_rate(self) -> Array:
        return self.element_weight

    @property
    def size(self) -> int:
        return self.mesh.size

    @property
    def element_unknowns(self) -> Index:
        return self.mesh.element_unknowns

    @cached_property
    def middle(self) -> Index:
        return self.mesh.middle

    @property
    def s(self) -> Array:
        return self.mesh.s

    @property
    def ends(self) -> Array:
        return self.mesh.ends

    @property
    def directors(self) -> Directors:
        """The sections at the ends of each element."""
        return Directors.of(self.mesh)

    @cached_property
    def gradient_t(self) -> Array:
        """The displacement gradient's matrix, shape (n_elements, 4 n_quadrature, n_local).

        A row is a quadrature point and a component pair iJ, a column a local unknown.
        """
        n_el, n_q, _, nodes = self.mesh.gradients.shape
        gradient = np.zeros((n_el, n_q, 2, 2, nodes, 2))
        for i in range(2):
            gradient[:, :, i, :, :, i] = self.mesh.gradients
        return gradient.reshape(n_el, n_q * 4, 2 * nodes)

    def deformation_gradient(self, q: Array) -> Array:
        """``F = I + grad u`` at the quadrature points, shape (n_elements, n_quadrature, 2, 2)."""
        local = q[self.mesh.element_unknowns]
        n_el, n_q = self.mesh.weights.shape
        f = np.matmul(self.gradient_t, local[:, :, None]).reshape(n_el, n_q, 2, 2)
        f[..., 0, 0] += 1.0
        f[..., 1, 1] += 1.0
        return f

    @cached_property
    def elements(self) -> Elements:
        shape, unknowns = self.mesh.gradients, self.mesh.element_unknowns
        missing, n_q = kernels.solid.NODES - shape.shape[3], shape.shape[1]
        if missing:
            shape = np.pad(shape, ((0, 0), (0, kernels.solid.POINTS - n_q), (0, 0), (0, missing)))
            unknowns = np.pad(unknowns, ((0, 0), (0, 2 * missing)), mode="edge")
        weights, none = self.mesh.weights, np.zeros(0)
        return kernels.elements.Elements(
            False, unknowns, np.ascontiguousarray(shape), none[:, None], weights, none, self.lame.lam, self.lame.mu
        )

    @property
    def has_energy(self) -> bool:
        return self.law.energy is not None

    @property
    def stress_shape(self) -> tuple[int, ...]:
        """Shape of a second Piola-Kirchhoff stress at the quadrature points."""
        return (*self.mesh.weights.shape, 2, 2)

    def admissibility(self, q: Array) -> str:
        """Not empty where an element is inverted: the law has such equilibria."""
        least = kernels.elements.least(self.elements, np.ascontiguousarray(q))
        return "" if least > 0.0 else f"the strip is turned inside out: its volume changes by a factor of {least:.2g}"

    def energy(self, q: Array) -> float:
        return super().energy(q) if self.has_energy else float("nan")

    def internal_force(self, q: Array) -> Array:
        if self.has_energy:
            return super().internal_force(q)
        return self._scatter(self.law.stress(self.deformation_gradient(q), self.lame))

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        if self.has_energy:
            return super().force_and_tangent(q, predicted_stress)
        f = self.deformation_gradient(q)
        tangent = self.law.tangent(f, self.lame, predicted_stress)
        return self._scatter(self.law.stress(f, self.lame)), self._from_points(tangent)

    def force_and_derivatives(
        self, q: Array, growth: Array, predicted_stress: Array | None = None
    ) -> tuple[Array, Band, Array]:
        if self.has_energy:
            return super().force_and_derivatives(q, growth, predicted_stress)
        f = self.deformation_gradient(q)
        force, tangent = self.force_and_tangent(q)
        # Derivatives along the strip are proportional to 1 / length, the weights to the length.
        rate = -np.einsum("...ijk,...k->...ij", self.law.tangent(f, self.lame, None)[..., 0], f[..., 0] - [1.0, 0.0])
        rate[..., 1] += self.law.stress(f, self.lame)[..., 1]
        columns = [self._scatter(share[:, None, None, None] * rate) for share in growth]
        return force, tangent, np.stack(columns, axis=1)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        """See :meth:`.Model.force_over_step`; ValueError for a law that has no energy."""
        if not self.has_energy:
            raise ValueError(f"the law {self.law.name!r} has no energy that a time step could conserve")
        return super().force_over_step(q0, q1, kappa, predicted_stress)

    def resampled_stress(self, q: Array, other: Solid) -> Array:
        stress = self.predict_stress(q, np.zeros(self.size))
        along = (len(self.s) - 1) // (len(self.ends) - 1)
        gauss = 0.5 * np.polynomial.legendre.leggauss(along)[0] + 0.5
        at, new_at = ((ends[:-1, None] + np.diff(ends)[:, None] * gauss).ravel() for ends in (self.ends, other.ends))
        # Points run along the strip, and at each place across it.
        by_place = stress.reshape(len(self.ends) - 1, -1, along, stress.shape[1] // along * 4)
        rows = by_place.transpose(1, 0, 2, 3).reshape(by_place.shape[1], len(at), -1)
        moved = np.stack([[np.interp(new_at, at, column) for column in row.T] for row in rows])
        moved = moved.transpose(2, 0, 1).reshape(len(other.ends) - 1, along, len(rows), -1).transpose(0, 2, 1, 3)
        return np.ascontiguousarray(moved).reshape(-1, *stress.shape[1:])

    @cached_property
    def _weighted(self) -> Array:
        """The gradient's matrix times the quadrature weights, shape (n_elements, n_local, 4 n_quadrature)."""
        weights = np.repeat(self.mesh.weights, 4, axis=1)
        return np.ascontiguousarray((weights[:, :, None] * self.gradient_t).transpose(0, 2, 1))

    def _from_points(self, stress_rate: Array) -> Band:
        n_el, n_q = self.mesh.weights.shape
        n_loc = self.gradient_t.shape[2]
        a = stress_rate.reshape(n_el, n_q, 4, 4)
        column = np.matmul(a, self.gradient_t.reshape(n_el, n_q, 4, n_loc)).reshape(n_el, n_q * 4, n_loc)
        return self.pattern.assemble(np.matmul(self._weighted, column))

    def _scatter(self, stress: Array) -> Array:
        n_el, n_q = self.mesh.weights.shape
        local = np.matmul(self._weighted, stress.reshape(n_el, n_q * 4, 1))[:, :, 0]
        return np.asarray(np.bincount(self.mesh.element_unknowns.ravel(), local.ravel(), minlength=self.size), float)

    def resampled(self, q: Array, s: Array) -> Array:
        ends = self.ends
        order = (len(self.s) - 1) // (len(ends) - 1)
        e = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(ends) - 2)
        t = (s - ends[e]) / (ends[e + 1] - ends[e])
        value = (
            np.stack([1.0 - t, t])
            if order == 1
            else np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
        )
        columns = q[self.mesh.unknowns].reshape(len(self.s), -1)
        # The unknowns are numbered by column.
        return np.asarray(np.einsum("ae,aei->ei", value, columns[order * e + np.arange(order + 1)[:, None]])).ravel()

    def unknowns_of(self, position: Array, angle: Array) -> Array:
        q = np.zeros(self.size)
        offset = np.linspace(-0.5, 0.5, self.mesh.unknowns.shape[1])
        normal = np.stack([-np.sin(angle), np.cos(angle) - 1.0], axis=1)
        q[self.mesh.unknowns] = offset[None, :, None] * normal[:, None, :]
        q[self.middle] = position
        q[self.middle[:, 0]] -= self.s - self.length / 2.0
        return q

"""The protocol of a discretised strip.

Units: lengths in L*, forces per width in rho_a g L* (``docs/physics.md``, section 1): the bending stiffness is one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.models.directors import Directors
from stripfold.solve.linear import Band, BandPattern

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements


class Model(Protocol):
    """A strip, straight and unstressed at ``q = 0``, held at one end and grasped at the other; no algorithm inside.

    Its strains are quadratic in the unknowns ``q``, shape (size,).  Models are frozen.
    """

    @property
    def length(self) -> float:
        """Length of the strip, L*."""
        ...

    @property
    def thickness(self) -> float:
        """Thickness h of the strip, L*."""
        ...

    @property
    def size(self) -> int:
        """Number of unknowns."""
        ...

    @property
    def middle(self) -> Index:
        """Shape (columns, 2): unknowns that are the mid-surface's displacement, from the grasped to the held end."""
        ...

    @property
    def s(self) -> Array:
        """Shape (columns,): reference distance of the mid-surface nodes from the grasped end, L*."""
        ...

    @property
    def ends(self) -> Array:
        """Shape (n_elements + 1,): reference distance of the elements' ends from the grasped end, L*."""
        ...

    @property
    def mass(self) -> Band:
        """Consistent mass matrix, one per length."""
        ...

    def mass_rate(self, q: Array) -> Array:
        """Derivative of each element's share in ``mass @ q`` by the logarithm of its length, (n_elements, n_local)."""
        ...

    @property
    def weight(self) -> Array:
        """Force of gravity with its sign turned, shape (size,)."""
        ...

    @property
    def element_unknowns(self) -> Index:
        """Unknowns of each element, shape (n_elements, n_local)."""
        ...

    @property
    def element_weight(self) -> Array:
        """Force of gravity on each element with its sign turned, shape (n_elements, n_local)."""
        ...

    @property
    def weight_rate(self) -> Array:
        """Derivative of ``element_weight`` by the logarithm of the element's length."""
        ...

    @property
    def slopes(self) -> Index | None:
        """The unknown of each column that is the slope's z component, None where slopes are no unknowns."""
        ...

    def with_ends(self, ends: Array) -> Self:
        """The same strip with as many elements that end elsewhere, shape (n_elements + 1,)."""
        ...

    def resampled(self, q: Array, s: Array) -> Array:
        """The unknowns of the same shape on columns at the distances ``s`` from the grasped end."""
        ...

    @property
    def pattern(self) -> BandPattern:
        """Where entries of element matrices go."""
        ...

    @property
    def elements(self) -> Elements:
        """Arrays for the compiled integrals."""
        ...

    @property
    def has_energy(self) -> bool:
        """Whether the law has an energy, which a motion in time needs."""
        ...

    @property
    def directors(self) -> Directors:
        """The bend of each element."""
        ...

    def energy(self, q: Array) -> float:
        """Elastic energy; nan for a law that has none."""
        ...

    def internal_force(self, q: Array) -> Array:
        """Internal force, shape (size,)."""
        ...

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        """Internal force and its derivative; the latter with ``predicted_stress``: :meth:`predict_stress`."""
        ...

    def force_and_derivatives(
        self, q: Array, growth: Array, predicted_stress: Array | None = None
    ) -> tuple[Array, Band, Array]:
        """Internal force and its derivatives; see :meth:`.CompiledIntegrals.force_and_derivatives`."""
        ...

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        """Internal force over a time step and its derivative by ``q1``: the energy-momentum method.

        Its work is the gain of elastic energy plus ``kappa`` times :meth:`strain_distance`, exactly.
        """
        ...

    def strain_distance(self, q0: Array, q1: Array) -> float:
        """Squared distance of two states in strain, weighted with the stiffness."""
        ...

    def predict_stress(self, q: Array, dq: Array, growth: Array = ...) -> Array:
        """Stress at ``q + dq`` from the strain linearised at ``q``; see :meth:`.CompiledIntegrals.predict_stress`."""
        ...

    def resampled_stress(self, q: Array, other: Self) -> Array:
        """The stress in a state, for :meth:`predict_stress`, at the places of the elements of ``other``."""
        ...

    def admissibility(self, q: Array) -> str:
        """Why ``q`` is inadmissible whatever its forces, in words; empty for an admissible state."""
        ...

    def mid_surface(self, q: Array) -> Array:
        """Positions of the mid-surface nodes, shape (columns, 2), in the paper's frame (origin mid-strip)."""
        ...

    def resampled_mid_surface(self, q: Array, s: Array) -> Array:
        """Places of the mid-surface at the distances ``s`` from the grasped end, shape (len(s), 2), in that frame."""
        ...

    def largest_move(self, q0: Array, q1: Array) -> float:
        """Largest distance between the places of one mid-surface node in two states, L*."""
        ...

    def unknowns_of(self, position: Array, angle: Array) -> Array:
        """Unknowns of a strip bent to a given mid-surface, sections normal and unstretched.

        Parameters
        ----------
        position
            Mid-surface positions, shape (columns, 2).
        angle
            Angle of the material direction +x with the x axis, rad, shape (columns,).
        """
        ...


class OnNodes:
    """Quantities that depend on the mid-surface nodes only."""

    def mid_surface(self: Model, q: Array) -> Array:
        """Positions of the mid-surface nodes, shape (columns, 2), in the paper's frame (origin mid-strip)."""
        position = q[self.middle]
        position[:, 0] += self.s - self.length / 2.0
        return position

    def resampled_mid_surface(self: Model, q: Array, s: Array) -> Array:
        """Places of the mid-surface at the distances ``s`` from the grasped end, shape (len(s), 2)."""
        per_column = self.size // len(self.s)
        place = self.resampled(q, s).reshape(len(s), -1)[:, self.middle[0] % per_column]
        return place + np.stack([s - self.length / 2.0, np.zeros_like(s)], axis=1)

    def largest_move(self: Model, q0: Array, q1: Array) -> float:
        """Largest distance between the places of one mid-surface node in two states, L*."""
        x, z = (q1 - q0)[self.middle.T]
        return float(np.sqrt((x * x + z * z).max()))

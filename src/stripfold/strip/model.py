"""A discretised strip: what its models have in common, and what each says of itself.

Units: lengths in L*, forces per width in rho_a g L* (``docs/physics.md``, section 1): the bending stiffness is one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, ByFields, Index
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import Band, BandPattern

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements
    from stripfold.strip.effects import Directors

NONE, NO_GROWTH = np.zeros((0, 0)), np.zeros(0)
"""Predicted stresses and growths of elements where there are none."""


class Model(ByFields, ABC):
    """A strip, straight and unstressed at ``q = 0``, held at one end and grasped at the other; no algorithm inside.

    Its strains are quadratic in the unknowns ``q``, shape (size,).  Models are frozen.  Integrals over the elements are
    those of :mod:`stripfold.kernels.elements`.

    ``length``, ``thickness``: length and thickness h of the strip, L*.  ``pattern``: where entries of element matrices
    go.  ``s``: shape (columns,): reference distance of the mid-surface nodes from the grasped end, L*.
    ``element_unknowns``: unknowns of each element, shape (n_elements, n_local).
    """

    length: float
    thickness: float

    if TYPE_CHECKING:  # fields of some models, which a property here would hide

        @property
        def pattern(self) -> BandPattern: ...

        @property
        def s(self) -> Array: ...

        @property
        def element_unknowns(self) -> Index: ...

        @property
        def curl(self) -> float:
            """Curvature without forces, 1/L*."""

        @property
        def lengths(self) -> Array:
            """Shape (n_elements,): lengths of the elements from the grasped end on, L*."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of unknowns."""

    @property
    @abstractmethod
    def middle(self) -> Index:
        """Shape (columns, 2): unknowns that are the mid-surface's displacement, from the grasped to the held end."""

    @property
    @abstractmethod
    def mass(self) -> Band:
        """Consistent mass matrix, one per length."""

    @abstractmethod
    def mass_rate(self, q: Array) -> Array:
        """Derivative of each element's share in ``mass @ q`` by the logarithm of its length, (n_elements, n_local)."""

    @property
    @abstractmethod
    def element_weight(self) -> Array:
        """Force of gravity on each element with its sign turned, shape (n_elements, n_local)."""

    @property
    @abstractmethod
    def weight_rate(self) -> Array:
        """Derivative of ``element_weight`` by the logarithm of the element's length."""

    @property
    @abstractmethod
    def slopes(self) -> Index | None:
        """The unknown of each column that is the slope's z component, which a floor holds too; None without any."""

    @property
    @abstractmethod
    def elements(self) -> Elements:
        """Arrays for the compiled integrals."""

    @property
    @abstractmethod
    def directors(self) -> Directors:
        """The bend of each element."""

    @abstractmethod
    def with_lengths(self, lengths: Array) -> Self:
        """The same strip with as many elements of other lengths, shape (n_elements,)."""

    @abstractmethod
    def resampled(self, q: Array, s: Array) -> Array:
        """The unknowns of the same shape on columns at the distances ``s`` from the grasped end."""

    @abstractmethod
    def resampled_stress(self, q: Array, other: Self) -> Array:
        """The stress in a state, for :meth:`predict_stress`, at the places of the elements of ``other``."""

    @abstractmethod
    def admissibility(self, q: Array) -> str:
        """Why ``q`` is inadmissible whatever its forces, in words; empty for an admissible state."""

    @abstractmethod
    def unknowns_of(self, position: Array, angle: Array) -> Array:
        """Unknowns of a strip bent to a given mid-surface, sections normal and unstretched.

        ``position``, shape (columns, 2), is that of the mid-surface; ``angle``, shape (columns,), rad, that of the
        material direction +x with the x axis.
        """

    @property
    @abstractmethod
    def stress_shape(self) -> tuple[int, ...]:
        """Shape of a predicted stress."""

    @cached_property
    def ends(self) -> Array:
        """Shape (n_elements + 1,): reference distance of the elements' ends from the grasped end, L*."""
        return np.append(0.0, np.cumsum(self.lengths))

    @cached_property
    def weight(self) -> Array:
        """Force of gravity with its sign turned, shape (size,)."""
        return self.weighted(np.ones(len(self.lengths)))

    def weighted(self, share: Array) -> Array:
        """The weight where that of each element counts by a share, shape (n_elements,)."""
        return self._summed(share[:, None] * self.element_weight)

    def weighted_rate(self, share: Array) -> Array:
        """Derivative of the weight where the logarithm of each element's length changes by a share."""
        return self._summed(share[:, None] * self.weight_rate)

    def _summed(self, of_elements: Array) -> Array:
        return np.asarray(np.bincount(self.element_unknowns.ravel(), of_elements.ravel(), self.size), float)

    def mid_surface(self, q: Array) -> Array:
        """Positions of the mid-surface nodes, shape (columns, 2), in the paper's frame (origin mid-strip)."""
        position = q[self.middle]
        position[:, 0] += self.s - self.length / 2.0
        return position

    def resampled_mid_surface(self, q: Array, s: Array) -> Array:
        """Places of the mid-surface at the distances ``s`` from the grasped end, shape (len(s), 2), in that frame."""
        per_column = self.size // len(self.s)
        place = self.resampled(q, s).reshape(len(s), -1)[:, self.middle[0] % per_column]
        return place + np.stack([s - self.length / 2.0, np.zeros_like(s)], axis=1)

    def largest_move(self, q0: Array, q1: Array) -> float:
        """Largest distance between the places of one mid-surface node in two states, L*."""
        x, z = (q1 - q0)[self.middle.T]
        return float(np.sqrt((x * x + z * z).max()))

    def energy(self, q: Array) -> float:
        """Elastic energy, over that of the flat strip."""
        elements, q = self.elements, _vector(q)
        stored = 0.5 * kernels.elements.distance(elements, np.zeros(self.size), q, False)
        return float(stored + kernels.elements.rest_energy(elements, q))

    def strain_distance(self, q0: Array, q1: Array) -> float:
        """Squared distance of two states in strain, weighted with the stiffness: of two that differ by a turn, none."""
        return float(kernels.elements.distance(self.elements, _vector(q0), _vector(q1), True))

    def internal_force(self, q: Array) -> Array:
        """Internal force, shape (size,): the energy's derivative."""
        return self._assemble(q, q, 0.0, True, None, False)[0]

    def force_and_tangent(self, q: Array, predicted_stress: Array | None = None) -> tuple[Array, Band]:
        """Internal force and its derivative; the latter with ``predicted_stress``: :meth:`predict_stress`."""
        return self._assemble(q, q, 0.0, True, predicted_stress, True)[:2]

    def force_and_derivatives(
        self, q: Array, growth: Array, predicted_stress: Array | None = None
    ) -> tuple[Array, Band, Array]:
        """Internal force and its derivatives by the unknowns and by the elements' lengths, the unknowns fixed.

        The change of the stress with the lengths is that of the strain, also beside a predicted stress.

        ``q``, ``predicted_stress``: as in :meth:`force_and_tangent`; ``growth``: derivatives of the logarithm of each
        element's length by k parameters, shape (k, n_elements).

        Returns ``force``, ``tangent``, ``columns``: shape (n,), the tangent, and shape (n, k).
        """
        return self._assemble(q, q, 0.0, True, predicted_stress, True, growth)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band]:
        """Internal force over a time step and its derivative by ``q1``: the energy-momentum method.

        The stress is ``C : ((E_0 + E_1)/2 + kappa (E_1 - E_0))``, E the strain, with the strain's derivative in the
        mean state.  Its work over the step is the gain of elastic energy, exactly, and ``kappa`` times the squared
        ``C``-norm of ``E_1 - E_0``, which is lost (Simo and Tarnow, 1992).  Not symmetric.
        """
        return self._assemble(q0, q1, kappa, False, predicted_stress, True)[:2]

    def predict_stress(self, q: Array, dq: Array, growth: Array = NO_GROWTH) -> Array:
        """Stress at ``q + dq`` by the strain linearised at ``q``, in elements that are longer by a share ``growth``.

        In a thin strip a Newton step that bends it also stretches it, by the square of the step; the geometric
        stiffness of that spurious stress slows convergence.  With this stress in the next tangent, steps can be many
        times longer; the equilibrium is the same (mixed integration points: Magisano, Leonetti, Garcea, 2017).
        """
        stress = kernels.elements.predict(self.elements, _vector(q), _vector(dq), growth)
        return np.asarray(stress.reshape(self.stress_shape))

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
        n, width = self.size, self.pattern.width
        columns = np.zeros((len(growth), n))
        force, tangent = np.zeros(n), Band.zeros(n if with_tangent else 0, width)
        given = NONE if stress is None else np.ascontiguousarray(stress, float).reshape(len(stress), -1)
        kernels.elements.assemble(
            self.elements,
            _vector(q0),
            _vector(q1),
            kappa,
            in_state,
            given,
            force,
            tangent.columns,
            width,
            growth,
            columns,
        )
        return force, tangent, columns.T


def _vector(q: Array) -> Array:
    return np.ascontiguousarray(q, dtype=np.float64)


def lengths_of(length: float, elements: int | Array) -> Array:
    """Lengths of a number of elements, or of those with these ends; raises InvalidInputError: they cannot be used."""
    ends = np.linspace(0.0, length, elements + 1) if np.ndim(elements) == 0 else np.asarray(elements, float)
    if len(ends) < 4 or np.any((lengths := np.diff(ends)) <= 0.0):
        # Fewer make a matrix smaller than its band.
        raise InvalidInputError("elements", elements, "at least 3 elements, boundaries increasing")
    return lengths

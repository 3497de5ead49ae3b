"""What a model integrates over its elements, in compiled code."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stripfold import kernels
from stripfold.arrays import Array
from stripfold.models.model import OnNodes
from stripfold.solve.linear import Band, BandPattern

if TYPE_CHECKING:
    from stripfold.kernels.elements import Elements

NONE, NO_GROWTH = np.zeros((0, 0)), np.zeros(0)
"""Predicted stresses and growths of elements where there are none."""


class CompiledIntegrals(OnNodes):
    """The integrals of :class:`.Model`, which says what they are, by :mod:`stripfold.kernels.elements`."""

    if TYPE_CHECKING:
        pattern: BandPattern

        @property
        def size(self) -> int: ...

        @property
        def elements(self) -> Elements: ...

    @property
    def has_energy(self) -> bool:
        """Whether the law has an energy, which a motion in time needs."""
        return True

    @property
    def stress_shape(self) -> tuple[int, ...]:
        """Shape of a predicted stress."""
        return self.elements.stiffness.shape

    def energy(self, q: Array) -> float:
        """Elastic energy."""
        return 0.5 * float(kernels.elements.distance(self.elements, np.zeros(self.size), _vector(q), False))

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

        Parameters
        ----------
        q, predicted_stress
            As in :meth:`force_and_tangent`.
        growth
            Derivatives of the logarithm of each element's length by k parameters, shape (k, n_elements).

        Returns
        -------
        force, tangent, columns
            Shape (n,), the tangent, and shape (n, k).
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

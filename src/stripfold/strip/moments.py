"""A moment in each element that depends on its mean curvature: bending laws and bending friction."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array
from stripfold.solve.linear import Band
from stripfold.strip.directors import Directors
from stripfold.strip.effect import MovableEffect
from stripfold.strip.model import NONE


class ElementMoments(MovableEffect):
    """What follows from the moment in each element."""

    directors: Directors

    def curvature(self, q: Array) -> Array:
        """Mean curvature of each element (rotation of the sections per reference length), 1/L*, (n_elements,)."""
        return self.directors.turn(q) / self.directors.length

    @abstractmethod
    def _moment(self, curvature: Array) -> tuple[Array, Array]:
        """The section's moment in each element and its derivative, shape (n_elements,) each."""

    @abstractmethod
    def _rate(self, curvature: Array, growth: Array) -> Array:
        """Derivative of the curvature that the moment depends on by k parameters, ``growth`` that of the lengths.

        Shape (k, n_elements): see :meth:`.MovableEffect.add`.
        """

    def force(self, q: Array) -> Array:
        """``sum over elements of moment * length * d kappa / dq``, shape (n,)."""
        force = np.zeros(self.model.size)
        self._add(q, NONE, force, NONE, NONE)
        return force

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        force, tangent = np.zeros(self.model.size), Band.zeros(self.model.size, self.model.pattern.width)
        self._add(q, NONE, force, tangent.columns, NONE)
        return force, tangent

    def add(self, q: Array, growth: Array, force: Array, tangent: Band, columns: Array) -> None:
        self._add(q, growth, force, tangent.columns, columns.T)

    def _add(self, q: Array, growth: Array, force: Array, band: Array, columns: Array) -> None:
        d, curvature = self.directors, self.curvature(q)
        moment, modulus = self._moment(curvature)
        rate = modulus * self._rate(curvature, growth) if len(growth) else NONE
        kernels.bending.assemble(
            d.unknowns, d.factor, d.straight, d.length, np.ascontiguousarray(q), moment, modulus, rate,
            force, band, self.model.pattern.width, columns,
        )  # fmt: skip

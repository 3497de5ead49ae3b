"""History-dependent forces on a strip, and moments that depend on the bend of its elements.

The bend of an element is the angle between the sections at its two ends.  The director of a section is a vector that
turns with it.  In the solid it is the vector across the section per thickness, D = (-sin phi, cos phi) times the
stretch, which is (0, 1) plus the difference of two relative unknowns (:mod:`.solid`).  In the rod it is the tangent,
(1, 0) plus the slopes.  No length of the strip is subtracted from another, so the rounding error of an angle is that of
numbers of order one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Band
from stripfold.strip.model import NONE, Model

Reaction = Callable[[Array], Array]
"""The floor's forces on the strip in a state, rho_a g L*; both of shape (n,)."""


class Effect(ABC):
    """A force that depends on the last accepted state.

    Effects are frozen: evaluation at a trial state does not change them, and :meth:`committed` returns a new one.
    Lengths in L*, forces per width in rho_a g L*.
    """

    model: Model
    step_dependent: ClassVar[bool] = False
    """Whether the force depends on the step size; such a force is not defined for a motion in time."""

    @abstractmethod
    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add the contribution to the residual, minus the force on the strip, and its derivatives.

        ``force``: shape (n,).  ``tangent``: in the model's band; None for the force alone.  ``growth``: derivatives of
        the logarithm of each element's length by k parameters, shape (k, n_elements); ``columns``, shape (k, n): what
        the force's derivatives by them are added to.  The unknowns stay, and so does the memory's place on the strip.
        """

    def force(self, q: Array) -> Array:
        """The contribution alone, shape (n,)."""
        force = np.zeros(self.model.size)
        self.add(q, force)
        return force

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and its derivative, in the model's band."""
        force, tangent = np.zeros(self.model.size), Band.zeros(self.model.size, self.model.pattern.width)
        self.add(q, force, tangent)
        return force, tangent

    @abstractmethod
    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The effect after an accepted step to ``q``."""

    def on(self, before: Model, model: Model) -> Self:
        """The effect with its memory, on ``before``, on other elements of the same strip."""
        raise NotImplementedError(f"{type(self).__name__} stays on its elements")

    def carried_over(self, q: Array, model: Model) -> Self:
        """The effect in a state ``q`` on other elements, where its moments, if any, are held until :meth:`let_go`."""
        return self.on(self.model, model)

    def about_to_slide(self) -> Self:
        """The effect with the tangent of sliding where an element is about to slide."""
        return self

    def let_go(self, q: Array) -> Self:
        """The effect in the state ``q`` found with held moments; they are the same there."""
        return self


@dataclass(frozen=True, eq=False)
class Directors:
    """The directors at both ends of each element; made once per mesh.

    Attributes
    ----------
    unknowns
        Shape (n_elements, 2 ends, n_points, 2 components): the unknowns of an element's directors, left end first.
        The points are the corner nodes from bottom to top in the solid, the slope in the rod.
    factor
        Shape (n_elements, 2 ends, n_points): derivative of the director by them.
    straight
        Shape (2,): the director where all unknowns are zero.
    length
        Shape (n_elements,): reference length, L*.
    """

    unknowns: Index
    factor: Array
    straight: Array
    length: Array

    def turn(self, q: Array) -> Array:
        """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,)."""
        turns = kernels.bending.turns(self.unknowns, self.factor, self.straight, np.ascontiguousarray(q))
        return np.asarray(turns)


class ElementMoments(Effect):
    """A moment in each element that depends on its mean curvature: bending laws and bending friction."""

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

        Shape (k, n_elements): see :meth:`.Effect.add`.
        """

    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add ``sum over elements of moment * length * d kappa / dq``, and its derivatives."""
        d, curvature = self.directors, self.curvature(q)
        moment, modulus = self._moment(curvature)
        rate = modulus * self._rate(curvature, growth) if len(growth) else NONE
        kernels.bending.assemble(
            d.unknowns, d.factor, d.straight, d.length, np.ascontiguousarray(q), moment, modulus, rate,
            force, NONE if tangent is None else tangent.columns, self.model.pattern.width, columns,
        )  # fmt: skip

"""A history-dependent force: what all effects have."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, Self

from stripfold.base.arrays import Array
from stripfold.solve.linear import Band
from stripfold.strip.model import Model

Reaction = Callable[[Array], Array]
"""The floor's forces on the strip in a state, rho_a g L*; both of shape (n,)."""


class Effect(ABC):
    """A force that depends on the last accepted state.

    Effects are frozen: evaluation at a trial state does not change them, and :meth:`committed` returns a new one.
    Lengths in L*, forces per width in rho_a g L*.
    """

    step_dependent: ClassVar[bool] = False
    """Whether the force depends on the step size; such a force is not defined for a motion in time."""

    @abstractmethod
    def force(self, q: Array) -> Array:
        """Contribution to the residual (internal force plus weight), shape (n,): minus the force on the strip."""

    @abstractmethod
    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and its derivative, in the model's band."""

    @abstractmethod
    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The effect after an accepted step to ``q``."""


class MovableEffect(Effect):
    """An effect whose elements move along the strip, ``model``, with its contact."""

    model: Model

    @abstractmethod
    def add(self, q: Array, growth: Array, force: Array, tangent: Band, columns: Array) -> None:
        """Add both, and the force's derivatives by the elements' lengths, to those of the model.

        ``growth``: derivatives of the logarithm of each element's length by k parameters, shape (k, n_elements);
        ``columns``: shape (n, k).  The unknowns stay, and so does the memory's place on the strip.
        """

    @abstractmethod
    def on(self, before: Model, model: Model) -> Self:
        """The effect with its memory, on ``before``, on other elements of the same strip."""

    def carried_over(self, q: Array, model: Model) -> Self:
        """The effect in a state ``q`` on other elements, where its moments, if any, are held until :meth:`let_go`."""
        return self.on(self.model, model)

    def about_to_slide(self) -> Self:
        """The effect with the tangent of sliding where an element is about to slide."""
        return self

    def let_go(self, q: Array) -> Self:
        """The effect in the state ``q`` found with held moments; they are the same there."""
        return self

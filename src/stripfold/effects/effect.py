"""What a problem may ask of an effect."""

from __future__ import annotations

from typing import Protocol, Self

from stripfold.arrays import Array
from stripfold.solve.linear import Band


class Effect(Protocol):
    """A force with a memory, which changes with accepted steps only.

    Effects are frozen: asking for a force at a trial state leaves no trace, :meth:`committed` returns a new effect.
    Lengths in L*, forces per width in rho_a g L*.
    """

    @property
    def needs_steps(self) -> bool:
        """Whether what it does depends on the size of the steps: it then has no motion in time."""
        ...

    def force(self, q: Array) -> Array:
        """What is added to the residual (internal force plus weight), shape (n,): the force on the strip is its
        negative."""
        ...

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and its derivative, in the model's band."""
        ...

    def committed(self, q: Array) -> Self:
        """The effect that remembers ``q`` as its last accepted state."""
        ...

"""The paper's internal friction: a pull towards the last accepted state (docs/physics.md, section 8).

The law depends on the step size: its effect on a branch is meaningful only together with the steps used.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.models.model import Model
from stripfold.solve.linear import Band


@dataclass(frozen=True, eq=False)
class Pull:
    """Adds ``k_f M (q - q_prev)`` to the residual, M the mass matrix of the model.

    Parameters
    ----------
    model
        The strip.
    k_f
        Force per displacement and mass, g/L*; >= 0.
    q_prev
        The last accepted state, shape (model.size,).

    Raises
    ------
    InvalidInputError
        ``k_f`` negative or not finite.
    """

    model: Model = field(repr=False)
    k_f: float
    q_prev: Array = field(repr=False)

    def __post_init__(self) -> None:
        if not 0.0 <= self.k_f < np.inf:
            raise InvalidInputError("k_f", self.k_f, "a finite number >= 0 (g/L*)")

    @property
    def step_dependent(self) -> bool:
        """True."""
        return True

    def force(self, q: Array) -> Array:
        """``k_f M (q - q_prev)``, shape (n,)."""
        return self.k_f * (self.model.mass @ (q - self.q_prev))

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The force and ``k_f M``."""
        return self.force(q), self.model.mass.scaled(self.k_f)

    def on(self, before: Model, model: Model) -> Self:
        """The same pull on other elements of the same strip."""
        return replace(self, model=model, q_prev=before.resampled(self.q_prev, model.s))

    def committed(self, q: Array) -> Self:
        """The pull towards ``q``."""
        return replace(self, q_prev=q.copy())

    def pulling_force(self, q: Array) -> float:
        """``integral of k_f |u - u_prev| ds`` over the mid-surface, rho_a g L*: an upper bound of the resultant."""
        middle = self.model.middle
        displacement = np.linalg.norm((q - self.q_prev)[middle], axis=1)
        # The weights of the mid-surface nodes are the integrals of their shape functions, as in the mass matrix: the
        # bound is exact.
        return self.k_f * float(self.model.weight[middle[:, 1]] @ displacement)

"""The paper's internal friction: a pull towards the last accepted state.

Source: ``docs/physics.md``, section 8.  A step-dependent law: what it does to a branch means nothing without the size
of the steps it was followed with.
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
    """``k_f M (q - q_prev)`` is added to the residual, M the model's mass.

    Parameters
    ----------
    model
        The strip it acts on.
    k_f
        Force per displacement and mass, g/L*; >= 0.
    q_prev
        The last accepted state, shape (model.size,).

    Raises
    ------
    InvalidInputError
        When ``k_f`` is negative or not finite.
    """

    model: Model = field(repr=False)
    k_f: float
    q_prev: Array = field(repr=False)

    def __post_init__(self) -> None:
        if not 0.0 <= self.k_f < np.inf:
            raise InvalidInputError("k_f", self.k_f, "a finite number >= 0 (g/L*)")

    @property
    def needs_steps(self) -> bool:
        """Yes: it pulls towards the last step."""
        return True

    def force(self, q: Array) -> Array:
        """``k_f M (q - q_prev)``, shape (n,)."""
        return self.k_f * (self.model.mass @ (q - self.q_prev))

    def force_and_tangent(self, q: Array) -> tuple[Array, Band]:
        """The same and ``k_f M``."""
        return self.force(q), self.model.mass.scaled(self.k_f)

    def committed(self, q: Array) -> Self:
        """The pull towards ``q``."""
        return replace(self, q_prev=q.copy())

    def pulling_force(self, q: Array) -> float:
        """``integral of k_f |u - u_prev| ds`` over the mid-surface, rho_a g L*: no less than the resultant's size."""
        middle = self.model.middle
        way = np.linalg.norm((q - self.q_prev)[middle], axis=1)
        # The weight on a mid-surface node is the integral of its shape function: the rule that the mass goes by, so
        # that the bound holds exactly.
        return self.k_f * float(self.model.weight[middle[:, 1]] @ way)

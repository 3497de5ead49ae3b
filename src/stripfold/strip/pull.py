"""The paper's internal friction: a pull towards the last accepted state (docs/physics.md, section 8).

The law depends on the step size: its effect on a branch is meaningful only together with the steps used.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import Band
from stripfold.strip.effect import Effect, Reaction
from stripfold.strip.model import NONE, Model

MOVE = 1e-6
"""Of the difference by which the last state is differentiated along the strip, L*."""


@dataclass(frozen=True, eq=False)
class Pull(Effect):
    """Adds ``k_f M (q - q_prev)`` to the residual, M the mass matrix of the model.

    ``model``: the strip.  ``k_f``: force per displacement and mass, g/L*; >= 0.  ``q_prev``: the last accepted state,
    shape (model.size,).  ``before``: of a pull on other elements than those of that state: theirs, and its unknowns on
    them.  Raises InvalidInputError: ``k_f`` negative or not finite.
    """

    model: Model = field(repr=False)
    k_f: float
    q_prev: Array = field(repr=False)
    before: tuple[Model, Array] | None = field(default=None, repr=False)
    step_dependent: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.k_f < np.inf:
            raise InvalidInputError("k_f", self.k_f, "a finite number >= 0 (g/L*)")

    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add ``k_f M (q - q_prev)``, and its derivatives."""
        model, mass = self.model, self.model.mass
        force += self.k_f * (mass @ (q - self.q_prev))
        if tangent is not None:
            tangent.add(mass, self.k_f)
        if not len(growth):
            return
        before, q_prev = self.before or (model, self.q_prev)
        unknowns, stretched = model.element_unknowns, model.mass_rate(q - self.q_prev)
        for share, column in zip(growth, columns, strict=True):
            moves = np.append(0.0, np.cumsum(share * np.diff(model.ends)))
            change = MOVE * np.interp(model.s, model.ends, moves)
            ahead, back = before.resampled(q_prev, np.append(model.s + change, model.s - change)).reshape(2, -1)
            by_length = np.bincount(unknowns.ravel(), (share[:, None] * stretched).ravel(), model.size)
            column += self.k_f * (by_length - mass @ ((ahead - back) / (2.0 * MOVE)))

    def on(self, before: Model, model: Model) -> Self:
        source = self.before or (before, self.q_prev)
        return replace(self, model=model, q_prev=source[0].resampled(source[1], model.s), before=source)

    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The pull towards ``q``."""
        return replace(self, q_prev=q.copy(), before=None)

    def pulling_force(self, q: Array) -> float:
        """``integral of k_f |u - u_prev| ds`` over the mid-surface, rho_a g L*: an upper bound of the resultant."""
        middle = self.model.middle
        displacement = np.linalg.norm((q - self.q_prev)[middle], axis=1)
        # The weights of the mid-surface nodes are the integrals of their shape functions, as in the mass matrix: the
        # bound is exact.
        return self.k_f * float(self.model.weight[middle[:, 1]] @ displacement)

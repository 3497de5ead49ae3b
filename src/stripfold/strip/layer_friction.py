"""Coulomb friction between the layers and on the floor, stick and slip (docs/physics.md, section 8).

Each mid-surface node on the floor, or on the lower layer that lies there, has a spring in series with a slider along x,
as :class:`.Hysteresis` has in each element.  The slider holds up to mu times the node's normal reaction in the last
accepted state, which with shorter steps becomes the present one: within a step the law has a potential and the tangent
is symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.solve.linear import Band
from stripfold.strip.effects import STICK_TOLERANCE, Effect, Reaction
from stripfold.strip.model import NONE, Model

SPRING = 1e4
"""Stiffness of the springs, rho_a g per L* of displacement and of strip.

A layer under its own weight slips after mu 1e-4 L*; membranes of a strip of h = 0.1 L* are as stiff over a tenth of L*.
"""


@dataclass(frozen=True, eq=False)
class LayerFriction(Effect):
    """Friction of the nodes that lie; see :meth:`of`.

    Attributes
    ----------
    mu
        Coefficient of friction.
    stiffness
        Of each node's spring, rho_a g, shape (nodes,).
    slack
        Displacement along x at which each node's spring is slack, as committed, L*, shape (nodes,).
    normal
        Normal reaction of each node in the last accepted state, rho_a g L*, shape (nodes,); zero above the floor.
    place
        Displacement along x in the last accepted state, L*, shape (nodes,).
    dissipated
        Energy dissipated in all committed steps, rho_a g L*^2 per width.
    """

    model: Model = field(repr=False)
    mu: float
    stiffness: Array = field(repr=False)
    slack: Array = field(repr=False)
    normal: Array = field(repr=False)
    place: Array = field(repr=False)
    dissipated: float = 0.0

    @classmethod
    def of(cls, model: Model, mu: float, q: Array, reaction: Reaction) -> Self:
        """Friction without force in the state ``q``.

        ``model``, ``mu``: the strip and the coefficient of friction; ``q``, ``reaction``: a state, shape (n,), and the
        floor's forces.  Raises InvalidInputError: ``mu`` negative or not finite.
        """
        if not 0.0 <= mu < np.inf:
            raise InvalidInputError("mu", mu, "a finite number >= 0")
        x, z = model.middle.T
        return cls(model, mu, SPRING * model.weight[z], q[x], np.maximum(reaction(q)[z], 0.0), q[x])

    def tractions(self, q: Array) -> Array:
        """Force of each node's spring against its displacement, rho_a g L*, shape (nodes,)."""
        limit = self.mu * self.normal
        return np.clip(self.stiffness * (q[self.model.middle[:, 0]] - self.slack), -limit, limit)

    def add(
        self, q: Array, force: Array, tangent: Band | None = None, growth: Array = NONE, columns: Array = NONE
    ) -> None:
        """Add the springs' force, and its derivative: the stiffness where a node sticks."""
        along = self.model.middle[:, 0]
        force[along] += self.tractions(q)
        if tangent is not None:
            tangent.diagonal()[along] += self.stiffness * self.sticks(q)

    def sticks(self, q: Array) -> Mask:
        """Which nodes lie and do not slip, shape (nodes,)."""
        limit = self.mu * self.normal
        trial = np.abs(self.stiffness * (q[self.model.middle[:, 0]] - self.slack))
        return np.asarray((trial <= limit * (1.0 + STICK_TOLERANCE)) & (limit > 0.0))

    @property
    def stored(self) -> float:
        """Elastic energy of the springs in the last accepted state, rho_a g L*^2 per width."""
        return 0.5 * float(self.stiffness @ (self.place - self.slack) ** 2)

    def committed(self, q: Array, reaction: Reaction) -> Self:
        """The friction after an accepted step to ``q``.

        A node that has landed sticks where it is; one that has left the floor forgets.
        """
        place, traction = q[self.model.middle[:, 0]], self.tractions(q)
        normal = np.maximum(reaction(q)[self.model.middle[:, 1]], 0.0)
        # Where the normal force has fallen the slider holds less: the spring loses the energy above that, too.
        held = np.clip(traction, -self.mu * normal, self.mu * normal)
        new = replace(self, slack=place - held / self.stiffness, normal=normal, place=place)
        lost = float(traction @ (place - self.place)) - (new.stored - self.stored)
        return replace(new, dissipated=self.dissipated + lost)

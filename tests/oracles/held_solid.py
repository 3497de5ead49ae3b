"""The strip's solid under other supports than a scene's: clamped columns, dead loads, no floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.solve import newton
from stripfold.solve.linear import Band
from stripfold.solve.problem import Equilibrium, FixedUnknowns
from stripfold.solve.stability import nearest_eigenvalues
from stripfold.strip.reference import Reference
from stripfold.strip.solid import Solid


@dataclass(frozen=True)
class HeldSolid(FixedUnknowns):
    """A solid with prescribed unknowns and a dead load; lambda scales the load.

    Parameters
    ----------
    model
        The solid.
    held
        Prescribed unknowns, shape (m,), all different.
    values
        What they are prescribed to be, shape (m,).
    load
        Force, shape (size,), positive along the unknowns.
    """

    model: Solid
    prescribed: Index
    values: Array
    load: Array

    @property
    def size(self) -> int:
        return self.model.size

    @property
    def bounded(self) -> Index:
        return np.zeros(0, dtype=np.intp)

    @property
    def lower(self) -> Array:
        return np.zeros(0)

    @property
    def metric(self) -> Array:
        metric = np.zeros(self.size)
        metric[self.model.middle] = 1.0
        return metric

    @property
    def mass(self) -> Band:
        return self.model.mass

    def residual(self, q: Array, lam: float) -> Array:
        return self.model.internal_force(q) - lam * self.load

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Band, Array]:
        force, tangent = self.model.force_and_tangent(q, predicted_stress)
        return force - lam * self.load, tangent, -self.load

    def predict_stress(self, q: Array, dq: Array) -> Array:
        return self.model.predict_stress(q, dq)

    def admissibility(self, q: Array) -> str:
        return self.model.admissibility(q)

    def prescribed_values(self, lam: float) -> Array:
        return self.values

    def prescribed_rates(self, lam: float) -> Array:
        return np.zeros(len(self.values))

    def solve(self, q: Array, **options: float) -> Equilibrium:
        """The equilibrium under the full load near ``q``."""
        settings = newton.NewtonOptions(**{"max_iterations": 60, **options})
        return newton.solve(self, q, 1.0, self.bounded, options=settings)

    def stability(self, q: Array) -> tuple[Array, Array, int]:
        """Eigenvalues nearest zero, the vector of the smallest, and the number of negative ones."""
        kept = self.model.force_and_tangent(q)[1].with_fixed(self.prescribed)
        values, mode = nearest_eigenvalues(self.mass, kept, kept.factor(), self.prescribed)
        return values, mode, kept.negatives()


def column(model: Solid, index: int) -> Index:
    """All unknowns of one column of nodes: prescribing them is a clamp."""
    return np.asarray(model.unknowns[index].ravel())


def clamped(model: Solid, q: Array, *columns: int, load: Array | None = None) -> HeldSolid:
    """A solid with whole columns held where ``q`` has them; ``load`` defaults to the strip's weight."""
    held = np.concatenate([column(model, i) for i in columns])
    return HeldSolid(model, held, q[held], -model.weight if load is None else load)


def interpolant(model: Reference, field: Array) -> Array:
    """Unknowns whose nodal displacements are ``field``, shape (2, n), at the mesh's nodes ``basis.doflocs``."""
    nodal, number = np.empty(model.size), model.nodal_of[model.unknowns]
    for component in (0, 1):
        own = number[:, :, component]
        nodal[own] = field[component][own]
    columns = nodal[number]
    across = columns.shape[1] // 2
    relative = (columns - columns[:, across, None, :]) / model.thickness
    relative[:, across] = columns[:, across]
    q = np.empty(model.size)
    q[model.unknowns] = relative
    return q


def arc(model: Solid, angle: float) -> Array:
    """Unknowns of the strip bent to a circular arc that turns by ``angle`` from end to end."""
    curvature = angle / model.length
    turn = curvature * model.s
    position = np.stack([np.sin(turn), 1.0 - np.cos(turn)], axis=1) / curvature
    position[:, 0] -= model.length / 2.0
    return model.unknowns_of(position, turn)

"""The problem of a strip on the floor with the ends of its contact as unknowns.

All that lies is held on the floor, and each contact coordinate (:mod:`.contact_mesh`) has an equation of its own.  At
the end of an interval the floor's last reaction is zero: on the rod the moment, on the solid the force on the last
node.  At a point the section is upright; the place of a second gripper, which parts the strip as a point does, stays
the same.  Along a branch lambda is then a smooth function of the contact coordinates.
Lengths in L*, forces in rho_a g L*.  Source: docs/physics.md, sections 4 and 5; docs/method.md.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from stripfold.base.arrays import Array, ByFields, Index
from stripfold.base.errors import NewtonError
from stripfold.solve.linear import Band, Bordered
from stripfold.solve.problem import Equilibrium, Point, Tangent
from stripfold.strip.contact_mesh import ContactMesh
from stripfold.strip.effects import Effect
from stripfold.strip.model import Model
from stripfold.strip.problem import Clamp, Motion, Slipping, StripProblem, TwoGrippers, clamp_of

LARGEST_SHRINKAGE = 0.5
"""Largest share by which an iteration may shorten a part."""
LARGEST_DISPLACEMENT = 0.3
"""Largest displacement of the mid-surface in an iteration, L*: what :class:`.NewtonOptions` limits."""
DISPLACEMENTS = 1e-4
"""Weight of the mid-surface's displacements in the length of a step, per length of strip."""
KEPT_MESHES = 3
"""Meshes kept: those of the last states."""


@dataclass(frozen=True, eq=False)
class MovingContact(ByFields):
    """A strip on the floor whose contact coordinates are the last unknowns, after those of its model.

    ``effects`` are on the mesh of ``remembered``, the contact coordinates when they were last updated.
    """

    mesh: ContactMesh
    motion: Motion
    effects: tuple[Effect, ...] = ()
    remembered: Array | None = None
    _meshes: OrderedDict[bytes, tuple[StripProblem, Array]] = field(init=False, repr=False, default_factory=OrderedDict)
    _linearised: dict[bytes, tuple[Array, Bordered]] = field(init=False, repr=False, default_factory=dict)
    """Of the last state, without a predicted stress."""

    @cached_property
    def prescribed(self) -> Index:
        """The unknowns at the grasp, at the held end and on the floor."""
        model = self.mesh.model
        grasped, end = self.motion.grasped(model), model.middle[-1]
        on_floor = np.setdiff1d(self._floor(model), np.concatenate([grasped, end]))
        return np.concatenate([grasped, end, on_floor])

    def _floor(self, model: Model) -> Index:
        """The unknowns that the floor holds."""
        per_element = self._per_element
        column = np.arange(len(model.s))
        last = len(self.mesh.on_floor) - 1
        right = np.minimum(column // per_element, last)
        left = np.maximum((column - 1) // per_element, 0)
        lies = self.mesh.on_floor[left] | self.mesh.on_floor[right]
        held = np.union1d(np.flatnonzero(lies), self.columns[self.points])
        slopes = np.empty(0, dtype=np.int64) if model.slopes is None else model.slopes[lies]
        return np.concatenate([model.middle[held, 1], slopes])

    @cached_property
    def columns(self) -> Index:
        """Columns at the contact coordinates."""
        return self._per_element * self.mesh.elements_at

    @cached_property
    def _per_element(self) -> int:
        """Columns of an element beside its first."""
        model = self.mesh.model
        return (len(model.s) - 1) // len(model.lengths)

    @cached_property
    def _released(self) -> Index:
        """For each contact coordinate the unknown whose reaction vanishes; that of a point is not used."""
        model = self.mesh.model
        return np.asarray((model.middle[:, 1] if model.slopes is None else model.slopes)[self.columns])

    @cached_property
    def points(self) -> Index:
        """Numbers of the contact coordinates at which the strip touches the floor in a point."""
        return np.array([i for i in np.flatnonzero(self.mesh.points) if i != self.gripped], dtype=np.int64)

    @cached_property
    def gripped(self) -> int | None:
        """Number of the contact coordinate at which a second gripper holds the strip; None without one."""
        if not isinstance(self.motion, TwoGrippers):
            return None
        return int(np.argmin(np.abs(self.mesh.planned - self.motion.s)))

    @cached_property
    def _upright(self) -> Array:
        """Linear functions of the unknowns that vanish where the sections of points are upright, shape (points, n)."""
        model = self.mesh.model
        rows = np.zeros((len(self.points), model.size))
        if len(rows):
            directors, elements = model.directors, self.mesh.elements_at[self.points]
            # Along the strip the tangent is (1, 0) plus the slopes; across it the director is (0, 1) plus theirs.
            unknowns = directors.unknowns[elements, 0, :, 0 if model.slopes is None else 1]
            np.put_along_axis(rows, unknowns, directors.factor[elements, 0], axis=1)
        return rows

    def at(self, contact: Array) -> StripProblem:
        """The strip with these contact coordinates, its effects on these elements, with the floor as a bound."""
        return self._with_growth(contact)[0]

    def _with_growth(self, contact: Array) -> tuple[StripProblem, Array]:
        """The same, and the growth of its elements: :meth:`.ContactMesh.growth`."""
        key = contact.tobytes()
        if key not in self._meshes:
            model, before, effects = self.mesh.at(contact), self._remembered, self.effects
            if before is not None:
                effects = tuple(effect.on(before, model) for effect in effects)
            self._meshes[key] = StripProblem(model, self.motion, effects), self.mesh.growth(contact)
            if len(self._meshes) > KEPT_MESHES:
                self._meshes.popitem(last=False)
        self._meshes.move_to_end(key)
        return self._meshes[key]

    @cached_property
    def _remembered(self) -> Model | None:
        """The strip on which the effects are; None for any."""
        return None if self.remembered is None else self.mesh.at(self.remembered)

    def accepted(self, q: Array, motion: Motion | None = None) -> MovingContact:
        """The problem after an accepted step to ``q``, by default of the same motion: the memory is updated."""
        u, contact = q[: self.n], self.contact(q)
        effects = self.at(contact).accepted(u).effects
        return MovingContact(self.mesh, motion or self.motion, effects, contact.copy())

    @property
    def sliding(self) -> Self:
        """The problem whose tangent is that of sliding where an element is at its limit: a branch goes on as it came.

        With the memory updated it would be that of sticking, and the contact could move the other way.
        """
        effects = tuple(effect.about_to_slide() for effect in self.effects)
        return replace(self, effects=effects) if effects else self

    def let_go(self, q: Array, resists: bool) -> MovingContact:
        """The problem in a state ``q`` found with held moments; ``resists``: see :meth:`.Effect.let_go`."""
        u, contact = q[: self.n], self.contact(q)
        effects = tuple(effect.let_go(None if resists else u) for effect in self.at(contact).effects)
        return MovingContact(self.mesh, self.motion, effects, contact.copy())

    @cached_property
    def n(self) -> int:
        """Number of unknowns of the model."""
        return self.size - len(self.mesh.planned)

    @cached_property
    def size(self) -> int:
        return self.mesh.model.size + len(self.mesh.planned)

    @cached_property
    def bounded(self) -> Index:
        return np.empty(0, dtype=np.int64)

    @cached_property
    def lower(self) -> Array:
        return np.empty(0)

    @cached_property
    def metric(self) -> Array:
        """Steps are measured in lambda and the contact coordinates; where these stand still displacements count."""
        model, metric = self.mesh.model, np.ones(self.size)
        metric[: self.n] = 0.0
        metric[model.middle] = DISPLACEMENTS * np.gradient(model.s)[:, None]
        return metric

    def contact(self, q: Array) -> Array:
        """The contact coordinates of a state."""
        return q[self.n :]

    def mass_at(self, q: Array) -> Band:
        """Mass matrix of the model, of size n."""
        return self.at(self.contact(q)).model.mass

    def _with_equations(self, q: Array, force: Array) -> Array:
        """The forces and the equations of the contact coordinates."""
        if isinstance(self.motion, Slipping):
            x, z = self.mesh.model.middle[0]
            force[x] += self.motion.ratio * (self.mesh.length - force[z])
        equations = force[self._released]
        if len(self.points):
            equations[self.points] = self._upright @ q[: self.n]
        if isinstance(self.motion, TwoGrippers):
            equations[self.gripped] = q[self.n :][self.gripped] - self.motion.s
        return np.concatenate([force, self._sign * equations])

    def _clamp(self, lam: float) -> Clamp | None:
        """The clamp, if any; on the floor the strip's end lies, whatever holds it."""
        return None if self.mesh.topology[0] else clamp_of(self.motion, self.mesh.model, lam)

    def residual(self, q: Array, lam: float) -> Array:
        u, contact = q[: self.n], q[self.n :]
        strip = self.at(contact)
        force = strip.model.internal_force(u) + self.mesh.weight(contact)[0]
        for effect in strip.effects:
            effect.add(u, force)
        if clamp := self._clamp(lam):
            clamp.add(u, force)
        return self._with_equations(q, force)

    @cached_property
    def _sign(self) -> Array:
        """Signs of the equations for which their own coordinate's derivative is positive on a stable branch."""
        lies_behind = np.where(self.mesh.topology[1:], 1.0, -1.0)
        # A reaction force grows where more of the strip is taken for free; a moment falls at either end of an interval.
        # The section at a point turns with the slope on the rod, against it on the solid.
        is_rod = self.mesh.model.slopes is not None
        signs = np.where(is_rod, -1.0, lies_behind)
        signs[self.points] = 1.0 if is_rod else -1.0
        if self.gripped is not None:
            signs[self.gripped] = 1.0
        return signs

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Bordered, Array]:
        key = q.tobytes()
        if predicted_stress is None and key in self._linearised:
            force, matrix = self._linearised[key]
        else:
            force, matrix = self._assembled(q, predicted_stress)
            if predicted_stress is None:
                # That of a solution serves its tangent and its eigenvalues.
                self._linearised.clear()
                self._linearised[key] = force, matrix
        if (clamp := self._clamp(lam)) is None:
            return force, matrix, np.zeros(self.size)
        u, force = q[: self.n], force.copy()
        clamp.add(u, force)
        return force, replace(matrix, block=clamp.tangent(matrix.block)), clamp.force_rate(u, self.size)

    def _assembled(self, q: Array, predicted_stress: Array | None) -> tuple[Array, Bordered]:
        u, contact = q[: self.n], q[self.n :]
        (strip, growth), (weight, weight_columns) = self._with_growth(contact), self.mesh.weight(contact)
        force, tangent, columns = strip.model.force_and_derivatives(u, growth, predicted_stress)
        force, columns = force + weight, columns + weight_columns
        for effect in strip.effects:
            effect.add(u, force, tangent, growth, columns.T)
        if isinstance(self.motion, Slipping):
            x, z = self.mesh.model.middle[0]
            tangent.add_row(x, z, -self.motion.ratio)
            columns[x] -= self.motion.ratio * columns[z]
        rows, corner = tangent.rows(self._released), columns[self._released]
        if len(self.points):
            rows[self.points], corner[self.points] = self._upright, 0.0
        if self.gripped is not None:
            rows[self.gripped], corner[self.gripped] = 0.0, np.eye(len(corner))[self.gripped]
        sign = self._sign[:, None]
        return self._with_equations(q, force), Bordered(tangent, columns, sign * rows, sign * corner)

    def stepped(self, q: Array, dq: Array) -> tuple[Array, Array]:
        """The unknowns after a step, and the stress predicted for them: linear in the step."""
        u, contact, change = q[: self.n], q[self.n :], dq[self.n :]
        if self.mesh.parts(contact + change).min() <= 0.0:
            raise NewtonError("the step ends with a part of negative length", residuals=[])
        strip, growth = self._with_growth(contact)
        return q + dq, strip.model.predict_stress(u, dq[: self.n], change @ growth)

    def largest_change(self, q: Array, dq: Array) -> float:
        """Largest displacement of the mid-surface, or what stands for the largest change of a part's length."""
        shorter = -(dq[self.n :] @ self._with_growth(self.contact(q))[1]).min()
        most = float(shorter) * LARGEST_DISPLACEMENT / LARGEST_SHRINKAGE
        return max(float(np.abs(dq[self.mesh.model.middle]).max()), most)

    def admissibility(self, q: Array) -> str:
        return self.at(self.contact(q)).model.admissibility(q[: self.n])

    def prescribed_values(self, lam: float) -> Array:
        return self._of_prescribed(self.motion.values(lam))

    def prescribed_rates(self, lam: float) -> Array:
        return self._of_prescribed(self.motion.rates(lam))

    def _of_prescribed(self, grasped: Array) -> Array:
        """Numbers of the prescribed unknowns: those of the grasp, of which one that lies stays at z = 0, and zeros."""
        out = np.zeros(len(self.prescribed))
        out[: len(grasped)] = grasped
        if self.mesh.topology[0]:
            out[min(len(grasped), 2) - 1] = 0.0
        return out

    @cached_property
    def _on_floor(self) -> Index:
        """Of the unknowns that the floor bounds those that it holds."""
        return np.intersect1d(self.prescribed, StripProblem(self.mesh.model, self.motion).bounded)

    def mid_surface(self, q: Array) -> Array:
        """Places of the mid-surface nodes, shape (columns, 2), in the paper's frame (origin mid-strip)."""
        return self.at(self.contact(q)).model.mid_surface(q[: self.n])

    def on_mesh(self, point: Point) -> tuple[StripProblem, Point]:
        """A state as one of the model at its contact coordinates: what it solves, and the point."""
        problem = self.at(self.contact(point.q))
        u = point.q[: self.n]
        state = Equilibrium(u, point.lam, self._on_floor, point.state.residuals, problem.residual(u, point.lam))
        tangent = Tangent(point.tangent.q[: self.n], point.tangent.lam)
        return problem, replace(point, state=state, tangent=tangent)

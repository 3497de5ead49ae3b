"""The problem of a strip on the floor with the ends of its contact as unknowns.

All that lies is held on the floor, and each contact coordinate (:mod:`.contact_mesh`) has an equation of its own.  At
the end of an interval the floor's last reaction is zero: on the rod the moment, on the solid the force on the last
node.  At a point contact the section is upright.  Along a branch lambda is then a smooth function of the contact
coordinates.
Lengths in L*, forces in rho_a g L*.  Source: docs/physics.md, sections 4 and 5; docs/method.md.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from stripfold.arrays import Array, Index, Mask
from stripfold.effects import Effect
from stripfold.errors import NewtonError
from stripfold.models.contact_mesh import ContactMesh, Topology
from stripfold.models.model import Model
from stripfold.problem import Motion, StripProblem
from stripfold.solve.linear import Band, Bordered
from stripfold.solve.problem import Equilibrium, Point, Tangent

DIFFERENCE = 1e-6
"""Step of the differences by a contact coordinate, as a share of the shorter part beside it."""
LARGEST_SHRINKAGE = 0.5
"""Largest share by which an iteration may shorten a part."""
LARGEST_DISPLACEMENT = 0.3
"""Largest displacement of the mid-surface in an iteration, L*: what :class:`.NewtonOptions` limits."""
KEPT_MESHES = 8
"""Meshes kept: an iteration evaluates three for each contact coordinate."""


@dataclass(frozen=True, eq=False)
class _Mesh:
    """The strip with one value of the contact coordinates."""

    model: Model
    motion: Motion
    effects: tuple[Effect, ...]
    weight: Array

    @cached_property
    def problem(self) -> StripProblem:
        """The same strip with contact at its nodes."""
        return StripProblem(self.model, self.motion, self.effects)

    def on(self, model: Model) -> tuple[Effect, ...]:
        """The effects on other elements of the same strip."""
        return tuple(effect.on(self.model, model) for effect in self.effects)


@dataclass(frozen=True, eq=False)
class MovingContact:
    """A strip on the floor whose contact coordinates are the last unknowns, after those of its model.

    ``effects`` are on the mesh of ``remembered``, the contact coordinates when they were last updated.
    """

    mesh: ContactMesh
    motion: Motion
    effects: tuple[Effect, ...] = ()
    remembered: Array | None = None
    prescribed: Index = field(init=False, repr=False)
    _meshes: OrderedDict[bytes, _Mesh] = field(init=False, repr=False, default_factory=OrderedDict)

    def __post_init__(self) -> None:
        model = self.mesh.model
        grasped, end = self.motion.grasped(model), model.middle[-1]
        on_floor = np.setdiff1d(self._floor(model), np.concatenate([grasped, end]))
        object.__setattr__(self, "prescribed", np.concatenate([grasped, end, on_floor]))

    def _floor(self, model: Model) -> Index:
        """The unknowns that the floor holds."""
        per_element = self._per_element
        column = np.arange(len(model.s))
        last = len(self.mesh.on_floor) - 1
        right = np.minimum(column // per_element, last)
        left = np.maximum((column - 1) // per_element, 0)
        lies = self.mesh.on_floor[left] | self.mesh.on_floor[right]
        if self.mesh.topology is Topology.POINT:
            lies[self.columns[0]] = True
        held = model.middle[lies, 1]
        if model.slopes is None:
            return held
        if self.mesh.topology is Topology.POINT:
            lies[self.columns[0]] = False
        return np.concatenate([held, model.slopes[lies]])

    @cached_property
    def columns(self) -> Index:
        """Columns at the contact coordinates."""
        return self._per_element * self.mesh.elements_at

    @cached_property
    def _per_element(self) -> int:
        """Columns of an element beside its first."""
        model = self.mesh.model
        return (len(model.s) - 1) // (len(model.ends) - 1)

    @cached_property
    def _released(self) -> Index:
        """For each contact coordinate at an interval's end the unknown whose reaction vanishes; -1 at a point."""
        model = self.mesh.model
        unknowns = (model.middle[:, 1] if model.slopes is None else model.slopes)[self.columns]
        if self.mesh.topology is Topology.POINT:
            unknowns = unknowns.copy()
            unknowns[0] = -1
        return np.asarray(unknowns)

    @cached_property
    def _upright(self) -> Array:
        """Linear function of the unknowns that vanishes where the section of a point contact is upright, (n,)."""
        model = self.mesh.model
        row = np.zeros(model.size)
        directors = model.directors
        # Elements across the strip follow each other.
        element = directors.across * int(self.mesh.elements_at[0])
        unknowns, factor = directors.unknowns[element, 0], directors.factor[element, 0]
        # Along the strip the tangent is (1, 0) plus the slopes; across it the director is (0, 1) plus theirs.
        np.add.at(row, unknowns[:, 0 if model.slopes is None else 1], factor)
        return row

    def at(self, contact: Array) -> _Mesh:
        """The strip with these contact coordinates."""
        key = contact.tobytes()
        if key in self._meshes:
            self._meshes.move_to_end(key)
            return self._meshes[key]
        model = self.mesh.at(contact)
        effects = self.effects
        if effects and self.remembered is not None:
            effects = tuple(effect.on(self._remembered, model) for effect in effects)
        # The floor carries the weight of what lies.
        bent, unknowns = self._bent
        weight = np.bincount(unknowns, model.element_weight[bent].ravel(), model.size)
        new = self._meshes[key] = _Mesh(model, self.motion, effects, weight.astype(float))
        while len(self._meshes) > KEPT_MESHES:
            self._meshes.popitem(last=False)
        return new

    @cached_property
    def _bent(self) -> tuple[Mask, Index]:
        """The elements off the floor, shape (n_elements,), and their unknowns in one row."""
        model = self.mesh.model
        first = model.element_unknowns[:, 0] // (model.size // len(model.s))
        bent = ~self.mesh.on_floor[first // self._per_element]
        return bent, model.element_unknowns[bent].ravel()

    @cached_property
    def _remembered(self) -> Model:
        """The strip on which the effects are."""
        assert self.remembered is not None
        return self.mesh.at(self.remembered)

    def accepted(self, q: Array, motion: Motion | None = None) -> MovingContact:
        """The problem after an accepted step to ``q``, by default of the same motion: the memory is updated."""
        contact = self.contact(q)
        effects = self.at(contact).problem.accepted(q[: self.n]).effects
        return MovingContact(self.mesh, motion or self.motion, effects, contact.copy())

    @property
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
        """Steps are measured in lambda and the contact coordinates."""
        metric = np.zeros(self.size)
        metric[self.n :] = 1.0
        return metric

    def contact(self, q: Array) -> Array:
        """The contact coordinates of a state."""
        return q[self.n :]

    def mass_at(self, q: Array) -> Band:
        """Mass matrix of the model, of size n."""
        return self.at(self.contact(q)).model.mass

    def _force(self, mesh: _Mesh, u: Array, stress: Array | None = None) -> Array:
        """Forces in a state, those of the model by its stress or by a given one."""
        model = mesh.model
        force = (model.internal_force(u) if stress is None else model.force_of(u, stress)) + mesh.weight
        for effect in mesh.effects:
            force = force + effect.force(u)
        return force

    def _equations(self, u: Array, force: Array) -> Array:
        """Of the contact coordinates."""
        return np.array([self._upright @ u if i < 0 else force[i] for i in self._released])

    def residual(self, q: Array, lam: float) -> Array:
        u, contact = q[: self.n], q[self.n :]
        force = self._force(self.at(contact), u)
        return np.concatenate([force, self._sign * self._equations(u, force)])

    @cached_property
    def _sign(self) -> Array:
        """Signs of the equations for which their own coordinate's derivative is positive on a stable branch."""
        lies_behind = np.where(self.mesh.topology.value[1:], 1.0, -1.0)
        # A reaction force grows where more of the strip is taken for free; a moment falls at either end of an interval.
        # The section at a point turns with the slope on the rod, against it on the solid.
        is_rod = self.mesh.model.slopes is not None
        at_point = self._released < 0
        return np.where(at_point, 1.0 if is_rod else -1.0, -1.0 if is_rod else lies_behind)

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Bordered, Array]:
        u, contact = q[: self.n], q[self.n :].copy()
        mesh = self.at(contact)
        force, tangent = mesh.model.force_and_tangent(u, predicted_stress)
        force = force + mesh.weight
        for effect in mesh.effects:
            more, stiffness = effect.force_and_tangent(u)
            force, tangent = force + more, tangent + stiffness
        columns, corner = np.empty((self.n, len(contact))), np.empty((len(contact), len(contact)))
        for i, step in enumerate(self._differences(contact)):
            sides = []
            for to in (contact + step, contact - step):
                stress = None
                if predicted_stress is not None:
                    stress = self._changed(u, contact, to, predicted_stress)
                beside = self._force(self.at(to), u, stress)
                sides.append(np.concatenate([beside, self._equations(u, beside)]))
            rate = (sides[0] - sides[1]) / (2.0 * step[i])
            columns[:, i], corner[:, i] = rate[: self.n], self._sign * rate[self.n :]
        rows = np.stack([self._upright if j < 0 else tangent.row(j) for j in self._released])
        matrix = Bordered(tangent, columns, self._sign[:, None] * rows, corner)
        residual = np.concatenate([force, self._sign * self._equations(u, force)])
        return residual, matrix, np.zeros(self.size)

    def _differences(self, contact: Array) -> list[Array]:
        """Small steps of each contact coordinate alone."""
        parts = np.diff(contact, prepend=0.0, append=self.mesh.length)
        return list(np.diag(DIFFERENCE * np.minimum(parts[:-1], parts[1:])))

    def _changed(self, u: Array, contact: Array, to: Array, stress: Array) -> Array:
        """A stress with the change, on the same unknowns, from one mesh to another."""
        here, there = self.at(contact).model, self.at(to).model
        zero = np.zeros(self.n)
        return there.predict_stress(u, zero) + here.stress_on(there, stress - here.predict_stress(u, zero))

    def stepped(self, q: Array, dq: Array) -> tuple[Array, Array]:
        """The unknowns after a step, and the stress predicted for them: linear in the step."""
        u, contact, change = q[: self.n], self.contact(q), dq[self.n :]
        to = contact + change
        if np.any(np.diff(to, prepend=0.0, append=self.mesh.length) <= 0.0):
            raise NewtonError("the step ends with a part of negative length", residuals=[])
        model = self.at(contact).model
        stress = model.predict_stress(u, dq[: self.n])
        zero = np.zeros(self.n)
        for step, by in zip(self._differences(contact), change, strict=True):
            sides = [
                other.stress_on(model, other.predict_stress(u, zero))
                for other in (self.at(contact + step).model, self.at(contact - step).model)
            ]
            stress = stress + (sides[0] - sides[1]) * (by / (2.0 * step.sum()))
        return q + dq, model.stress_on(self.at(to).model, stress)

    def largest_change(self, q: Array, dq: Array) -> float:
        """Largest displacement of the mid-surface, or what stands for the largest change of a part's length."""
        parts = np.diff(q[self.n :], prepend=0.0, append=self.mesh.length)
        shorter = -np.diff(dq[self.n :], prepend=0.0, append=0.0) / parts
        most = float(shorter.max(initial=0.0)) * LARGEST_DISPLACEMENT / LARGEST_SHRINKAGE
        return max(float(np.abs(dq[self.mesh.model.middle]).max()), most)

    def admissibility(self, q: Array) -> str:
        return self.at(self.contact(q)).model.admissibility(q[: self.n])

    def prescribed_values(self, lam: float) -> Array:
        values = self.motion.values(lam)
        return np.concatenate([values, np.zeros(len(self.prescribed) - len(values))])

    def prescribed_rates(self, lam: float) -> Array:
        rates = self.motion.rates(lam)
        return np.concatenate([rates, np.zeros(len(self.prescribed) - len(rates))])

    def mid_surface(self, q: Array) -> Array:
        """Places of the mid-surface nodes, shape (columns, 2), in the paper's frame (origin mid-strip)."""
        return self.at(self.contact(q)).model.mid_surface(q[: self.n])

    def on_mesh(self, point: Point) -> tuple[StripProblem, Point]:
        """A state as one of the model at its contact coordinates: what it solves, and the point."""
        problem = self.at(self.contact(point.q)).problem
        u = point.q[: self.n]
        floor = np.intersect1d(self.prescribed, problem.bounded)
        state = Equilibrium(u, point.lam, floor, point.state.residuals, problem.residual(u, point.lam))
        tangent = Tangent(point.tangent.q[: self.n], point.tangent.lam)
        return problem, Point(state, tangent, point.negatives, point.eigenvalues, point.mode, point.arc)

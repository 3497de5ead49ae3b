"""The problem that the algorithms solve: a strip with its effects and the motion of its gripper.

The holding pin and the grasp are prescribed unknowns, the floor is a bound on unknowns, gravity a force
(``docs/physics.md``, section 3).  Lengths in L*, forces in rho_a g L*.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, ByFields, Index
from stripfold.base.validation import Gripper
from stripfold.paths.curve import GripperPath, Piece
from stripfold.solve.linear import Band, Sparse
from stripfold.solve.problem import FixedUnknowns
from stripfold.strip.effects import Effect, Hysteresis
from stripfold.strip.model import Model
from stripfold.strip.self_contact import SelfContact

if TYPE_CHECKING:
    from stripfold.kernels.bending import Springs
    from stripfold.kernels.elements import Elements


CLAMPING = 1e5
"""Stiffness of a clamp against a turn, rho_a g L*^2 per rad, where a strip's moments are a few: it gives 1e-5 rad."""


@dataclass(frozen=True)
class Lift:
    """The gripper rises: lambda is its height; it is free along x, so the horizontal force is zero."""

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0, 1:])

    def values(self, lam: float) -> Array:
        return np.array([lam])

    def rates(self, lam: float) -> Array:
        return np.array([1.0])


@dataclass(frozen=True)
class AlongX:
    """The gripper moves along +x at constant height: lambda is its advance from where it lay when flat.

    ``angle``: at which it clamps the strip, rad; None of a hinge.
    """

    height: float
    angle: float | None = None

    def clamp(self, model: Model, lam: float) -> Clamp | None:
        """The clamp that holds the end of the strip; None of a hinge."""
        return None if self.angle is None else Clamp(model, self.angle, 0.0)

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0])

    def values(self, lam: float) -> Array:
        return np.array([lam, self.height])

    def rates(self, lam: float) -> Array:
        return np.array([1.0, 0.0])


@dataclass(frozen=True)
class AlongPath:
    """The gripper follows a smooth piece of a path, or in time a whole path: lambda is the length travelled."""

    path: Piece | GripperPath
    length: float
    """Length of the strip, L*."""
    gripper: Gripper = "hinge"
    held: float | None = None
    """Angle at which a clamp that turns stands still, rad: in a fall."""

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0])

    def clamp(self, model: Model, lam: float) -> Clamp | None:
        """The clamp that holds the end of the strip; None of a hinge."""
        if self.gripper == "hinge":
            return None
        if self.gripper == "fixed" or self.held is not None:
            return Clamp(model, self.held or 0.0, 0.0)
        return Clamp(model, *self.path.angle(lam))

    def standing(self, lam: float) -> AlongPath:
        """The same with a clamp that does not turn from here on."""
        return replace(self, held=self.path.angle(lam)[0]) if self.gripper == "turning" else self

    def values(self, lam: float) -> Array:
        return self.path.position(lam) + np.array([self.length / 2.0, 0.0])

    def rates(self, lam: float) -> Array:
        return self.path.rate(lam)


@dataclass(frozen=True)
class Slipping(AlongPath):
    """The same height while what lies slides on the table: x is where the table's friction holds no more.

    ``ratio``: of the horizontal force at the held end to the weight that the table carries, the coefficient of friction
    with its sign.
    """

    ratio: float = 0.0

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0, 1:])

    def values(self, lam: float) -> Array:
        return super().values(lam)[1:]

    def rates(self, lam: float) -> Array:
        return super().rates(lam)[1:]

    def slid(self, model: Model, u: Array, lam: float) -> float:
        """How far what lies has slid along x."""
        return float(super().values(lam)[0] - u[model.middle[0, 0]])


@dataclass(frozen=True)
class TwoGrippers:
    """The gripper moves as ``first`` says, with a second one: a hinge in the strip that keeps its distance from it.

    ``s`` is its place in the strip, from the grasped end; ``ahead`` its displacement along x less the first one's, and
    ``up`` its height less the first one's, L*.
    """

    first: AlongX | AlongPath
    s: float
    ahead: float
    up: float

    def grasped(self, model: Model) -> Index:
        return np.concatenate([model.middle[0], model.middle[np.argmin(np.abs(model.s - self.s))]])

    def values(self, lam: float) -> Array:
        place = self.first.values(lam)
        return np.concatenate([place, place + np.array([self.ahead, self.up])])

    def rates(self, lam: float) -> Array:
        return np.tile(self.first.rates(lam), 2)


@dataclass(frozen=True)
class Opened:
    """The gripper has opened: nothing is grasped."""

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0, :0])

    def values(self, lam: float) -> Array:
        return np.zeros(0)

    def rates(self, lam: float) -> Array:
        return np.zeros(0)


@dataclass(frozen=True)
class Clamp:
    """A spring of :data:`CLAMPING` that keeps the first section of a strip at an angle, and its rate by lambda.

    Its energy is half the stiffness times the square of ``g``, the sine of the angle that is left: linear in the
    unknowns, zero where the section is as wanted.
    """

    model: Model
    angle: float
    rate: float

    @cached_property
    def unknowns(self) -> Index:
        """Those of the section, shape (points, 2)."""
        return self.model.directors.unknowns[0, 0]

    @cached_property
    def _along(self) -> Array:
        """The section's director where it is as wanted."""
        # The model turns the other way than the gripper: x is towards the held end.
        cos, sin = np.cos(self.angle), -np.sin(self.angle)
        return np.array([[cos, -sin], [sin, cos]]) @ self.model.directors.straight

    @cached_property
    def _rows(self) -> tuple[Array, Array]:
        """Derivatives of g by the unknowns, and of these by lambda, shape (points, 2) each."""
        factor, (x, z) = self.model.directors.factor[0, 0][:, None], self._along
        return factor * np.array([-z, x]), self.rate * factor * self._along

    def _off(self, u: Array) -> tuple[float, float]:
        """The g of a state, and its derivative by lambda."""
        directors, (x, z) = self.model.directors, self._along
        director = directors.straight + directors.factor[0, 0] @ u[self.unknowns]
        return float(np.array([-z, x]) @ director), self.rate * float(self._along @ director)

    def moment(self, u: Array) -> float:
        """Moment of the gripper on the strip, rho_a g L*^2."""
        return CLAMPING * self._off(u)[0]

    def add(self, u: Array, force: Array) -> None:
        """Add its force."""
        force[self.unknowns] += self.moment(u) * self._rows[0]

    def energy(self, u: Array) -> float:
        """Its energy, rho_a g L*^2."""
        return 0.5 * CLAMPING * self._off(u)[0] ** 2

    def add_over_step(self, q0: Array, q1: Array, force: Array, tangent: Band) -> Band:
        """Add the force whose work over a step is the gain of energy; the derivative of all forces by ``q1``."""
        force[self.unknowns] += 0.5 * (self.moment(q0) + self.moment(q1)) * self._rows[0]
        return self.tangent(tangent, 0.5)

    def tangent(self, band: Band, share: float = 1.0) -> Band:
        """The derivative of all forces, with a share of that of its own."""
        out, at = Band(band.flat.copy(), band.width), self.unknowns.ravel()
        row = self._rows[0].ravel()
        out.columns[at, band.width + at[:, None] - at] += share * CLAMPING * np.outer(row, row)
        return out

    def force_rate(self, u: Array, size: int) -> Array:
        """Derivative of its force by lambda, shape (size,)."""
        (row, row_rate), (off, off_rate), out = self._rows, self._off(u), np.zeros(size)
        out[self.unknowns] = CLAMPING * (off_rate * row + off * row_rate)
        return out


def end_angle(model: Model, u: Array) -> float:
    """Rotation of the first section of a strip, rad, as a gripper's that holds it."""
    directors = model.directors
    (x, z), (x0, z0) = directors.straight + directors.factor[0, 0] @ u[directors.unknowns[0, 0]], directors.straight
    return -float(np.arctan2(x0 * z - z0 * x, x0 * x + z0 * z))


def clamp_of(motion: Motion, model: Model, lam: float) -> Clamp | None:
    """The clamp of a gripper's motion, if any."""
    return motion.clamp(model, lam) if isinstance(motion, AlongX | AlongPath) else None


Motion = Lift | AlongX | AlongPath | TwoGrippers | Opened


@dataclass(frozen=True)
class StripProblem(ByFields, FixedUnknowns):
    """A strip on the floor, held at one end and moved at the other.

    ``table``: height of the floor under each node of the mid-surface, shape (n_nodes,), L*; None where it is flat.  A
    node keeps its own: what lies does not move along the floor by more than the strip is compressed.  The memory of
    ``effects`` changes in :meth:`accepted` only.  ``self_contact`` acts between layers above the floor; while they
    touch the tangent is not a band matrix.
    """

    model: Model
    motion: Motion
    effects: tuple[Effect, ...] = ()
    self_contact: SelfContact | None = None
    table: Array | None = None

    @cached_property
    def prescribed(self) -> Index:
        return np.concatenate([self.motion.grasped(self.model), self._held_end])

    @cached_property
    def _held_end(self) -> Index:
        """Unknowns of the held end, which is pinned; that of a curled strip, which might not lie, is held flat."""
        model = self.model
        if not model.curl:
            return model.middle[-1]
        # An upright section, or a level tangent.
        section = model.directors.unknowns[-1, 1, :, 0 if model.slopes is None else 1]
        return np.concatenate([model.middle[-1], section])

    @cached_property
    def bounded(self) -> Index:
        return np.setdiff1d(self.model.middle[:, 1], self.prescribed)

    @cached_property
    def lower(self) -> Array:
        heights = np.zeros(self.size)
        if self.table is not None:
            heights[self.model.middle[:, 1]] = self.table
        return heights[self.bounded]

    @cached_property
    def metric(self) -> Array:
        """Mid-surface displacement, integrated over the strip, per typical free length of four L*."""
        metric = np.zeros(self.size)
        metric[self.model.middle] = np.gradient(self.model.s)[:, None] / 4.0
        return metric

    @property
    def size(self) -> int:
        return self.model.size

    @property
    def mass(self) -> Band:
        return self.model.mass

    def residual(self, q: Array, lam: float) -> Array:
        force = self.model.internal_force(q) + self.model.weight
        for effect in self.effects:
            effect.add(q, force)
        if clamp := clamp_of(self.motion, self.model, lam):
            clamp.add(q, force)
        touching = self.self_contact.over_step(q, q) if self.self_contact else None
        return force if touching is None else force + touching[0]

    def linearise(
        self, q: Array, lam: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band | Sparse, Array]:
        force, tangent = self._with_others(q, q, *self.model.force_and_tangent(q, predicted_stress))
        if (clamp := clamp_of(self.motion, self.model, lam)) is None:
            return force, tangent, np.zeros(self.size)
        assert isinstance(tangent, Band)  # layers meet in time only, where nothing is clamped
        clamp.add(q, force)
        return force, clamp.tangent(tangent), clamp.force_rate(q, self.size)

    def force_over_step(
        self, q0: Array, q1: Array, kappa: float, predicted_stress: Array | None = None
    ) -> tuple[Array, Band | Sparse]:
        if any(effect.step_dependent for effect in self.effects):
            raise ValueError("motion in time needs effects that do not depend on the step size")
        if self._turns:
            raise ValueError("motion in time needs a clamp that does not turn")
        force, tangent = self.model.force_over_step(q0, q1, kappa, predicted_stress)
        if self._standing_clamp is not None:
            tangent = self._standing_clamp.add_over_step(q0, q1, force, tangent)
        return self._with_others(q0, q1, force, tangent)

    @cached_property
    def _standing_clamp(self) -> Clamp | None:
        """The clamp in time, where none turns; None of one that turns, in statics."""
        return None if self._turns else clamp_of(self.motion, self.model, 0.0)

    @property
    def _turns(self) -> bool:
        """Whether a clamp turns on the way."""
        return isinstance(self.motion, AlongPath) and self.motion.gripper == "turning" and self.motion.held is None

    def _with_others(self, q0: Array, q1: Array, force: Array, tangent: Band) -> tuple[Array, Band | Sparse]:
        """Add weight, effects and layers that touch.

        Effects by their force at the end of the step: a state at rest is an equilibrium, and the work is never too
        small.
        """
        force += self.model.weight
        for effect in self.effects:
            effect.add(q1, force, tangent)
        touching = self.self_contact.over_step(q0, q1) if self.self_contact else None
        return (force, tangent) if touching is None else (force + touching[0], Sparse(touching[1]) + tangent)

    def accepted(self, q: Array) -> StripProblem:
        """The problem after an accepted step to ``q``: its effects have updated their memory."""
        if not self.effects:
            return self
        accepted = copy(self)  # what follows from the model and the motion stays
        object.__setattr__(accepted, "effects", tuple(effect.committed(q, self.reaction) for effect in self.effects))
        return accepted

    def reaction(self, q: Array) -> Array:
        """The floor's forces on the strip in a state, inertia aside, shape (n,)."""
        reaction = np.zeros(self.size)
        on_floor = self.bounded[q[self.bounded] <= self.lower]
        reaction[on_floor] = self.residual(q, 0.0)[on_floor]
        return reaction

    def predict_stress(self, q: Array, dq: Array) -> Array:
        return self.model.predict_stress(q, dq)

    def admissibility(self, q: Array) -> str:
        return self.model.admissibility(q)

    def elements_over_step(self, q0: Array, q1: Array) -> tuple[Elements, Springs, Array] | None:
        """The elements, friction in them and the weight if nothing else acts over a step: no layers in contact."""
        springs = kernels.bending.NO_SPRINGS
        if self._standing_clamp is not None:
            return None
        for effect in self.effects:
            if not isinstance(effect, Hysteresis) or springs is not kernels.bending.NO_SPRINGS:
                return None
            springs = effect.springs
        if self.self_contact and self.self_contact.over_step(q0, q1) is not None:
            return None
        return self.model.elements, springs, self.model.weight

    def friction_work(self, q0: Array, q1: Array) -> float:
        return sum(float(effect.force(q1) @ (q1 - q0)) for effect in self.effects)

    def strain_distance(self, q0: Array, q1: Array) -> float:
        return self.model.strain_distance(q0, q1)

    def energies(self, q: Array) -> tuple[float, float]:
        elastic = self.model.energy(q) + (self.self_contact.energy(q) if self.self_contact else 0.0)
        # That of a clamp is next to nothing, but belongs to the balance of a step.
        if self._standing_clamp is not None:
            elastic += self._standing_clamp.energy(q)
        return elastic, float(self.model.weight @ q)

    def prescribed_values(self, lam: float) -> Array:
        return np.concatenate([self.motion.values(lam), np.zeros(len(self._held_end))])

    def prescribed_rates(self, lam: float) -> Array:
        return np.concatenate([self.motion.rates(lam), np.zeros(len(self._held_end))])

"""The free part of a rod with its lift-off as an unknown, instead of contact at nodes.

The lying part is a bar under the horizontal force H, of length L - l and stretch e.  The free part, of length l, is a
:class:`.Rod` of length one: in units of l its energies scale by powers of l, which is an unknown.  Its equation is that
the moment vanishes at the lift-off (docs/physics.md, section 4).  The advance is then a smooth function of l, and a
critical point is a root of its derivative.

Lengths in L*, forces per width in rho_a g L*.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.arrays import Array, Index
from stripfold.errors import SolveError
from stripfold.models.rod import AT_STRETCH, W_STRETCH, Rod, hermite
from stripfold.solve.linear import Band

MAX_ITERATIONS = 15
CONVERGED = 1e-8
"""Largest step of an unknown at convergence: the next one is about its square."""
MAX_STEP = 0.3
"""Largest step of a node, free lengths: beyond, it is another branch."""


class FreeState(NamedTuple):
    """A state: the unit rod's unknowns, the horizontal force at the gripper and the free length."""

    q: Array
    force: float
    length: float


class Guess(NamedTuple):
    """A state and its stress as :meth:`.Rod.predict_stress` gives it, shape (n_elements, 9)."""

    state: FreeState
    predicted_stress: Array


POWER = np.repeat([1.0, -1.0], [3, 6])
"""Power of the free length in the energy of each strain."""


class Linearised(NamedTuple):
    """Forces in a state and their derivatives, all of shape (size,) but the tangent.

    ``force`` is the unbalanced force, with the moment at the lift-off as the equation of the free length; the others
    are its derivatives by the nodes, by the free length and by H.
    """

    force: Array
    tangent: Band
    by_length: Array
    by_force: Array


@dataclass(frozen=True)
class FreeRod:
    """A strip of which the free part is a rod; make it with :meth:`of`.

    Attributes
    ----------
    unit
        The free part in units of its length, from the grasped end to the lift-off.
    length, height
        Of the strip and of the gripper.
    """

    unit: Rod
    length: float
    height: float
    _held: Index = field(repr=False)

    @classmethod
    def of(cls, length: float, thickness: float, height: float, ends: Array) -> FreeRod:
        """A strip whose free part has elements with these ends, shares of it from the grasped end, shape (m,)."""
        unit = Rod.of(1.0, thickness, elements=ends)
        last = 4 * (len(ends) - 1)
        # The gripper's height, and at the lift-off place and slope are prescribed.
        return cls(unit, length, height, np.array([1, last, last + 1, last + 3]))

    @property
    def membrane(self) -> float:
        """Membrane stiffness."""
        return 12.0 / self.unit.thickness**2

    def stretch(self, force: float) -> float:
        """Stretch of the lying part: membrane (e^2 - 1) / 2 e = -H."""
        e = 1.0 - force / self.membrane
        for _ in range(4):
            e -= (0.5 * (e**3 - e) + force / self.membrane) / (1.5 * e**2 - 0.5)
        return e

    def advance(self, state: FreeState) -> float:
        """lambda: advance of the gripper from its place when the strip is flat."""
        q, force, length = state
        return (self.length - length) * (1.0 - self.stretch(force)) + length * float(q[0])

    def position(self, state: FreeState, per_element: int = 4) -> Array:
        """Places of the free part from the lift-off, shape (m, 2), ``per_element`` of each element."""
        value = hermite(np.arange(per_element) / per_element)[0].T
        size = np.diff(self.unit.s)
        nodes = state.q.reshape(-1, 4)
        place = nodes[:, :2] + np.stack([self.unit.s - 1.0, np.zeros_like(self.unit.s)], axis=1)
        slope = nodes[:, 2:] + np.array([1.0, 0.0])
        terms = (place[:-1], size[:, None] * slope[:-1], place[1:], size[:, None] * slope[1:])
        inner = sum(v[None, :, None] * term[:, None, :] for v, term in zip(value, terms, strict=True))
        return state.length * np.concatenate([np.reshape(inner, (-1, 2)), place[-1:]])

    def bent(self, state: FreeState, per_element: int = 4) -> Array:
        """The free part in the frame with its origin mid-strip, shape (m, 3): distance from the grasped end, x, z."""
        place = self.position(state, per_element)
        share = np.linspace(0.0, 1.0, per_element, endpoint=False)
        s = self.unit.s[:-1, None] + np.diff(self.unit.s)[:, None] * share
        lift_off = self.length / 2.0 - (self.length - state.length) * self.stretch(state.force)
        along = state.length * np.append(s, 1.0)
        return np.stack([along, place[:, 0] + lift_off, place[:, 1]], axis=1)

    def clearance(self, state: FreeState) -> float:
        """Height of the sag over the floor, infinite where nothing sags."""
        z = self.position(state)[:, 1]
        least = np.flatnonzero((z[1:-1] < z[:-2]) & (z[1:-1] <= z[2:])) + 1
        return float(z[least].min(initial=np.inf))

    def _rod(self, length: float) -> Rod:
        """The free part at a length."""
        return replace(self.unit, stiffness=self.unit.stiffness * length**POWER)

    def linearised(self, state: FreeState, predicted_stress: Array) -> Linearised:
        """Forces, and their derivatives with ``predicted_stress`` (:meth:`.Rod.predict_stress`)."""
        q, horizontal, length = state
        rod, weight = self._rod(length), self.unit.weight
        inner, tangent = rod.force_and_tangent(q, predicted_stress)
        force = inner + length**2 * weight
        force[0] -= length * horizontal
        # In units of the free length the gripper's height falls.
        falls = np.zeros(self.unit.size)
        falls[1] = -self.height / length**2
        by_length = rod.force_of(q, predicted_stress * POWER) / length + 2.0 * length * weight + tangent @ falls
        by_length[0] -= horizontal
        by_force = np.zeros(self.unit.size)
        by_force[0] = -length
        return Linearised(force, tangent, by_length, by_force)

    def from_elastica(self, state: elastica.State) -> Guess:
        """A state of the elastica, which cannot stretch, as a guess."""
        sigma, length = self.unit.s, state.length
        at = state.at(length * (1.0 - sigma))
        # The elastica's axis points from the lift-off to the gripper, the rod's the other way; it counts tension.
        place = np.stack([1.0 - sigma - at.x / length, at.z / length], axis=1)
        slope = np.stack([np.cos(at.theta) - 1.0, -np.sin(at.theta)], axis=1)
        q = np.concatenate([place, slope], axis=1).ravel()
        # Its tension is known; the strains on this mesh would give that of the mesh.
        predicted_stress = self._rod(length).predict_stress(q, np.zeros_like(q))
        share = sigma[:-1, None] + np.diff(sigma)[:, None] * AT_STRETCH
        at = state.at(length * (1.0 - share))
        tension = state.force_x * np.cos(at.theta) + (state.force_0 + at.s) * np.sin(at.theta)
        predicted_stress[:, :3] = length * np.diff(sigma)[:, None] * W_STRETCH * tension
        return Guess(FreeState(q, -state.force_x, length), predicted_stress)

    def slope(self, state: FreeState) -> float:
        """d lambda / d l along the branch."""
        rate, by_force = self._rates(state)
        e = self.stretch(state.force)
        stretching = -1.0 / (self.membrane * (1.5 * e**2 - 0.5))  # de / dH
        lying = e - 1.0 - (self.length - state.length) * stretching * by_force
        return float(lying + state.q[0] + state.length * rate[0])

    def guess(self, state: FreeState) -> Guess:
        """A state as a guess for a rod of other thickness, with its stress."""
        return Guess(state, self._rod(state.length).predict_stress(state.q, np.zeros_like(state.q)))

    def moved(self, state: FreeState, length: float) -> Guess:
        """A guess for the state at another free length, along the branch's tangent."""
        rate, by_force = self._rates(state)
        ahead = length - state.length
        q = state.q + ahead * rate
        q[1] = self.height / length
        predicted_stress = self._rod(length).predict_stress(state.q, q - state.q)
        return Guess(FreeState(q, state.force + ahead * by_force, length), predicted_stress)

    def _rates(self, state: FreeState) -> tuple[Array, float]:
        """Derivatives of the unknowns and of H by the free length along the branch."""
        at = self.linearised(*self.guess(state))._replace(force=np.zeros(self.unit.size))
        step, _, by_force = self._step(at, length=1.0)
        return step, by_force

    def solve(self, guess: Guess, *, length: float | None = None, force: float | None = None) -> FreeState:
        """The equilibrium near a guess with a free length or with a horizontal force.

        Raises
        ------
        SolveError
            Newton's method does not converge, or finds another branch.
        """
        state, predicted_stress = guess
        for _ in range(MAX_ITERATIONS):
            q = state.q.copy()
            q[1] = self.height / state.length
            state = state._replace(q=q)
            to_length = None if length is None else length - state.length
            to_force = None if force is None else force - state.force
            step, dl, dh = self._step(self.linearised(state, predicted_stress), length=to_length, force=to_force)
            new = FreeState(q + step, state.force + dh, state.length + dl)
            moved = float(np.abs(step).max())
            if not 0.0 < new.length < np.inf or not moved < MAX_STEP:
                break
            new.q[1] = self.height / new.length
            if max(moved, abs(dl), abs(dh)) < CONVERGED:
                return new
            predicted_stress = self._rod(new.length).predict_stress(q, new.q - q)
            state = new
        raise SolveError("no equilibrium of the free rod is near the prediction", parameter=state.length)

    def _step(
        self, at: Linearised, *, length: float | None = None, force: float | None = None
    ) -> tuple[Array, float, float]:
        """Newton's step of nodes, free length and H, with that of one of the last two given."""
        moment = self._held[-1]
        right = np.stack([-at.force, -at.by_length, -at.by_force], axis=1)
        row = np.zeros(self.unit.size)
        row[moment] = 1.0
        row = at.tangent @ row
        row[self._held] = 0.0
        last = right[moment].copy()
        right[self._held] = 0.0
        nodes, by_length, by_force = at.tangent.with_fixed(self._held).factor()(right).T
        # The moment at the lift-off determines the unknown that is not given.
        lack, of_length, of_force = last - np.array([row @ nodes, row @ by_length, row @ by_force])
        if force is None:
            dl = float(length or 0.0)
            dh = -(lack + of_length * dl) / of_force
        else:
            dh = force
            dl = -(lack + of_force * dh) / of_length
        return nodes + dl * by_length + dh * by_force, float(dl), float(dh)

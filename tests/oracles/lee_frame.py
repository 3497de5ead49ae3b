"""Lee's frame: a hinged right-angled frame whose path has maxima of the load and of the displacement.

Two independent models of the same frame: co-rotational beam elements as a problem for the solver, and shooting on the
differential equations of the extensible elastica as the truth.  Data: legs of 120, EI = 1440, EA = 4320 (E = 720,
I = 2, A = 6), load downwards on the upper leg at 24 from the corner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from oracles.toys import NONE, Dense
from stripfold.base.arrays import Array, Index
from stripfold.solve.problem import FixedUnknowns

LEG, LOAD_AT, BENDING, AXIAL = 120.0, 24.0, 1440.0, 4320.0


@dataclass(frozen=True)
class LeeFrame(FixedUnknowns):
    """The frame of ``per_leg`` elements in each leg (a multiple of five); unknowns (u, v, rotation) by node."""

    per_leg: int = 10

    @property
    def nodes(self) -> Array:
        """Reference positions, shape (2 per_leg + 1, 2), from the foot over the corner to the end."""
        along = np.linspace(0.0, LEG, self.per_leg + 1)
        column = np.stack([0.0 * along, along], axis=1)
        beam = np.stack([along, np.full_like(along, LEG)], axis=1)
        return np.concatenate([column, beam[1:]])

    @property
    def loaded(self) -> int:
        """Unknown under the load: the vertical displacement of its node."""
        return 3 * (self.per_leg + round(LOAD_AT / LEG * self.per_leg)) + 1

    @property
    def size(self) -> int:
        return 3 * (2 * self.per_leg + 1)

    @property
    def prescribed(self) -> Index:
        last = self.size - 3
        return np.array([0, 1, last, last + 1])

    @property
    def bounded(self) -> Index:
        return NONE

    @property
    def lower(self) -> Array:
        return np.zeros(0)

    @property
    def metric(self) -> Array:
        metric = np.zeros((self.size // 3, 3))
        metric[:, :2] = 1.0 / len(metric)
        return metric.ravel()

    @property
    def mass(self) -> Dense:
        return Dense(np.diag(self.metric + 1e-3))

    def residual(self, q: Array, lam: float) -> Array:
        return self.linearise(q, lam)[0]

    def linearise(self, q: Array, lam: float, predicted_stress: None = None) -> tuple[Array, Dense, Array]:
        r, k, rate = np.zeros(self.size), np.zeros((self.size, self.size)), np.zeros(self.size)
        nodes = self.nodes
        for i in range(len(nodes) - 1):
            at = np.arange(3 * i, 3 * i + 6)
            force, stiffness = element(nodes[i : i + 2], q[at].reshape(2, 3))
            r[at] += force
            k[np.ix_(at, at)] += stiffness
        rate[self.loaded] = 1.0
        return r + lam * rate, Dense(k), rate

    def energy(self, q: Array) -> float:
        """Elastic energy, for a check of the element's derivatives."""
        nodes = self.nodes
        return sum(_strains(nodes[i : i + 2], q[3 * i : 3 * i + 6].reshape(2, 3))[0] for i in range(len(nodes) - 1))

    def predict_stress(self, q: Array, dq: Array) -> None:
        return None

    def admissibility(self, q: Array) -> str:
        return ""

    def prescribed_values(self, lam: float) -> Array:
        return np.zeros(4)

    def prescribed_rates(self, lam: float) -> Array:
        return np.zeros(4)


def _strains(nodes: Array, moved: Array) -> tuple[float, float, Array, float, Array, float]:
    """Energy, axial force, end moments, length, direction and reference length of an element."""
    before, after = nodes[1] - nodes[0], nodes[1] + moved[1, :2] - nodes[0] - moved[0, :2]
    l0, length = float(np.hypot(*before)), float(np.hypot(*after))
    turn = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
    local = moved[:, 2] - turn
    local -= 2.0 * np.pi * np.round(local / (2.0 * np.pi))
    force = AXIAL * (length - l0) / l0
    moments = 2.0 * BENDING / l0 * np.array([[2.0, 1.0], [1.0, 2.0]]) @ local
    return 0.5 * (force * (length - l0) + float(moments @ local)), force, moments, length, after / length, l0


def element(nodes: Array, moved: Array) -> tuple[Array, Array]:
    """Force (6,) and tangent (6, 6) of a co-rotational beam element (Crisfield, 1991)."""
    _, force, moments, length, (c, s), l0 = _strains(nodes, moved)
    stretch = np.array([-c, -s, 0.0, c, s, 0.0])
    across = np.array([s, -c, 0.0, -s, c, 0.0])
    ends = -np.stack([across, across]) / length
    ends[0, 2] = ends[1, 5] = 1.0
    stiffness = AXIAL / l0 * np.outer(stretch, stretch)
    stiffness += 2.0 * BENDING / l0 * ends.T @ np.array([[2.0, 1.0], [1.0, 2.0]]) @ ends
    stiffness += force / length * np.outer(across, across)
    twist = np.outer(stretch, across)
    stiffness += moments.sum() / length**2 * (twist + twist.T)
    return force * stretch + ends.T @ moments, stiffness


def shoot(unknown: Array) -> tuple[Array, float]:
    """Defect at the far hinge (place and moment), and the height of the loaded point.

    ``unknown``: the foot's angle, horizontal and vertical force in the column, and the load.
    """
    turn, h, v, load = unknown
    state = np.array([0.0, 0.0, turn, 0.0])
    loaded = 0.0

    def rhs(_: float, y: Array, vertical: float) -> Array:
        c, s = np.cos(y[2]), np.sin(y[2])
        stretch = 1.0 + (h * c + vertical * s) / AXIAL
        return np.array([stretch * c, stretch * s, y[3] / BENDING, -stretch * (vertical * c - h * s)])

    for span, vertical, corner in ((LEG, v, np.pi / 2.0), (LOAD_AT, v, 0.0), (LEG - LOAD_AT, v + load, 0.0)):
        loaded = float(state[1])
        state = solve_ivp(rhs, (0.0, span), state, "DOP853", rtol=1e-10, atol=1e-10, args=(vertical,)).y[:, -1]
        state[2] -= corner
    return np.array([state[0] - LEG, state[1] - LEG, state[3] / LEG]), loaded


def load_at(height: float, guess: Array) -> Array:
    """The state (see :func:`shoot`) whose loaded point is at ``height``, near ``guess``."""

    def defect(unknown: Array) -> Array:
        at_hinge, loaded = shoot(unknown)
        return np.append(at_hinge, loaded - height)

    unknown = np.array(guess, dtype=float)
    steps = 1e-5 * np.eye(4)
    for _ in range(8):
        value = defect(unknown)
        if np.abs(value).max() < 1e-7:
            return unknown
        jacobian = np.column_stack([(defect(unknown + e) - defect(unknown - e)) / 2e-5 for e in steps])
        unknown -= np.linalg.solve(jacobian, value)
    raise AssertionError(f"shooting missed the hinge by {np.abs(value).max():.1e}")


def limit_load(height: float, guess: Array, step: float = 1.0) -> float:
    """Extreme load near the height ``height`` of the loaded point: the top of a quartic through five exact states."""
    heights = height + step * np.arange(-2, 3)
    state, loads = np.asarray(guess), []
    for at in heights:
        state = load_at(at, state)
        loads.append(state[3])
    quartic = np.polynomial.Polynomial.fit(heights, loads, 4)
    extremes = quartic.deriv().roots()
    inside = extremes[(np.abs(extremes.imag) < 1e-12) & (np.abs(extremes.real - height) < 2.0 * step)].real
    assert len(inside) == 1
    return float(quartic(inside[0]))

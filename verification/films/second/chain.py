"""The strip as a chain of point masses with axial springs and hinges, integrated in time explicitly.

Units: L*, the strip's weight per length and sqrt(L*/g).  Node 0 is gripped, the last is pinned on the floor at x = 0
(nodes have x < 0 while the strip is flat); a node moves freely otherwise.  The hinges are elastic with viscosity and,
in parallel, Prandtl elements (a spring that slides at a limit moment), the chain's own model of friction in bending.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SPACING, STEP = 0.08, 1.25e-3
"""Distance between nodes, and the time step, below the limit 2 / omega of the axial springs."""
WAVE = 30.0
"""Speed of axial waves: the strip stretches by 0.3 % under its own weight."""
FLOOR, DAMPING = 300.0, 15.0
"""Stiffness and damping of the floor: soft, so that no single node lifts off at a time; the strip sinks in by 0.003."""
SLIDING, CREEP, REVERSED = 0.4, 2e-3, 0.05
"""Coefficient of friction of the floor, the speed up to which it grows, and the slope past which a node is of the upper
layer."""


class Hinges(NamedTuple):
    """Damping of a chain, and the layer's thickness: drag of the air, viscosity, limit moment of the friction."""

    drag: float = 0.15
    viscosity: float = 0.001
    friction: float = 0.0
    thickness: float = 0.03


# Loops over neighbours that do not depend on each other: the compiler turns them into vector instructions.
@numba.njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _march(x, z, u, w, slip, path, drag, viscosity, friction, thickness, every):  # type: ignore[no-untyped-def]
    """March along the gripper's ``path``, one place for each step; the state is changed, every so many are returned."""
    n = len(x)
    ex, ez, length, ax, az, rotation, moment = np.zeros((7, n))
    kept = np.zeros((len(path) // every, n, 2))
    for k in range(len(path)):
        u[0], w[0] = (path[k, 0] - x[0]) / STEP, (path[k, 1] - z[0]) / STEP
        x[0], z[0] = path[k, 0], path[k, 1]
        for i in range(n - 1):
            ex[i], ez[i] = x[i + 1] - x[i], z[i + 1] - z[i]
            square = ex[i] * ex[i] + ez[i] * ez[i]
            length[i] = np.sqrt(square)
            ax[i], az[i] = -ez[i] / square, ex[i] / square
            rotation[i] = ax[i] * (u[i + 1] - u[i]) + az[i] * (w[i + 1] - w[i])
        for i in range(1, n - 1):
            spin = rotation[i] - rotation[i - 1]
            sine, cosine = ex[i - 1] * ez[i] - ez[i - 1] * ex[i], ex[i - 1] * ex[i] + ez[i - 1] * ez[i]
            turn = 2.0 * sine / (length[i - 1] * length[i] + cosine)
            slip[i] = min(max(slip[i] + spin * STEP / SPACING, -friction), friction)  # a spring of unit stiffness
            moment[i] = (turn * (1.0 + 0.25 * turn * turn) + viscosity * spin) / SPACING + slip[i]
        for i in range(n - 1):
            stretching = az[i] * (u[i + 1] - u[i]) - ax[i] * (w[i + 1] - w[i])
            pull = WAVE * WAVE * ((length[i] - SPACING) / (SPACING * length[i]) + 1e-3 * stretching / SPACING)
            shear = moment[i] - moment[i + 1]
            # From here on the force between the two nodes.
            rotation[i], length[i] = pull * ex[i] + shear * ax[i], pull * ez[i] + shear * az[i]
        for i in range(1, n - 1):
            along = (rotation[i] - rotation[i - 1]) / SPACING - drag * u[i]
            up = (length[i] - length[i - 1]) / SPACING - 1.0 - drag * w[i]
            deep = (thickness if ex[i] < -REVERSED * SPACING else 0.0) - z[i]
            push = max(FLOOR * deep - DAMPING * w[i], 0.0) if deep > 0.0 else 0.0
            along -= SLIDING * push * min(max(u[i] / CREEP, -1.0), 1.0)
            u[i] += STEP * along
            w[i] += STEP * (up + push)
            x[i] += STEP * u[i]
            z[i] += STEP * w[i]
        if (k + 1) % every == 0:
            kept[k // every, :, 0] = x
            kept[k // every, :, 1] = z
    return kept


class Chain:
    """A chain of a length, its gripped end at ``(advance - length, height)``; a new one lies flat."""

    def __init__(self, length: float, hinges: Hinges) -> None:
        self.count = round(length / SPACING) + 1
        self.length = SPACING * (self.count - 1)
        self.hinges = hinges
        self.state = np.zeros((5, self.count))  # x, z, their rates, and the moments of the friction
        self.state[0] = np.linspace(-self.length, 0.0, self.count)

    def follow(self, advance: Array, height: Array, every: int = 1, drag: float | None = None) -> Array:
        """Take the gripper through advances and heights, shape (m,), a time step apart.

        Returns one in so many states, shape (m // every, n, 2).
        """
        path = np.column_stack([advance - self.length, height])
        hinges = self.hinges if drag is None else self.hinges._replace(drag=drag)
        return np.asarray(_march(*self.state, path, *hinges, every))  # type: ignore[call-arg]

    def prepare(self, advance: float, height: float, duration: float = 45.0) -> None:
        """Lift the gripped end of the flat chain and take it to an advance, smoothly; then let it come to rest."""
        share = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, round(0.4 * duration / STEP)))
        zero, one = np.zeros_like(share), np.ones_like(share)
        self.follow(advance * np.concatenate([zero, share, one]), height * np.concatenate([share, one, one]), drag=1.0)

    def sag(self, states: Array) -> Array:
        """Least height of the upper layer's nodes, shape (m,), in states of shape (m, n, 2)."""
        upper = np.diff(states[:, :, 0], axis=1) < -REVERSED * SPACING
        return np.asarray(np.where(upper, states[:, :-1, 1], np.inf).min(axis=1))


def critical(height: float) -> float:
    """Advance at which a chain without friction snaps: a line through four of :func:`landing`, at heights of 3 to 6."""
    return 6.95 + 0.975 * height


def landing(height: float, start: float, speed: float, length: float = 15.0) -> float:
    """Advance at which the sag of a chain without friction lands, swept from a start; it lags behind the snap."""
    chain = Chain(length, Hinges())
    chain.prepare(start, height)
    block = 400
    while True:
        advance: Array = start + speed * STEP * np.arange(1.0, block + 1.0)
        states = chain.follow(advance, np.full(block, height), every=block)
        if chain.sag(states)[-1] < 2.0 * chain.hinges.thickness:
            return start
        start = float(advance[-1])

"""A strip as a chain of point masses on a table, integrated in time explicitly: it shares no code with the package.

Lengths in L*, forces in rho_a g L*, times in sqrt(L*/g).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numba
import numpy as np

from stripfold.base.arrays import Array

VISCOUS = 2e-4
"""Viscosity of the chain: it damps waves of one node."""
SPRING, YIELDS = 4.0, 0.05
"""Largest stiffness of the friction of a hinge before it slides, that of the strip being 1, and the curvature at which
it slides if it is less stiff, 1 / L*: docs/physics.md, section 8."""


@dataclass(frozen=True)
class Chain:
    """``arc``: distances of the nodes from the grasped end, shape (n,); ``stretching``: 12 / h^2; ``step``: of time.

    ``friction``: of the hinges, which slide at this moment; ``spring``: their stiffness before that.
    """

    arc: Array
    stretching: float
    step: float
    friction: float
    spring: float

    @classmethod
    def of(cls, length: float, thickness: float, spacing: float, friction: float = 0.0) -> Chain:
        """A strip of a length, with nodes ``spacing`` or less apart, and with friction in bending."""
        arc, stretching = np.linspace(0.0, length, ceil(length / spacing) + 1), 12.0 / thickness**2
        spring = min(friction / YIELDS, SPRING)
        step = 0.4 * min(arc[1] / sqrt(stretching), arc[1] ** 2 / 2.0 / sqrt(1.0 + spring))
        return cls(arc, stretching, step, friction, spring)

    def flat(self, table: Array | float = 0.0) -> Array:
        """The flat chain at rest, shape (6, n): x, with its origin mid-strip, z, their rates, curvature, friction."""
        state = np.zeros((6, len(self.arc)))
        state[0], state[1] = self.arc - 0.5 * self.arc[-1], table
        return state

    def follow(self, state: Array, path: Array, drag: float, table: Array | None = None, mu: float = 0.0) -> Array:
        """Take the gripper along a path, shape (m, 2), one place for each step; the state is changed.

        ``table``: its height under each node.  ``mu``: friction of the table.

        Returns each node's largest height over the table, shape (n,).
        """
        heights = np.zeros_like(self.arc) if table is None else table
        return np.asarray(
            _march(  # type: ignore[call-arg]
                *state, heights, path, self.step, self.arc[1], self.stretching, drag, mu, self.friction, self.spring
            )
        )


@numba.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})  # type: ignore[untyped-decorator]
def _march(  # type: ignore[no-untyped-def]
    x, z, u, w, kappa, slip, table, path, step, spacing, stretching, drag, mu, friction, spring
):
    n = len(x)
    top, fx, fz, strain = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    for k in range(len(path)):
        u[0], w[0] = (path[k, 0] - x[0]) / step, (path[k, 1] - z[0]) / step
        x[0], z[0] = path[k, 0], path[k, 1]
        fx[:], fz[:] = 0.0, 0.0
        for i in range(n - 1):
            dx, dz = x[i + 1] - x[i], z[i + 1] - z[i]
            strain[i] = 0.5 * ((dx * dx + dz * dz) / (spacing * spacing) - 1.0)
            rate = (dx * (u[i + 1] - u[i]) + dz * (w[i + 1] - w[i])) / (spacing * spacing)
            bent = 0.75 * (kappa[i] * kappa[i] + kappa[i + 1] * kappa[i + 1])
            pull = (stretching * (strain[i] + VISCOUS * rate) + bent) / spacing
            fx[i] += pull * dx
            fz[i] += pull * dz
            fx[i + 1] -= pull * dx
            fz[i + 1] -= pull * dz
        for i in range(1, n - 1):
            ax, az, bx, bz = x[i] - x[i - 1], z[i] - z[i - 1], x[i + 1] - x[i], z[i + 1] - z[i]
            a, b = ax * ax + az * az, bx * bx + bz * bz
            # Rates of the two segments' angles by the places of their farther ends.
            px, pz, qx, qz = -az / a, ax / a, -bz / b, bx / b
            spin = qx * (u[i + 1] - u[i]) + qz * (w[i + 1] - w[i]) - px * (u[i] - u[i - 1]) - pz * (w[i] - w[i - 1])
            turn = np.arctan2(ax * bz - az * bx, ax * bx + az * bz)
            slip[i] = min(max(slip[i] + spring * (turn / spacing - kappa[i]), -friction), friction)
            kappa[i] = turn / spacing
            stiffness = 1.0 + 1.5 * (strain[i - 1] + strain[i]) + 0.9 / stretching * kappa[i] * kappa[i]
            moment = (stiffness * turn + VISCOUS * spin) / spacing + slip[i]
            fx[i + 1] -= moment * qx
            fz[i + 1] -= moment * qz
            fx[i] += moment * (qx + px)
            fz[i] += moment * (qz + pz)
            fx[i - 1] -= moment * px
            fz[i - 1] -= moment * pz
        for i in range(1, n - 1):
            u[i] += step * (fx[i] / spacing - drag * u[i])
            w[i] += step * (fz[i] / spacing - 1.0 - drag * w[i])
            if mu > 0.0 and w[i] < 0.0 and z[i] <= table[i]:
                # The impulse that the table stops it with, times mu, stops it along x if it can.
                u[i] = np.sign(u[i]) * max(abs(u[i]) + mu * w[i], 0.0)
                w[i] = 0.0
            x[i] += step * u[i]
            z[i] += step * w[i]
            if z[i] < table[i]:
                z[i], w[i] = table[i], max(w[i], 0.0)
            top[i] = max(top[i], z[i] - table[i])
    return top

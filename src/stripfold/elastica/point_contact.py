"""A free part that rests on the lower layer at one point: the phase of the R-path from first contact to the fold.

The contact point rolls on until the curvature there vanishes; from then on the strip lies flat behind it and the loop
is the folded one (docs/physics.md, section 9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid, resample
from stripfold.elastica._system import NODE_COUNTS, TOLERANCE, next_count
from stripfold.elastica.state import State
from stripfold.errors import NewtonError, SolveError

SPACING = 0.1
"""Largest difference of the curvature at the contact between successive states, 1/L*."""
MAX_NODES = NODE_COUNTS[-3]
COMPLEX_STEP = 1e-30


@dataclass(frozen=True, eq=False)
class PointContact:
    """A free part in contact with the lower layer at one point.

    Parameters
    ----------
    loop
        From lift-off to the contact; unlike in other states the curvature at its end is not zero.
    upper
        From the contact to the gripper; arc length from the contact, position in the loop's frame.
    reaction
        Concentrated reaction of the floor at the contact.
    """

    loop: State
    upper: State
    reaction: float

    @property
    def gripper(self) -> tuple[float, float]:
        """Position (X, Z) of the gripper."""
        return self.upper.gripper


def states_point_contact(first: State) -> Iterator[PointContact]:
    """States of one free length, the curvature at the contact going from that at first contact to zero.

    Parameters
    ----------
    first
        The state at first contact: the last of :func:`.states_fixed_lift_off`.

    Raises
    ------
    SolveError
        No convergence.
    """
    sag = first.sag
    if sag is None:
        raise SolveError("the state does not sag: it cannot touch")
    start = float(first.at(sag.s).curvature)
    problem = _TwoParts(first.length, 48)
    y = problem.guess(first, sag.s)
    for share in np.linspace(1.0, 0.0, int(np.ceil(abs(start) / SPACING)) + 1):
        problem, y = problem.solve(y, share * start)
        yield problem.state(y)


@dataclass(frozen=True)
class _TwoParts:
    """The collocated problem of a free part with one contact point.

    Unknowns: ``u = d^2 theta / d sigma^2`` at the nodes of loop and upper part, then F_x, F_0, the reaction R at the
    contact, the loop's length. At the contact theta = pi, Z = 0, and the curvature is continuous and given.
    Vectors of unknowns may be columns of an array, real or complex.
    """

    length: float
    n: int

    def angles(self, y: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """theta and d theta / d sigma of loop and upper part; the angles at their ends are built in."""
        g = grid(self.n)
        u, w = y[: self.n], y[self.n : 2 * self.n]
        rate = g.integral @ u
        twice = g.integral @ rate
        theta = twice + np.multiply.outer(g.nodes, np.pi - twice[-1])
        return theta, rate - twice[-1] + np.pi, np.pi + g.angle @ w, g.slope @ w

    def residual(self, y: NDArray, curvature: float) -> NDArray:
        """Residual of the equilibrium of both parts and of the four conditions; the shape of ``y``."""
        g, n = grid(self.n), self.n
        force_x, force_0, reaction, loop = y[2 * n :]
        upper = self.length - loop
        theta, slope, phi, phi_slope = self.angles(y)
        vertical = force_0 + np.multiply.outer(g.nodes, loop)
        vertical_upper = force_0 + loop - reaction + np.multiply.outer(g.nodes, upper)
        return np.concatenate(
            [
                y[:n] - loop**2 * (force_x * np.sin(theta) - vertical * np.cos(theta)),
                y[n : 2 * n] - upper**2 * (force_x * np.sin(phi) - vertical_upper * np.cos(phi)),
                [slope[0], loop * (g.integral[-1] @ np.sin(theta))],
                [slope[-1] / loop - curvature, phi_slope[0] / upper - curvature],
            ]
        )

    def jacobian(self, y: Array, curvature: float) -> Array:
        """Derivative of :meth:`residual` by complex steps: exact to rounding."""
        columns = y[:, None] + 1j * COMPLEX_STEP * np.eye(y.size)
        return np.asarray(self.residual(columns, curvature).imag / COMPLEX_STEP)

    def guess(self, first: State, contact: float) -> Array:
        """Unknowns of the state at first contact, at the arc length ``contact``."""
        nodes = grid(self.n).nodes
        parts = []
        for start, length in ((0.0, contact), (contact, first.length - contact)):
            s = start + length * nodes
            theta = first.at(s).theta
            parts.append(length**2 * (first.force_x * np.sin(theta) - (first.force_0 + s) * np.cos(theta)))
        return np.concatenate([*parts, [first.force_x, first.force_0, 0.0, contact]])

    def solve(self, y: Array, curvature: float) -> tuple[_TwoParts, Array]:
        """Solve, and add nodes until both parts are resolved: the problem with its final grid and the unknowns."""
        y = root(self.residual, y, args=(curvature,), jac=self.jacobian, tol=1e-13).x
        residual = float(np.abs(self.residual(y, curvature)).max())
        if not residual < 1e-9 * max(1.0, float(np.abs(y).max())):
            raise NewtonError(
                "the strip in contact with the lower layer was not found",
                residuals=[residual],
                details={"length": self.length, "curvature": curvature},
            )
        g, n = grid(self.n), self.n
        parts = y[:n], y[n : 2 * n]
        if max(g.tail(part) for part in parts) < TOLERANCE or n >= MAX_NODES:
            return self, y
        finer = replace(self, n=next_count(n))
        return finer.solve(np.concatenate([*(resample(part, finer.n) for part in parts), y[2 * n :]]), curvature)

    def state(self, y: Array) -> PointContact:
        """The two parts as states."""
        force_x, force_0, reaction, loop = (float(value) for value in y[2 * self.n :])
        upper = self.length - loop
        theta, slope, phi, phi_slope = self.angles(y)
        first = State.of(theta, slope / loop, force_x, force_0, loop)
        second = State.of(phi, phi_slope / upper, force_x, force_0 + loop - reaction, upper, first.gripper)
        return PointContact(first, second, reaction)

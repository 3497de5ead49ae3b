"""A free part that rests on the lower layer at one point: the phase of the R-path from first contact to the fold.

The contact point rolls on until the curvature there vanishes; from then on the strip lies flat behind it and the loop
is the folded one (docs/physics.md, section 9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid, resample
from stripfold.elastica._system import NODE_COUNTS, TOLERANCE, next_count
from stripfold.elastica.state import State
from stripfold.errors import NewtonError, SolveError

SPACING = 0.1  # largest difference of the curvature at the contact between successive states, 1/L*
MAX_NODES = NODE_COUNTS[-3]
COMPLEX_STEP = 1e-30


@dataclass(frozen=True, eq=False)
class PointContact:
    """A free part in contact with the lower layer at one point.

    ``loop`` is the part from lift-off to the contact, where its curvature does not vanish; ``upper`` the part from the
    contact, where its arc length starts, to the gripper, in the loop's frame; ``reaction`` that of the floor at the
    contact.
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

    ``first`` is the state at first contact, the last of :func:`.states_fixed_lift_off`.

    Raises
    ------
    SolveError
        No convergence.
    """
    sag = first.sag
    if sag is None:
        raise SolveError("the state does not sag: it cannot touch")
    start = float(first.at(sag.s).curvature)
    y = _guess(first, sag.s, 48)
    for share in np.linspace(1.0, 0.0, int(np.ceil(abs(start) / SPACING)) + 1):
        y = _solve(y, first.length, share * start)
        yield _state(y, first.length)


# The unknowns y: u = d^2 theta / d sigma^2 at the n nodes of the loop, the same of the upper part, then F_x, F_0, the
# reaction R at the contact, the length of the loop. At the contact theta = pi, Z = 0, and the curvature is continuous
# and given.


def _nodes(y: NDArray) -> int:
    return (len(y) - 4) // 2


def _angles(y: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """theta and d theta / d sigma of loop and upper part; the angles at their ends are built in."""
    n = _nodes(y)
    g, u, w = grid(n), y[:n], y[n : 2 * n]
    rate = g.integral @ u
    twice = g.integral @ rate
    theta = twice + np.multiply.outer(g.nodes, np.pi - twice[-1])
    return theta, rate - twice[-1] + np.pi, np.pi + g.angle @ w, g.slope @ w


def _residual(y: NDArray, length: float, curvature: float) -> NDArray:
    """Residual of the equilibrium of both parts and of the four conditions; ``y`` may be an array of columns."""
    n = _nodes(y)
    g = grid(n)
    force_x, force_0, reaction, loop = y[2 * n :]
    upper = length - loop
    theta, slope, phi, phi_slope = _angles(y)
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


def _jacobian(y: Array, length: float, curvature: float) -> Array:
    """Derivative of the residual by complex steps: exact to rounding."""
    columns = y[:, None] + 1j * COMPLEX_STEP * np.eye(y.size)
    return np.asarray(_residual(columns, length, curvature).imag / COMPLEX_STEP)


def _guess(first: State, contact: float, n: int) -> Array:
    """Unknowns of the state at first contact, at the arc length ``contact``."""
    parts = []
    for start, length in ((0.0, contact), (contact, first.length - contact)):
        s = start + length * grid(n).nodes
        theta = first.at(s).theta
        parts.append(length**2 * (first.force_x * np.sin(theta) - (first.force_0 + s) * np.cos(theta)))
    return np.concatenate([*parts, [first.force_x, first.force_0, 0.0, contact]])


def _solve(y: Array, length: float, curvature: float) -> Array:
    """Solve, and add nodes until both parts are resolved."""
    y = root(_residual, y, args=(length, curvature), jac=_jacobian, tol=1e-13).x
    residual = float(np.abs(_residual(y, length, curvature)).max())
    if not residual < 1e-9 * max(1.0, float(np.abs(y).max())):
        raise NewtonError(
            "the strip in contact with the lower layer was not found",
            residuals=[residual],
            details={"length": length, "curvature": curvature},
        )
    n = _nodes(y)
    parts = y[:n], y[n : 2 * n]
    if max(grid(n).tail(part) for part in parts) < TOLERANCE or n >= MAX_NODES:
        return y
    finer = next_count(n)
    return _solve(np.concatenate([*(resample(part, finer) for part in parts), y[2 * n :]]), length, curvature)


def _state(y: Array, length: float) -> PointContact:
    force_x, force_0, reaction, loop = (float(value) for value in y[-4:])
    upper = length - loop
    theta, slope, phi, phi_slope = _angles(y)
    first = State.of(theta, slope / loop, force_x, force_0, loop)
    second = State.of(phi, phi_slope / upper, force_x, force_0 + loop - reaction, upper, first.gripper)
    return PointContact(first, second, reaction)

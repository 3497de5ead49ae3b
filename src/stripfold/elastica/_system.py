"""The collocated boundary-value problem of the heavy elastica and its Newton solver.

Arc length is scaled, s = l sigma with sigma in [0, 1].  The unknown is ``u = d^2 theta / d sigma^2``
at the nodes; the tangent angle follows by integration with theta(0) = 0 and k(l) = 0, which all
problems here share (docs/physics.md, section 4)::

    theta = G u,      u = l^2 (F_x sin(theta) - (F_0 + l sigma) cos(theta))

Three scalars follow the nodal values in the vector of unknowns: F_x, F_0, l.  Three closing
conditions fix them; which ones is what tells one problem from another.  Nothing is shot from one
end to the other, so nothing grows exponentially.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import Grid, grid, resample
from stripfold.errors import NewtonError

SCALARS = 3
FORCE_X, FORCE_0, LENGTH = -3, -2, -1
"""Places of the scalars, counted from the end of the vector of unknowns."""

NODE_COUNTS = (24, 32, 48, 64, 96, 128, 192, 256, 384)
TOLERANCE = 1e-11
"""Largest tail of the coefficients of u, relative, of a state that is handed out."""

ROUNDING = 1e-12
"""Largest residual of such a state, relative."""

MAX_ROTATION = 0.6
"""Largest change of theta, rad, in one Newton update: the trust region."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Everything that residual, Jacobian and closing conditions share at one vector ``y``."""

    y: Array
    grid: Grid
    theta: Array
    cos: Array
    sin: Array

    @property
    def length(self) -> float:
        """Length of the free part."""
        return float(self.y[LENGTH])


Closing = tuple[float, Array]
"""Value that must vanish, and its derivative with respect to all unknowns."""
Condition = Callable[[Evaluation], Closing]


def evaluate(y: Array) -> Evaluation:
    """Angles of the vector of unknowns ``y``, shape (n + 3,)."""
    g = grid(y.size - SCALARS)
    theta = g.angle @ y[: g.n]
    return Evaluation(y, g, theta, np.cos(theta), np.sin(theta))


def angle_change(change: Array) -> Array:
    """Nodal change of theta that belongs to a change of the unknowns."""
    g = grid(change.size - SCALARS)
    return g.angle @ change[: g.n]


def no_lift_off_moment(e: Evaluation) -> tuple[float, Array]:
    """No moment at s = 0: the strip leaves the floor without a kink in curvature."""
    row = np.zeros(e.y.size)
    row[: e.grid.n] = e.grid.slope[0]
    return float(row @ e.y), row


def _angle_row(e: Evaluation, weights: Array) -> Array:
    """Derivative of ``weights . theta`` with respect to the unknowns."""
    row = np.zeros(e.y.size)
    row[: e.grid.n] = weights @ e.grid.angle
    return row


def end_height(z: float) -> Condition:
    """Condition Z(l) = z."""

    def condition(e: Evaluation) -> tuple[float, Array]:
        rise = e.grid.integral[-1] @ e.sin
        row = _angle_row(e, e.length * e.grid.integral[-1] * e.cos)
        row[LENGTH] = rise
        return float(e.length * rise - z), row

    return condition


def end_angle(angle: float) -> Condition:
    """Condition theta(l) = angle."""

    def condition(e: Evaluation) -> tuple[float, Array]:
        weights = np.zeros(e.grid.n)
        weights[-1] = 1.0
        return float(e.theta[-1] - angle), _angle_row(e, weights)

    return condition


def fixed(place: int, value: float) -> Condition:
    """Condition that the scalar at ``place`` has this value."""

    def condition(e: Evaluation) -> tuple[float, Array]:
        row = np.zeros(e.y.size)
        row[place] = 1.0
        return float(e.y[place] - value), row

    return condition


def on_plane(normal: Array, point: Array) -> Condition:
    """Condition that ``y`` lies on the plane through ``point`` (the step of a continuation)."""

    def condition(e: Evaluation) -> tuple[float, Array]:
        return float(normal @ (e.y - point)), normal

    return condition


def lifted(z: float) -> tuple[Condition, ...]:
    """Conditions of every state between a lift-off point and a hinged gripper at height ``z``."""
    return (no_lift_off_moment, end_height(z))


def residual(e: Evaluation, closing: Sequence[Closing]) -> Array:
    """Residual, shape (n + 3,), given what the three conditions say."""
    y, n, l2 = e.y, e.grid.n, e.length**2
    out = np.empty(y.size)
    out[:n] = y[:n] - l2 * (y[FORCE_X] * e.sin - (y[FORCE_0] + y[LENGTH] * e.grid.nodes) * e.cos)
    out[n:] = [value for value, _ in closing]
    return out


def jacobian(e: Evaluation, rows: Sequence[Array]) -> Array:
    """Derivative of :func:`residual`, shape (n + 3, n + 3), given that of the three conditions."""
    y, g, l2 = e.y, e.grid, e.length**2
    n, nodes = g.n, g.nodes
    vertical = y[FORCE_0] + e.length * nodes
    stiffness = -l2 * (y[FORCE_X] * e.cos + vertical * e.sin)
    out = np.empty((y.size, y.size))
    np.multiply(stiffness[:, None], g.angle, out=out[:n, :n])
    np.einsum("ii->i", out[:n, :n])[...] += 1.0
    out[:n, FORCE_X] = -l2 * e.sin
    out[:n, FORCE_0] = l2 * e.cos
    out[:n, LENGTH] = -2.0 * e.length * (y[FORCE_X] * e.sin - vertical * e.cos) + l2 * nodes * e.cos
    out[n:] = rows
    return out


@dataclass(frozen=True, slots=True)
class Factors:
    """LU factors of a square matrix, kept for several right-hand sides."""

    lu: Array
    pivots: Array

    @property
    def sign(self) -> float:
        """Sign of the determinant; 0 for a singular matrix."""
        diagonal = self.lu.diagonal()
        if not diagonal.all():
            return 0.0
        swaps = np.count_nonzero(self.pivots != np.arange(self.pivots.size))
        return -1.0 if (swaps + np.count_nonzero(diagonal < 0.0)) % 2 else 1.0

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side."""
        return np.asarray(dgetrs(self.lu, self.pivots, right)[0], dtype=np.float64)


def factor(matrix: Array) -> Factors:
    """LU factors with partial pivoting; LAPACK directly, as the matrices are small."""
    lu, pivots, _ = dgetrf(matrix)
    return Factors(lu, pivots)


def newton(
    y: Array, conditions: tuple[Condition, ...], *, limit: int = 25, tolerance: float = ROUNDING
) -> tuple[Evaluation, int]:
    """Solve from the guess ``y``; the node count stays.

    Parameters
    ----------
    y
        Guess, shape (n + 3,); not changed.
    conditions
        Three closing conditions.
    limit
        Largest number of iterations.
    tolerance
        Largest residual, relative; the last update has to be small to the root of it.

    Returns
    -------
    tuple
        The evaluated solution and the number of iterations.

    Raises
    ------
    NewtonError
        No convergence; carries the residual history.  Both the residual and the last update
        must be small: a small update alone is what a stalled iteration shows too.
    """
    history: list[float] = []
    update = np.inf
    e = evaluate(y)
    for iteration in range(limit + 1):
        closing = [condition(e) for condition in conditions]
        right = residual(e, closing)
        history.append(float(np.abs(right).max()))
        if not np.isfinite(history[-1]) or not e.length > 0.0:
            break
        # Rounding in u is relative to its largest value.
        if update < 0.1 * sqrt(tolerance) and history[-1] < tolerance * max(10.0, float(np.abs(e.y).max())):
            return e, iteration
        if iteration == limit:
            break
        change = factor(jacobian(e, [row for _, row in closing])).solve(-right)
        if not np.isfinite(change).all():
            break  # a singular matrix
        rotation = float(np.abs(angle_change(change)).max())
        stretch = abs(float(change[LENGTH])) / e.length
        scale = min(1.0, MAX_ROTATION / max(rotation, 1e-300), 0.3 / max(stretch, 1e-300))
        update = max(rotation, stretch) if scale == 1.0 else np.inf
        e = evaluate(e.y + scale * change)
    raise NewtonError(
        f"Newton's method on the elastica did not converge in {len(history) - 1} iterations",
        residuals=history,
        advice="start closer to the solution, or take a smaller step along the branch",
        details={"nodes": e.grid.n},
    )


def refine(y: Array, n: int) -> Array:
    """The unknowns ``y`` on a grid of ``n`` nodes."""
    return np.concatenate([resample(y[:-SCALARS], n), y[-SCALARS:]])


def next_count(n: int) -> int:
    """The next larger node count.

    Raises
    ------
    NewtonError
        The largest is in use already: the state has details that are not resolved.
    """
    for larger in NODE_COUNTS:
        if larger > n:
            return larger
    raise NewtonError(
        f"the elastica is not resolved with {NODE_COUNTS[-1]} nodes",
        advice="the free part is too long or too sharply bent for this module",
        details={"nodes": n},
    )


def solve(y: Array, conditions: tuple[Condition, ...], *, tolerance: float = TOLERANCE, limit: int = 25) -> Evaluation:
    """Solve and add nodes until the coefficients of ``u`` fall below ``tolerance``.

    Raises
    ------
    NewtonError
        No convergence, or not resolved with the largest node count.
    """
    while True:
        e, _ = newton(y, conditions, limit=limit)
        n = e.grid.n
        if e.grid.tail(e.y[:n]) < tolerance:
            return e
        y = refine(e.y, next_count(n))

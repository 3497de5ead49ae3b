"""The collocated boundary-value problem of the heavy elastica and its Newton solver.

With s = l sigma, sigma in [0, 1], the unknown is ``u = d^2 theta / d sigma^2`` at the nodes; theta follows by
integration with theta(0) = 0 and k(l) = 0, which all problems here share (docs/physics.md, section 4)::

    theta = G u,      u = l^2 (F_x sin(theta) - (F_0 + l sigma) cos(theta))

The scalars F_x, F_0, l follow the nodal values in the vector of unknowns. Three side conditions determine them and
distinguish one problem from another.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import log
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import NewtonError
from stripfold.elastica._chebyshev import Grid, grid, resample

SCALARS = 3
FORCE_X, FORCE_0, LENGTH = -3, -2, -1  # indices in the vector of unknowns
NODE_COUNTS = (24, 32, 40, 48, 56, 64, 72, 80, 96, 112, 128, 160, 192, 256, 320, 384)
TOLERANCE = 1e-11  # of the tail of the coefficients of u, relative, in a returned state
ROUNDING, LAST_UPDATE = 1e-12, 1e-6  # of its residual, relative, and of the last update, whose square is the error
MAX_ROTATION, MAX_LENGTH_CHANGE = 0.6, 0.3  # of theta, rad, and of l, relative, in one Newton update: a trust region


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Quantities at one vector of unknowns ``y`` that residual, Jacobian and side conditions share."""

    y: Array
    grid: Grid
    theta: Array
    cos: Array
    sin: Array

    @property
    def length(self) -> float:
        return self.y.item(LENGTH)

    @property
    def tail(self) -> float:
        """Estimated truncation error of u, relative."""
        return self.grid.tail(self.y[:-SCALARS])


Row = Array | Callable[[], Array]
"""A gradient with respect to all unknowns, shape (n + 3,), or a function that computes it where it is dear."""
ValueAndGradient = tuple[float, Row]
"""A number that must vanish, and its gradient."""
Condition = Callable[[Evaluation], ValueAndGradient]


def computed(row: Row) -> Array:
    """The gradient itself."""
    return row() if callable(row) else row


def evaluate(y: Array) -> Evaluation:
    """Angles of the vector of unknowns ``y``, shape (n + 3,)."""
    g = grid(y.size - SCALARS)
    theta = g.angle @ y[: g.n]
    return Evaluation(y, g, theta, np.cos(theta), np.sin(theta))


def angle_change(change: Array) -> Array:
    """Nodal change of theta for a change of the unknowns."""
    g = grid(change.size - SCALARS)
    return g.angle @ change[: g.n]


def linear(
    value: float = 0.0,
    *,
    nodal: Callable[[Grid], Array] | None = None,
    scalars: Mapping[int, float] = MappingProxyType({}),
) -> Condition:
    """Condition that weighted nodal values plus weighted scalars, by their index, add up to ``value``."""

    def condition(e: Evaluation) -> ValueAndGradient:
        row = np.zeros(e.y.size)
        if nodal is not None:
            row[: e.grid.n] = nodal(e.grid)
        for index, weight in scalars.items():
            row[index] = weight
        return (row @ e.y).item() - value, row

    return condition


no_lift_off_moment = linear(nodal=lambda g: g.slope[0])
"""Condition k(0) = 0."""
no_end_force = linear(scalars={FORCE_0: 1.0, LENGTH: 1.0})
"""Condition F_0 + l = 0: no vertical force at s = l."""


def end_angle(angle: float) -> Condition:
    """Condition theta(l) = angle."""
    return linear(angle, nodal=lambda g: g.angle[-1])


def fixed(index: int, value: float) -> Condition:
    """Condition that the scalar at ``index`` has this value."""
    return linear(value, scalars={index: 1.0})


def height_of(e: Evaluation, weights: Array) -> tuple[float, Array]:
    """Z at a point of the strip, from the quadrature weights of the integral from lift-off to there."""
    rise = (weights @ e.sin).item()
    row = np.zeros_like(e.y)
    row[: e.grid.n] = (e.length * weights * e.cos) @ e.grid.angle
    row[LENGTH] = rise
    return e.length * rise, row


def end_height(z: float) -> Condition:
    """Condition Z(l) = z."""

    def condition(e: Evaluation) -> ValueAndGradient:
        value, row = height_of(e, e.grid.integral[-1])
        return value - z, row

    return condition


def on_plane(normal: Array, point: Array) -> Condition:
    """Condition that ``y`` lies in the plane through ``point``: the corrector of a continuation step."""
    return lambda e: (float(normal @ (e.y - point)), normal)


def gripper_at(z: float) -> tuple[Condition, Condition]:
    """Side conditions of all states between a lift-off point and a hinged gripper at height ``z``."""
    return no_lift_off_moment, end_height(z)


def residual(e: Evaluation, side_values: Sequence[float]) -> Array:
    """Residual, shape (n + 3,), given the values of the side conditions."""
    y, n, l2 = e.y, e.grid.n, e.length**2
    out = np.empty(y.size)
    out[:n] = y[:n] - l2 * (y[FORCE_X] * e.sin - (y[FORCE_0] + y[LENGTH] * e.grid.nodes) * e.cos)
    out[n:] = side_values
    return out


def _linearised(e: Evaluation) -> tuple[Array, Array]:
    """Derivatives of the equilibrium equations at the nodes: by theta there, shape (n,), and by the scalars, (3, n)."""
    horizontal, start, length = e.y[-SCALARS:].tolist()
    l2, vertical = length**2, start + length * e.grid.nodes
    by_scalars = np.empty((SCALARS, e.grid.n), e.y.dtype)
    by_scalars[FORCE_X] = -l2 * e.sin
    by_scalars[FORCE_0] = l2 * e.cos
    by_scalars[LENGTH] = -2.0 * length * (horizontal * e.sin - vertical * e.cos) + l2 * e.grid.nodes * e.cos
    return -l2 * (horizontal * e.cos + vertical * e.sin), by_scalars


def jacobian(e: Evaluation, side_rows: Sequence[Array]) -> Array:
    """Derivative of :func:`residual`, shape (n + 3, n + 3), given the gradients of the side conditions."""
    n = e.grid.n
    by_angle, by_scalars = _linearised(e)
    out = np.empty((e.y.size, e.y.size), order="F")
    np.multiply(by_angle[:, None], e.grid.angle, out=out[:n, :n])
    out.ravel(order="F")[: n * (e.y.size + 1) : e.y.size + 1] += 1.0  # the first n entries of the diagonal
    out[:n, n:] = by_scalars.T
    out[n:] = side_rows
    return out


def weighted(e: Evaluation, weights: Array) -> Array:
    """Gradient of the sum of the equilibrium equations with ``weights``, shape (n,), without the Jacobian."""
    by_angle, by_scalars = _linearised(e)
    return np.concatenate([weights + (weights * by_angle) @ e.grid.angle, by_scalars @ weights])


def solved(matrix: Array, right: Array) -> Array:
    """Solution of a linear system; nan where the matrix is singular.

    By NumPy: to factorise twice where a matrix has two right-hand sides takes less than the import of SciPy.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)


class Corrected(NamedTuple):
    """A state found by Newton's method, and what its last iteration tells of the branch, to :data:`LAST_UPDATE`.

    ``matrix`` is the Jacobian, ``along`` the change of the unknowns by the value of the last condition.
    """

    e: Evaluation
    matrix: Array
    along: Array


def newton(y: Array, conditions: tuple[Condition, ...]) -> Evaluation:
    """The state of :func:`corrected`."""
    return corrected(y, conditions).e


def corrected(y: Array, conditions: tuple[Condition, ...], limit: int = 25) -> Corrected:
    """Solve from the guess ``y``, shape (n + 3,), on its own grid.

    Residual and last update must be small: a small update alone also occurs where the iteration stalls.

    Raises NewtonError: no convergence; carries the residual history.
    """
    history: list[float] = []
    update = np.inf
    e = evaluate(y)
    rights = np.zeros((y.size, 2))
    rights[-1, 1] = 1.0
    matrix = along = rights
    for iteration in range(limit + 1):
        values, rows = zip(*[condition(e) for condition in conditions], strict=True)
        right = residual(e, values)
        history.append(float(np.abs(right).max()))
        if not np.isfinite(history[-1]) or not e.length > 0.0:
            break
        # Rounding in u is relative to its largest value.
        if update < LAST_UPDATE and history[-1] < ROUNDING * max(10.0, float(np.abs(e.y).max())):
            return Corrected(e, matrix, along)
        if iteration == limit:
            break
        rights[:, 0] = -right
        matrix = jacobian(e, [computed(row) for row in rows])
        change, along = solved(matrix, rights).T
        if not np.isfinite(change).all():
            break  # a singular matrix
        rotation = float(np.abs(angle_change(change)).max())
        lengthening = abs(float(change[LENGTH])) / e.length
        scale = min(1.0, MAX_ROTATION / max(rotation, 1e-300), MAX_LENGTH_CHANGE / max(lengthening, 1e-300))
        update = max(rotation, lengthening) if scale == 1.0 else np.inf
        e = evaluate(e.y + scale * change)
    raise NewtonError(
        f"Newton's method on the elastica did not converge in {len(history) - 1} iterations",
        residuals=history,
        advice="start closer to the solution, or take a smaller step along the branch",
        details={"nodes": e.grid.n},
    )


def refine(y: Array, n: int) -> Array:
    """The unknowns ``y`` interpolated on a grid of ``n`` nodes."""
    return np.concatenate([resample(y[:-SCALARS], n), y[-SCALARS:]])


def next_count(n: int) -> int:
    """The next larger node count."""
    if n >= NODE_COUNTS[-1]:
        raise NewtonError(
            f"the elastica is not resolved with {NODE_COUNTS[-1]} nodes",
            advice="the free part is too long or too sharply bent for this module",
            details={"nodes": n},
        )
    return next(larger for larger in NODE_COUNTS if larger > n)


def finer(e: Evaluation) -> Array | None:
    """The unknowns on a grid on which the tail should be below :data:`TOLERANCE`, or None where it is."""
    tail = e.tail
    if tail < TOLERANCE:
        return None
    # The coefficients decay geometrically, or faster.
    wanted = e.grid.n * min(2.0, log(TOLERANCE) / log(min(tail, 0.1)))
    return refine(e.y, next_count(max(e.grid.n, int(wanted))))


def solve(y: Array, conditions: tuple[Condition, ...]) -> Evaluation:
    """Solve from the guess ``y`` and add nodes until the state is resolved."""
    e = newton(y, conditions)
    while (guess := finer(e)) is not None:
        e = newton(guess, conditions)
    return e

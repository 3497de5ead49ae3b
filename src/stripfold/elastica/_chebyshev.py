"""Chebyshev collocation on [0, 1]: nodes, integration matrices, coefficients.

The solvers take the highest derivative as the unknown and integrate it, because integration
is well conditioned: the matrices here have norms of order one at every node count, where
differentiation matrices grow with the fourth power of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from stripfold.arrays import Array

TAIL = 4
"""How many of the last coefficients are looked at to judge the resolution."""


@dataclass(frozen=True, slots=True)
class Grid:
    """A Chebyshev grid of the second kind on [0, 1]; every array is read-only.

    Parameters
    ----------
    nodes
        Shape (n,): nodes from 0 to 1, both included.
    integral
        Shape (n, n): values to values of the integral from 0; the last row is the quadrature.
    slope, angle
        Shape (n, n): second derivative to first derivative and to values of the function that
        vanishes at 0 and whose slope vanishes at 1.
    to_coefficients
        Shape (n, n): values to Chebyshev coefficients.
    barycentric
        Shape (n,): weights of the barycentric formula.
    """

    nodes: Array
    integral: Array
    slope: Array
    angle: Array
    to_coefficients: Array
    barycentric: Array

    @property
    def n(self) -> int:
        """Number of nodes."""
        return self.nodes.size

    def tail(self, values: Array) -> float:
        """Size of the last coefficients relative to the largest: the truncation error."""
        size = np.abs(self.to_coefficients @ values)
        return float(size[-TAIL:].max() / max(float(size.max()), 1e-300))

    def interpolate(self, values: Array, at: Array) -> Array:
        """Interpolant of ``values``, shape (n,) or (n, m), at points ``at`` of [0, 1]."""
        return np.asarray(chebyshev.chebval(2.0 * at - 1.0, self.to_coefficients @ values), dtype=np.float64)

    def value(self, values: Array, at: float) -> Array:
        """Interpolant of the columns of ``values``, shape (n, m), at one point: barycentric, fast."""
        distance = at - self.nodes
        nearest = int(np.argmin(np.abs(distance)))
        if distance[nearest] == 0.0:
            return np.asarray(values[nearest], dtype=np.float64)
        weights = self.barycentric / distance
        return np.asarray((weights @ values) / weights.sum(), dtype=np.float64)


@lru_cache(maxsize=64)
def grid(n: int) -> Grid:
    """Grid with ``n`` nodes, built once.

    Examples
    --------
    >>> g = grid(20)
    >>> bool(abs(g.integral[-1] @ g.nodes**3 - 0.25) < 1e-15)
    True
    """
    t = -np.cos(np.pi * np.arange(n) / (n - 1))
    half = np.ones(n)
    half[[0, -1]] = 0.5
    vander = chebyshev.chebvander(t, n - 1)
    # Discrete cosine transform of the first kind: the exact inverse of `vander`, without inverting.
    coefficients = (2.0 / (n - 1)) * half[:, None] * vander.T * half[None, :]
    # T_m integrates to T_{m+1} / (2 (m + 1)) - T_{m-1} / (2 (m - 1)), less the value at -1.
    antiderivative = np.zeros((n + 1, n))
    m = np.arange(n)
    antiderivative[m + 1, m] = 1.0 / (2.0 * (m + 1))
    antiderivative[m[2:] - 1, m[2:]] = -1.0 / (2.0 * (m[2:] - 1))
    antiderivative[1, 0] = 1.0
    antiderivative[0] -= (-1.0) ** np.arange(n + 1) @ antiderivative
    # Factor one half: d sigma = dt / 2.
    integral = 0.5 * chebyshev.chebvander(t, n) @ antiderivative @ coefficients
    integral[0] = 0.0
    # Both conditions are built in, one at each end: an elliptic operator.  Integrating twice from one
    # end would be shooting in disguise, and its LU factors lose digits on a long free part.
    slope = integral - integral[-1]
    angle = integral @ slope
    barycentric = half * (-1.0) ** np.arange(n)
    arrays = ((t + 1.0) / 2.0, integral, slope, angle, coefficients, barycentric)
    for array in arrays:
        array.flags.writeable = False
    return Grid(*arrays)


def resample(values: Array, n: int) -> Array:
    """The interpolant of nodal ``values`` at the ``n`` nodes of another grid."""
    if values.size == n:
        return values
    return np.asarray(_resampling(values.size, n) @ values)


@lru_cache(maxsize=64)
def _resampling(n: int, m: int) -> Array:
    """Matrix from the values at ``n`` nodes to those of the interpolant at the ``m`` of another grid, shape (m, n)."""
    matrix = np.asarray(chebyshev.chebvander(2.0 * grid(m).nodes - 1.0, n - 1) @ grid(n).to_coefficients)
    matrix.flags.writeable = False
    return matrix

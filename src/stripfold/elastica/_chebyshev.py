"""Chebyshev collocation on [0, 1]: nodes, integration matrices, interpolation.

The unknown of the solvers is the highest derivative. Integration matrices have norms of order one at every node
count; the norms of differentiation matrices grow with its fourth power. A Moebius map concentrates the nodes at 0:
strips bend near lift-off, and their upper part hangs almost straight.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from stripfold.base.arrays import Array

STRETCH = 2.5
"""Spacing of the nodes at 1 over that of an unmapped grid, and the inverse at 0: saves a third of the nodes."""
TAIL = 4
"""Number of trailing coefficients from which the truncation error is estimated."""


@dataclass(frozen=True, slots=True)
class Grid:
    """A mapped Chebyshev grid of the second kind on [0, 1]; all arrays are read-only.

    ``nodes``, shape (n,): from 0 to 1; ``parameter``: of them, before the map.  Shape (n, n): ``integral``, nodal
    values to those of the integral from 0, the last row is the quadrature rule; ``slope``, ``angle``, second derivative
    to first derivative, and to the function that vanishes at 0 and whose slope vanishes at 1; ``to_coefficients``,
    nodal values to Chebyshev coefficients.  ``barycentric``, shape (n,): weights of the barycentric formula.
    """

    nodes: Array
    parameter: Array
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
        """Largest trailing coefficient relative to the largest of all: an estimate of the truncation error."""
        size = np.abs(self.to_coefficients @ values)
        return float(size[-TAIL:].max() / max(float(size.max()), 1e-300))

    def interpolate(self, values: Array, at: ArrayLike) -> Array:
        """Interpolant of ``values``, shape (n,) or (n, m), at points of any shape S of [0, 1]: shape S or (*S, m)."""
        place = np.asarray(at)
        distance = np.subtract.outer(STRETCH * place / (1.0 + (STRETCH - 1.0) * place), self.parameter)
        distance[distance == 0.0] = 1e-300  # makes the weight of this node, relative to the others, 1
        weights = np.divide(self.barycentric, distance, out=distance)
        sums = weights.sum(axis=-1)
        return np.asarray((weights @ values) / (sums if values.ndim == 1 else sums[..., None]))


@lru_cache(maxsize=64)
def grid(n: int) -> Grid:
    """Grid with ``n`` nodes, built once.

    Examples
    --------
    >>> g = grid(40)
    >>> bool(abs(g.integral[-1] @ g.nodes**3 - 0.25) < 1e-15)
    True
    """
    t = -np.cos(np.pi * np.arange(n) / (n - 1))
    half = np.ones(n)
    half[[0, -1]] = 0.5
    # Discrete cosine transform of the first kind: the inverse of the Vandermonde matrix.
    coefficients = (2.0 / (n - 1)) * half[:, None] * chebyshev.chebvander(t, n - 1).T * half
    # Factor one half: d sigma = dt / 2.
    antiderivative = chebyshev.chebint(np.eye(n), lbnd=-1.0, scl=0.5)
    parameter = (t + 1.0) / 2.0
    stretched = STRETCH - (STRETCH - 1.0) * parameter
    integral = chebyshev.chebvander(t, n) @ antiderivative @ coefficients * (STRETCH / stretched**2)
    integral[0] = 0.0
    # One condition at each end makes an elliptic operator. Two conditions at one end would amount to shooting, with
    # LU factors that lose digits where the free part is long.
    slope = integral - integral[-1]
    angle = np.asfortranarray(integral @ slope)  # the order that LAPACK wants of matrices built from it
    arrays = (parameter / stretched, parameter, integral, slope, angle, coefficients, half * (-1.0) ** np.arange(n))
    for array in arrays:
        array.flags.writeable = False
    return Grid(*arrays)


def resample(values: Array, n: int) -> Array:
    """The interpolant of nodal ``values`` at the ``n`` nodes of another grid."""
    return values if values.size == n else np.asarray(_resampling(values.size, n) @ values)


@lru_cache(maxsize=64)
def _resampling(n: int, m: int) -> Array:
    """Matrix from the values at ``n`` nodes to those of their interpolant at ``m`` nodes, shape (m, n)."""
    return grid(n).interpolate(np.eye(n), grid(m).nodes)

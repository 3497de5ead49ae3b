"""The turn of each element, and the force of a moment that depends on it: :class:`.ElementMoments`."""

from __future__ import annotations

from math import atan2
from typing import NamedTuple

import numba
import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.kernels.compiler import compiled, matrix, vector

unknowns_type, factor_type = numba.int64[:, :, :, ::1], numba.float64[:, :, ::1]


class Springs(NamedTuple):
    """Springs with sliders in the elements, of :class:`.Hysteresis`; of no elements where there are none.

    ``unknowns``, ``factor``, ``straight``, ``length``: of :class:`.Directors`.  ``slip``: kappa_p, shape (n_elements,).
    ``limits``: stiffness in an element, kappa_y, and the change of curvature up to which an element sticks.
    """

    unknowns: Index
    factor: Array
    straight: Array
    length: Array
    slip: Array
    limits: Array


springs_type = numba.types.NamedTuple([unknowns_type, factor_type, vector, vector, vector, vector], Springs)
NO_SPRINGS = Springs(np.empty((0, 2, 1, 2), np.int64), np.empty((0, 2, 1)), *(np.empty(0) for _ in range(4)))


@compiled()
def director(unknowns, factor, straight, q):
    """Of one section."""
    x, z = straight
    for f in range(len(factor)):
        x += factor[f] * q[unknowns[f, 0]]
        z += factor[f] * q[unknowns[f, 1]]
    return x, z


@compiled(vector(unknowns_type, factor_type, vector, vector))
def turns(unknowns, factor, straight, q):
    """Angle from the left to the right director of each element, rad, in (-pi, pi], shape (n_elements,).

    Between neighbours, not from angles with an axis: the number of turns of the strip is not limited.
    """
    out = np.empty(len(unknowns))
    for e in range(len(out)):
        x0, z0 = director(unknowns[e, 0], factor[e, 0], straight, q)
        x1, z1 = director(unknowns[e, 1], factor[e, 1], straight, q)
        out[e] = atan2(x0 * z1 - z0 * x1, x0 * x1 + z0 * z1)
    return out


@compiled(
    numba.void(
        unknowns_type, factor_type, vector, vector, vector, vector, vector, matrix, vector, matrix, numba.int64, matrix
    )
)
def assemble(unknowns, factor, straight, length, q, moment, modulus, rate, force, band, top, columns):
    """Add the force of a moment in each element, and its derivatives.

    ``unknowns``, ``factor``, ``straight``, ``length``: of :class:`.Directors`.  ``q``: shape (n,).  ``moment``,
    ``modulus``, ``rate``: the moment, its derivative by the element's mean curvature, shape (n_elements,), and by k
    parameters, with ``q`` fixed, shape (k, n_elements).  ``force``, ``band``, ``top``, ``columns``: what is added to:
    shape (n,); a matrix as in :mod:`.elements`, or empty; and shape (k, n).
    """
    n_points = factor.shape[2]
    gradient, hessian = np.empty((2, 2)), np.empty((2, 2))
    for e in range(len(unknowns)):
        for end in range(2):
            x, z = director(unknowns[e, end], factor[e, end], straight, q)
            sign = (2 * end - 1) / (x * x + z * z)
            gradient[end, 0], gradient[end, 1] = -sign * z, sign * x
        for end in range(2):
            # The second derivative of the angle; the two ends do not couple.
            gx, gz = gradient[end]
            sign = 2 * end - 1
            hessian[0, 0], hessian[1, 1] = -2.0 * sign * gx * gz, 2.0 * sign * gx * gz
            hessian[0, 1] = hessian[1, 0] = sign * (gx * gx - gz * gz)
            for f in range(n_points):
                for i in range(2):
                    row, slope = unknowns[e, end, f, i], factor[e, end, f] * gradient[end, i]
                    force[row] += moment[e] * slope
                    for k in range(len(rate)):
                        columns[k, row] += rate[k, e] * slope
                    if len(band) == 0:
                        continue
                    for other in range(2):
                        for g in range(n_points):
                            for j in range(2):
                                entry = modulus[e] / length[e] * slope * gradient[other, j]
                                if other == end:
                                    entry += moment[e] * hessian[i, j] * factor[e, end, f]
                                column = unknowns[e, other, g, j]
                                band[column, top + row - column] += entry * factor[e, other, g]


@compiled()
def add_springs(springs, q, none, force, band, width):
    """Add the force of the springs in a state, and its derivative."""
    stiffness, kappa_y, sticks = springs.limits
    moment = turns(springs.unknowns, springs.factor, springs.straight, q)
    modulus = np.zeros(len(moment))
    for e in range(len(moment)):
        change = moment[e] / springs.length[e] - springs.slip[e]
        if abs(change) <= sticks:
            modulus[e] = stiffness
        moment[e] = stiffness * min(max(change, -kappa_y), kappa_y)
    assemble(
        springs.unknowns, springs.factor, springs.straight, springs.length, q, moment, modulus, none,
        force, band, width, none,
    )  # fmt: skip

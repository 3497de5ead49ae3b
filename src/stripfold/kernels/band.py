"""Band matrices: product, factorisation without pivots, solution.

A matrix is stored as the transpose of LAPACK's band: entry (i, j) at ``band[j, top + i - j]``, rows and columns up to
``width`` apart.  The non-zero pattern is symmetric.
"""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, index, mask, matrix, vector

GROWTH = 1e3
"""Largest growth of a diagonal entry in a factorisation without pivots; a positive definite matrix has none."""


@compiled(vector(matrix, numba.int64, numba.int64, vector))
def product(band, top, width, x):
    """The matrix times ``x``."""
    n = len(band)
    y = np.zeros(n)
    for j in range(n):
        for i in range(max(0, j - width), min(n, j + width + 1)):
            y[i] += band[j, top + i - j] * x[j]
    return y


@compiled(vector(matrix, numba.int64, numba.int64, vector))
def product_of_magnitudes(band, top, width, x):
    """The matrix of absolute values times ``x``."""
    n = len(band)
    y = np.zeros(n)
    for j in range(n):
        for i in range(max(0, j - width), min(n, j + width + 1)):
            y[i] += abs(band[j, top + i - j]) * x[j]
    return y


@compiled(numba.void(matrix, numba.int64, numba.int64, mask))
def hold(band, top, width, held):
    """Make rows and columns ``held`` those of the identity, scaled by the diagonal, in place."""
    n = len(band)
    for j in range(n):
        if held[j]:
            diagonal = abs(band[j, top])
            for i in range(max(0, j - width), min(n, j + width + 1)):
                band[j, top + i - j] = 0.0
                band[i, top + j - i] = 0.0
            band[j, top] = diagonal


@compiled(numba.boolean(matrix, numba.int64, numba.int64, index))
def factorise(band, top, width, reach):
    """Factors L and U without pivots, in place; False where they would be inaccurate.

    ``reach``, shape (n,), is set to the last row of each column of L.
    """
    n = len(band)
    for j in range(n):
        last = min(n - 1, j + width)
        while last > j and band[j, top + last - j] == 0.0 and band[last, top + j - last] == 0.0:
            last -= 1
        reach[j] = last
    for k in range(n):
        pivot, last = band[k, top], reach[k]
        if not abs(pivot) > 0.0:
            return False
        inverse = 1.0 / pivot
        count = last - k
        for i in range(count):
            band[k, top + 1 + i] *= inverse
        for j in range(k + 1, last + 1):
            reach[j] = max(reach[j], last)
            factor, first = band[j, top + k - j], top + k + 1 - j
            if factor != 0.0:
                before = abs(band[j, top])
                for i in range(count):
                    band[j, first + i] -= factor * band[k, top + 1 + i]
                if not abs(band[j, top]) <= GROWTH * before:
                    return False
    return True


@compiled(numba.void(matrix, numba.int64, numba.int64, index, vector))
def substitute(band, top, width, reach, x):
    """Solve with the factors, in place."""
    n = len(band)
    for k in range(n):
        value = x[k]
        for i in range(k + 1, reach[k] + 1):
            x[i] -= band[k, top + i - k] * value
    for j in range(n - 1, -1, -1):
        x[j] /= band[j, top]
        value = x[j]
        for i in range(max(0, j - width), j):
            x[i] -= band[j, top + i - j] * value

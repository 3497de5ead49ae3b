"""Band matrices: product, factorisation without pivots, solution, also with a few more unknowns.

A matrix is stored by columns, with :data:`LANES` zeros after each, before the first and after the last: entry (i, j) at
``LANES + j height + width + i - j`` with ``height = 2 width + LANES``.  Loops over a column run in steps of that many
entries, written out, so that they become vector instructions; the zeros keep the last step inside the storage.  The
pattern of non-zero entries is symmetric.
"""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, index, mask, matrix, vector

LANES = 8
# Unsigned: an index of which the compiler cannot exclude that it is negative keeps it from using vector instructions.
U1, U2, U3, U4, U5, U6, U7 = (np.uint64(i) for i in range(1, LANES))
GROWTH = 1e3
"""Largest growth of a diagonal entry in a factorisation without pivots; a positive definite matrix has none."""


@compiled()
def storage(n, width):
    """An empty matrix, and its columns, shape (n, height)."""
    height = 2 * width + LANES
    flat = np.zeros(n * height + 2 * LANES)
    return flat, flat[LANES : LANES + n * height].reshape(n, height)


@compiled()
def add_multiple(y, at, a, start, factor):
    """Add ``factor`` times LANES entries of ``a`` to those of ``y``."""
    i, k = np.uint64(at), np.uint64(start)
    a0, a1, a2, a3, a4, a5, a6, a7 = a[k], a[k + U1], a[k + U2], a[k + U3], a[k + U4], a[k + U5], a[k + U6], a[k + U7]
    y[i] += factor * a0
    y[i + U1] += factor * a1
    y[i + U2] += factor * a2
    y[i + U3] += factor * a3
    y[i + U4] += factor * a4
    y[i + U5] += factor * a5
    y[i + U6] += factor * a6
    y[i + U7] += factor * a7


@compiled(vector(vector, numba.int64, vector))
def product(flat, width, x):
    """The matrix times ``x``."""
    n, height = len(x), 2 * width + LANES
    y = np.zeros(n + 2 * (width + LANES))
    for j in range(n):
        if x[j] != 0.0:
            for c in range(0, 2 * width + 1, LANES):
                add_multiple(y, LANES + j + c, flat, LANES + j * height + c, x[j])
    return y[width + LANES : width + LANES + n].copy()


@compiled(vector(vector, numba.int64, vector))
def rounding(flat, width, x):
    """The matrix of absolute values times ``x``."""
    n, height = len(x), 2 * width + LANES
    y = np.zeros(n)
    for j in range(n):
        for i in range(max(0, j - width), min(n, j + width + 1)):
            y[i] += abs(flat[LANES + j * height + width + i - j]) * x[j]
    return y


@compiled(matrix(vector, numba.int64, numba.int64, index))
def rows(flat, width, n, numbers):
    """Some rows of the matrix, shape (len(numbers), n)."""
    out, height = np.zeros((len(numbers), n)), 2 * width + LANES
    for k in range(len(numbers)):
        i = numbers[k]
        for j in range(max(0, i - width), min(n, i + width + 1)):
            out[k, j] = flat[LANES + j * height + width + i - j]
    return out


@compiled(numba.void(vector, numba.int64, mask))
def hold(flat, width, held):
    """Make rows and columns ``held`` those of the identity, scaled by the diagonal, in place."""
    n, height = len(held), 2 * width + LANES
    for j in range(n):
        if held[j]:
            diagonal = LANES + j * height + width
            kept = abs(flat[diagonal])
            for i in range(max(0, j - width), min(n, j + width + 1)):
                flat[diagonal + i - j] = 0.0
                flat[LANES + i * height + width + j - i] = 0.0
            flat[diagonal] = kept


@compiled(numba.boolean(vector, numba.int64, index))
def factorise(flat, width, reach):
    """Factors L and U without pivots, in place; False where they would be inaccurate.

    ``reach``, shape (n,), is set to the last row of each column of L.
    """
    n, height = len(reach), 2 * width + LANES
    before = np.empty(n)
    for j in range(n):
        diagonal, last = LANES + j * height + width, min(n - 1, j + width)
        before[j] = abs(flat[diagonal])
        while last > j and flat[diagonal + last - j] == 0.0 and flat[diagonal + (last - j) * (height - 1)] == 0.0:
            last -= 1
        reach[j] = last
    for k in range(n):
        diagonal, last = LANES + k * height + width, reach[k]
        pivot = abs(flat[diagonal])
        if not 0.0 < pivot <= GROWTH * before[k]:
            return False
        inverse = 1.0 / flat[diagonal]
        for i in range(1, last - k + 1):
            flat[diagonal + i] *= inverse
        for c in range(1, last - k + 1, LANES):
            start = np.uint64(diagonal + c)
            a0, a1, a2, a3 = flat[start], flat[start + U1], flat[start + U2], flat[start + U3]
            a4, a5, a6, a7 = flat[start + U4], flat[start + U5], flat[start + U6], flat[start + U7]
            for m in range(1, last - k + 1):
                # Entry (k, k + m).
                above = diagonal + m * (height - 1)
                factor, at = flat[np.uint64(above)], np.uint64(above + c)
                flat[at] -= factor * a0
                flat[at + U1] -= factor * a1
                flat[at + U2] -= factor * a2
                flat[at + U3] -= factor * a3
                flat[at + U4] -= factor * a4
                flat[at + U5] -= factor * a5
                flat[at + U6] -= factor * a6
                flat[at + U7] -= factor * a7
        for j in range(k + 1, last + 1):
            reach[j] = max(reach[j], last)
    return True


@compiled(vector(vector, numba.int64, index, vector))
def substitute(flat, width, reach, b):
    """The solution, given the factors."""
    n, height = len(b), 2 * width + LANES
    pad = width + LANES
    x = np.zeros(n + 2 * pad)
    for i in range(n):
        x[pad + i] = b[i]
    for k in range(n):
        diagonal, value = LANES + k * height + width, -x[pad + k]
        for c in range(1, reach[k] - k + 1, LANES):
            add_multiple(x, pad + k + c, flat, diagonal + c, value)
    for k in range(n - 1, -1, -1):
        diagonal = LANES + k * height + width
        x[pad + k] /= flat[diagonal]
        value = -x[pad + k]
        for c in range(LANES, width + LANES, LANES):
            add_multiple(x, pad + k - c, flat, diagonal - c, value)
    return x[pad : pad + n].copy()


@compiled(numba.boolean(matrix, vector))
def eliminate(a, x):
    """Solve a small dense system by Gaussian elimination in place, ``x`` from its right side; False: singular."""
    n = len(x)
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > 0.0:
            return False
        for j in range(n):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        x[k], x[best] = x[best], x[k]
        for i in range(n):
            if i != k:
                factor = a[i, k] / a[k, k]
                for j in range(k, n):
                    a[i, j] -= factor * a[k, j]
                x[i] -= factor * x[k]
    for k in range(n):
        x[k] /= a[k, k]
    return True


@compiled(
    numba.types.Tuple((vector, numba.int64))(
        vector, numba.int64, index, matrix, matrix, matrix, vector, vector, vector, numba.float64, vector, numba.float64
    )
)
def solve_bordered(flat, width, held, columns, rows, corner, rate, column, row, last_corner, right, last):
    """Solve a system with k + 1 more unknowns and equations, and refine the solution once.

    ``flat``, ``columns``, ``rows``, ``corner``: the matrix and its border, shapes (k, n), (k, n) and (k, k).  ``held``:
    numbers of those of the n unknowns whose rows and columns are taken for those of the identity, but that they move
    with the last unknown at their ``rate``, shape (n + k,), zero elsewhere.  ``column``, ``row``, shape (n + k,), and
    ``last_corner``: the border of both; ``right``, ``last``: the right sides, zero on held unknowns.

    Returns the n + k + 1 unknowns, without what the held ones move; and whether the matrix has factors, 1, and the
    border is regular, 2.
    """
    k, n = columns.shape
    is_held, factors, reach = np.zeros(n, np.bool_), flat.copy(), np.empty(n, np.int64)
    for i in held:
        is_held[i] = True
    hold(factors, width, is_held)
    fixed = factors.copy()
    if not factorise(factors, width, reach):
        return right, 0
    moved = product(flat, width, rate[:n].copy())
    b, c, d, given = np.zeros((k + 1, n)), np.zeros((k + 1, n)), np.empty((k + 1, k + 1)), np.empty(k + 1)
    for m in range(n):
        if not is_held[m]:
            for i in range(k):
                b[i, m], c[i, m] = columns[i, m], rows[i, m]
            b[k, m], c[k, m] = column[m] + moved[m], row[m]
    d[k, k], given[k] = last_corner, last
    for i in range(k):
        for j in range(k):
            d[i, j] = corner[i, j]
        d[i, k], d[k, i], given[i] = column[n + i], row[n + i], right[n + i]
    for m in range(n):
        d[k, k] += row[m] * rate[m]
        for i in range(k):
            d[i, k] += rows[i, m] * rate[m]
    answers, left = np.empty((k + 1, n)), d.copy()
    for j in range(k + 1):
        answer = substitute(factors, width, reach, b[j])
        for m in range(n):
            answers[j, m] = answer[m]
            for i in range(k + 1):
                left[i, j] -= c[i, m] * answer[m]
    x, rest, more = np.zeros(n + k + 1), np.empty(n), np.empty(k + 1)
    for _ in range(2):
        inner = product(fixed, width, x[:n].copy())
        for m in range(n):
            rest[m] = right[m] - inner[m]
            for i in range(k + 1):
                rest[m] -= b[i, m] * x[n + i]
        for i in range(k + 1):
            more[i] = given[i]
            for m in range(n):
                more[i] -= c[i, m] * x[m]
            for j in range(k + 1):
                more[i] -= d[i, j] * x[n + j]
        step = substitute(factors, width, reach, rest)
        for i in range(k + 1):
            for m in range(n):
                more[i] -= c[i, m] * step[m]
        if not eliminate(left.copy(), more):
            return x, 1
        for i in range(k + 1):
            x[n + i] += more[i]
            for m in range(n):
                step[m] -= answers[i, m] * more[i]
        for m in range(n):
            x[m] += step[m]
    return x, 2

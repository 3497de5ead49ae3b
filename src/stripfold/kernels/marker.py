"""The fit of a marker's pattern to the grey values of a picture: :meth:`.marker.Marker.fit`."""

from __future__ import annotations

from math import erfc, exp, pi, sqrt

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, matrix, vector
from stripfold.kernels.curves import grey_at

SHAPE = 10
"""Unknowns of the homography, 8, and of the blur, 2."""
NODES = 4
"""Nodes of gain and of offset along a side; with 3 the edge of a shadow moves the centre by a quarter of a pixel."""
UNKNOWNS = SHAPE + 2 * NODES**2
six = numba.types.UniTuple(numba.float64, 6)


@compiled()
def steps_of(axis, cells, blur):
    """Of each edge at each place: its blurred step, its density, and minus the derivative of this by the blur."""
    n = len(axis)
    step, density, by_blur = np.empty((n, cells + 1)), np.empty((n, cells + 1)), np.empty((n, cells + 1))
    for i in range(n):
        for k in range(cells + 1):
            t = (axis[i] - (k / cells - 0.5)) / blur
            step[i, k] = 0.5 * erfc(-t / sqrt(2.0))
            density[i, k] = exp(-0.5 * t * t) / (sqrt(2.0 * pi) * blur)
            by_blur[i, k] = -t * density[i, k]
    return step, density, by_blur


@compiled()
def dot(a, i, b, j):
    """Of row ``i`` and row ``j``; views of them would take most of the time."""
    total = 0.0
    for k in range(a.shape[1]):
        total += a[i, k] * b[j, k]
    return total


@compiled()
def cholesky(a):
    """In place, the lower triangle."""
    for j in range(len(a)):
        for k in range(j):
            a[j, j] -= a[j, k] ** 2
        a[j, j] = sqrt(a[j, j])
        for i in range(j + 1, len(a)):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]


@compiled()
def solve(a, x):
    """With the triangle of :func:`cholesky`, in place."""
    for i in range(len(a)):
        for k in range(i):
            x[i] -= a[i, k] * x[k]
        x[i] /= a[i, i]
    for i in range(len(a) - 1, -1, -1):
        for k in range(i + 1, len(a)):
            x[i] -= a[k, i] * x[k]
        x[i] /= a[i, i]


@compiled()
def slope(x, y):
    """Of the least-squares line through points."""
    middle = np.mean(x)
    up = across = 0.0
    for s in range(len(x)):
        up += (x[s] - middle) * y[s]
        across += (x[s] - middle) ** 2
    return up / across


@compiled(
    numba.boolean(
        numba.float32[:, ::1], vector, matrix, numba.int64, vector, matrix, vector, numba.int64, six, matrix, vector
    )
)
def fit(patch, origin, steps, cells, axis, homography, blur, iterations, limits, influence, quality):
    """Fit in place by Gauss-Newton steps with Tukey's biweight; whether the marker stayed near its start.

    Parameters
    ----------
    patch, origin
        Part of a picture, and the pixel of its corner, shape (2,).
    steps, cells
        The pattern as a sum of steps at the edges of its cells, shape (cells + 1, cells + 1), and cells along a side.
    axis
        Shape (n,): places of the samples along both sides, sides.
    homography, blur
        Shapes (3, 3) and (2,): start and result.
    iterations
        Most.
    limits
        Least and largest blur, sides; largest motion of the centre, and that which ends the iteration, pixels; Tukey's
        constant; least scale of the residuals, over the contrast.
    influence
        Shape (2, n * n): result, the contribution of each sample to the centre, pixels.
    quality
        Shape (3,): result, sum of the weights, median of the gain, and correlation with the pattern.
    """
    least, most, reach, tolerance, tukey, floor = limits
    n, count = len(axis), len(axis) ** 2
    height, width = patch.shape
    start_x, start_y = homography[0, 2], homography[1, 2]
    columns, places = np.zeros((count, SHAPE + 8)), np.empty((count, SHAPE + 8), dtype=np.int64)
    grey, pattern, gain, inside = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    weights, residual = np.empty(count), np.empty(count)
    normal, right = np.empty((UNKNOWNS, UNKNOWNS)), np.empty(UNKNOWNS)
    place = np.arange(SHAPE + 8)
    some, weighted = np.empty((count, SHAPE + 9)), np.empty((SHAPE + 8, count))
    for iteration in range(iterations):
        step_u, density_u, blur_u = steps_of(axis, cells, blur[0])
        step_v, density_v, blur_v = steps_of(axis, cells, blur[1])
        along_u, along_v = np.zeros((n, cells + 1)), np.zeros((n, cells + 1))
        for i in range(n):
            for e in range(cells + 1):
                for k in range(cells + 1):
                    along_u[i, e] += steps[e, k] * step_u[i, k]
                    along_v[i, k] += step_v[i, e] * steps[e, k]
        for s in range(count):
            i, j = s // n, s % n
            u, v = axis[j], axis[i]
            below = homography[2, 0] * u + homography[2, 1] * v + 1.0
            x = (homography[0, 0] * u + homography[0, 1] * v + homography[0, 2]) / below
            y = (homography[1, 0] * u + homography[1, 1] * v + homography[1, 2]) / below
            grey[s] = grey_at(patch, x - origin[0], y - origin[1])
            pattern[s] = 1.0 + dot(step_v, i, along_u, j)
            if iteration == 0:
                within_x = 0.0 <= x - origin[0] <= width - 1.0
                inside[s] = weights[s] = within_x and 0.0 <= y - origin[1] <= height - 1.0
            # Derivatives in the marker's frame, then in pixels by the inverse of the Jacobian (a, b; c, d).  The third
            # homogeneous coordinate divides both the Jacobian and the effect of the entries, and cancels.
            by_u, by_v = dot(along_v, i, density_u, j), dot(density_v, i, along_u, j)
            a, b = homography[0, 0] - x * homography[2, 0], homography[0, 1] - x * homography[2, 1]
            c, d = homography[1, 0] - y * homography[2, 0], homography[1, 1] - y * homography[2, 1]
            by_x, by_y = (c * by_v - d * by_u) / (a * d - b * c), (b * by_u - a * by_v) / (a * d - b * c)
            by_w = -(by_x * x + by_y * y)
            columns[s, 0], columns[s, 1], columns[s, 2] = by_x * u, by_x * v, by_x
            columns[s, 3], columns[s, 4], columns[s, 5] = by_y * u, by_y * v, by_y
            columns[s, 6], columns[s, 7] = by_w * u, by_w * v
            columns[s, 8], columns[s, 9] = dot(along_v, i, blur_u, j), dot(blur_v, i, along_u, j)
        if iteration == 0:
            gain[:] = slope(pattern, grey)
        normal[:] = 0.0
        right[:] = 0.0
        # The samples between four nodes at a time: only those see their offset and gain.
        for cell in range((NODES - 1) ** 2):
            among = 0
            for s in range(count):
                p, q = s // n * (NODES - 1.0) / (n - 1.0), s % n * (NODES - 1.0) / (n - 1.0)
                i, j = min(int(p), NODES - 2), min(int(q), NODES - 2)
                if i * (NODES - 1) + j != cell:
                    continue
                for k in range(SHAPE):
                    columns[s, k] *= gain[s]
                for k in range(4):
                    place[SHAPE + k] = SHAPE + (i + k // 2) * NODES + j + k % 2
                    place[SHAPE + 4 + k] = place[SHAPE + k] + NODES**2
                    # Bilinear hat functions.
                    hat = (p - i if k // 2 else 1.0 - p + i) * (q - j if k % 2 else 1.0 - q + j)
                    columns[s, SHAPE + k], columns[s, SHAPE + 4 + k] = hat, hat * pattern[s]
                for k in range(SHAPE + 8):
                    places[s, k] = place[k]
                    some[among, k], weighted[k, among] = columns[s, k], weights[s] * columns[s, k]
                some[among, SHAPE + 8] = grey[s]
                among += 1
            products = np.dot(np.ascontiguousarray(weighted[:, :among]), some[:among])
            for k in range(SHAPE + 8):
                right[place[k]] += products[k, SHAPE + 8]
                for m in range(SHAPE + 8):
                    normal[place[k], place[m]] += products[k, m]
        # Regularised: where the pattern has one colour only, gain and offset are not independent.
        for k in range(UNKNOWNS):
            normal[k, k] += 1e-6 * normal[k, k] + 1e-12
        cholesky(normal)
        solve(normal, right)
        for s in range(count):
            fitted = 0.0
            for k in range(SHAPE + 8):
                fitted += right[places[s, k]] * columns[s, k]
            residual[s] = grey[s] - fitted
        scale = max(1.4826 * np.median(np.abs(residual)), floor * np.median(np.abs(gain)), 1e-3)
        for s in range(count):
            weights[s] = inside[s] * max(1.0 - (residual[s] / (tukey * scale)) ** 2, 0.0) ** 2
            gain[s] = 0.0
            for k in range(4):
                gain[s] += right[places[s, SHAPE + 4 + k]] * columns[s, SHAPE + k]
        for k in range(8):
            homography[k // 3, k % 3] += right[k]
        for k in range(2):
            low, high = max(least, blur[k] / 1.5), min(most, blur[k] * 1.5)
            blur[k] = min(max(blur[k] + right[8 + k], low), high)
        moved = sqrt((homography[0, 2] - start_x) ** 2 + (homography[1, 2] - start_y) ** 2)
        if not np.all(np.isfinite(homography)) or moved > reach:
            return False
        if sqrt(right[2] ** 2 + right[5] ** 2) < tolerance:
            break
    for k in range(2):
        right[:] = 0.0
        right[2 + 3 * k] = 1.0
        solve(normal, right)
        for s in range(count):
            total = 0.0
            for m in range(SHAPE + 8):
                total += right[places[s, m]] * columns[s, m]
            influence[k, s] = total * weights[s] * residual[s]
    spread = np.std(grey)
    quality[0], quality[1] = np.sum(weights), np.median(gain)
    quality[2] = max(slope(pattern, grey) * np.std(pattern) / spread, 0.0) if spread > 0.0 else 0.0
    return True

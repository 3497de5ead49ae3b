"""Curves through points, and grey values beside them: :mod:`stripfold.film.cross_sections`."""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, matrix, vector

UNIT = 1 << 24
"""Steps of a pixel in which a place in a picture is counted."""
picture = numba.types.Array(numba.uint8, 2, "C", readonly=True)


@compiled(vector(matrix))
def arc_length(points):
    """Length of the polygon up to each point."""
    out = np.zeros(len(points))
    for i in range(1, len(points)):
        out[i] = out[i - 1] + np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return out


@compiled(matrix(matrix))
def tangents(points):
    """Unit tangents, by central differences."""
    n = len(points)
    out = np.empty((n, 2))
    for i in range(n):
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        x, y = points[after, 0] - points[before, 0], points[after, 1] - points[before, 1]
        size = max(np.hypot(x, y), 1e-12)
        out[i, 0], out[i, 1] = x / size, y / size
    return out


@compiled(matrix(matrix, vector))
def resampled(points, s):
    """A cubic Hermite spline through points at the arc lengths ``s``, which increase."""
    arc = arc_length(points)
    n = len(arc) - 1
    chord, slope = np.empty((n, 2)), np.empty((n + 1, 2))
    for i in range(n):
        for k in range(2):
            chord[i, k] = (points[i + 1, k] - points[i, k]) / (arc[i + 1] - arc[i])
    slope[0], slope[n] = chord[0], chord[n - 1]
    for i in range(1, n):
        before, after = arc[i] - arc[i - 1], arc[i + 1] - arc[i]
        for k in range(2):
            slope[i, k] = (after * chord[i - 1, k] + before * chord[i, k]) / (before + after)
    out = np.empty((len(s), 2))
    i = 0
    for j in range(len(s)):
        while i < n - 1 and arc[i + 1] <= s[j]:
            i += 1
        h, u = arc[i + 1] - arc[i], s[j] - arc[i]
        for k in range(2):
            first, last, middle = slope[i, k], slope[i + 1, k], chord[i, k]
            bend = 3.0 * middle - 2.0 * first - last + u / h * (first + last - 2.0 * middle)
            out[j, k] = points[i, k] + u * (first + u / h * bend)
    return out


@compiled()
def grey_at(image, x, y):
    """Between pixels; outside the image, that of its border."""
    height, width = image.shape
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    j, i = max(min(int(x), width - 2), 0), max(min(int(y), height - 2), 0)
    right, below = min(j + 1, width - 1), min(i + 1, height - 1)
    # Differences of unsigned numbers would not be negative.
    first, second = float(image[i, j]), float(image[below, j])
    first += (x - j) * (image[i, right] - first)
    second += (x - j) * (image[below, right] - second)
    return first + (y - i) * (second - first)


@compiled(numba.float32[:, ::1](picture, matrix, matrix, numba.int64[::1], numba.boolean))
def sampled(image, points, across, reach, bright):
    """Grey values across a curve: :func:`.cross_sections.sample`."""
    n, most = len(points), np.max(reach)
    height, width = image.shape
    flat, part = image.reshape(-1), np.float32(1.0 / UNIT)
    out = np.zeros((n, 2 * most + 1), dtype=np.float32)
    for i in range(n):
        x, y, dx, dy = points[i, 0], points[i, 1], across[i, 0], across[i, 1]
        room_x, room_y = reach[i] * abs(dx) + 1.0, reach[i] * abs(dy) + 1.0
        within_x = x >= room_x and x + room_x < width - 1.0
        # To ask for the border once, and to step in whole numbers, takes half the time.
        if within_x and y >= room_y and y + room_y < height - 1.0:
            step_x, step_y = np.int64(round(dx * UNIT)), np.int64(round(dy * UNIT))
            at_x, at_y = np.int64(round(x * UNIT)) - reach[i] * step_x, np.int64(round(y * UNIT)) - reach[i] * step_y
            for k in range(most - reach[i], most + reach[i] + 1):
                at = np.uint64(at_y // UNIT) * np.uint64(width) + np.uint64(at_x // UNIT)
                u, v = np.float32(at_x % UNIT) * part, np.float32(at_y % UNIT) * part
                first, second = np.float32(flat[at]), np.float32(flat[at + np.uint64(width)])
                first += u * (np.float32(flat[at + np.uint64(1)]) - first)
                second += u * (np.float32(flat[at + np.uint64(width + 1)]) - second)
                out[i, k] = np.rint(first + v * (second - first))
                at_x, at_y = at_x + step_x, at_y + step_y
        else:
            for t in range(-reach[i], reach[i] + 1):
                out[i, most + t] = np.rint(grey_at(image, x + t * dx, y + t * dy))
        if not bright:
            for t in range(-reach[i], reach[i] + 1):
                out[i, most + t] = np.float32(255.0) - out[i, most + t]
    return out

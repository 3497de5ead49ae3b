"""Polygons on a grey picture: each pixel by the exact share that they cover; see :mod:`stripfold.synthetic.view`."""

from __future__ import annotations

from math import ceil, floor

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, matrix

LEAST = 1e-6
"""Share of a pixel below which it is not covered."""


@compiled(numba.void(numba.float32[:, ::1], numba.int64, numba.int64, matrix, matrix, matrix, numba.float64))
def draw(picture, first_row, end_row, start, end, weights, alpha):
    """Draw what is inside of directed lines that form closed polygons, in place.

    ``picture``: shape (height, width): 255 for white; pixel centres are at integers.  ``first_row``, ``end_row``: the
    rows that are drawn.  ``start``, ``end``: of the lines, x and y, shape (n, 2), pixels.  ``weights``: shape (2, n):
    what they add to the covered share of the pixels to their right, and to this share times its grey.  ``alpha``:
    opacity.
    """
    n, columns = len(start), picture.shape[1]
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for i in range(n):
        if weights[0, i] != 0.0 or weights[1, i] != 0.0:
            low_x = min(low_x, start[i, 0], end[i, 0])
            high_x = max(high_x, start[i, 0], end[i, 0])
            low_y = min(low_y, start[i, 1], end[i, 1])
            high_y = max(high_y, start[i, 1], end[i, 1])
    if not (low_x < columns and high_x > -1.0 and low_y < end_row and high_y > first_row - 1.0):
        return
    # A pixel begins half a pixel before its centre.
    left, right = int(max(low_x + 0.5, 0.0)), int(min(high_x + 0.5, columns - 1.0)) + 1
    top, bottom = int(max(low_y + 0.5, first_row)), int(min(high_y + 0.5, end_row - 1.0)) + 1
    width, height = right - left, bottom - top
    if width <= 0 or height <= 0:
        return
    sums = np.zeros((height, width + 1, 2))
    for i in range(n):
        share, light = weights[0, i], weights[1, i]
        x, dx = start[i, 0] + 0.5 - left, end[i, 0] - start[i, 0]
        y, dy = start[i, 1] + 0.5 - top, end[i, 1] - start[i, 1]
        if dy == 0.0 or (share == 0.0 and light == 0.0):
            continue
        low, high = min(y, y + dy), max(y, y + dy)
        for row in range(max(floor(low), 0), min(ceil(high), height)):
            above, below = max(low, row), min(high, row + 1)
            tall = below - above if dy > 0.0 else above - below
            a, b = x + (above - y) / dy * dx, x + (below - y) / dy * dx
            middle, half = 0.5 * (a + b), max(0.5 * abs(b - a), LEAST)
            part, last = middle - half, middle + half
            if part < 0.0:
                # All that is left of the picture counts as its edge.
                outside = tall * (min(last, 0.0) - part) / (2.0 * half)
                sums[row, 0, 0] += outside * share
                sums[row, 0, 1] += outside * light
                part = 0.0
            for column in range(int(part), min(ceil(last), width)):
                to = min(last, column + 1.0)
                inside = tall * (to - part) / (2.0 * half)
                ahead = inside * (0.5 * (part + to) - column)
                sums[row, column, 0] += (inside - ahead) * share
                sums[row, column, 1] += (inside - ahead) * light
                sums[row, column + 1, 0] += ahead * share
                sums[row, column + 1, 1] += ahead * light
                part = to
    for row in range(height):
        share = light = 0.0
        for column in range(width):
            share += sums[row, column, 0]
            light += sums[row, column, 1]
            if share > LEAST:
                under = picture[top + row, left + column]
                over = 255.0 * light / share
                picture[top + row, left + column] = under + alpha * min(share, 1.0) * (over - under)

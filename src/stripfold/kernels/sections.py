"""Cross sections of a strip in a picture, and their smoothing: :mod:`stripfold.film.cross_sections`."""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, matrix, vector

grey = numba.float32[:, ::1]
THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
"""Coefficients of a third difference."""


@compiled()
def box(row, k, low, high):
    """Mean from ``k - low`` to ``k + high``; outside, the values at the ends are repeated."""
    total = 0.0
    for i in range(k - low, k + high + 1):
        total += row[min(max(i, 0), len(row) - 1)]
    return total / (low + high + 1)


@compiled()
def fall(row, middle, step, level, far):
    """Where a row first falls below a level on one side of its middle, how steeply, and whether within ``far``."""
    at, found = 1, False
    for k in range(1, far + 1):
        if row[middle + step * k] < level:
            at, found = k, True
            break
    before, after = row[middle + step * (at - 1)], row[middle + step * at]
    drop = max(before - after, 1e-3)
    return at - 1 + min(max((before - level) / drop, 0.0), 1.0), max(drop, 1.0), found


@compiled(matrix(grey, vector, vector, numba.float64))
def edges(profiles, width, side, thin):
    """Offset, width, contrast, noise and whether the edges were found (1 or 0), shape (5, n).

    See :func:`.cross_sections.measure_edges`; bands up to ``thin`` are located by their centroid.
    """
    n, middle = len(profiles), profiles.shape[1] // 2
    out = np.empty((5, n))
    for i in range(n):
        row = profiles[i]
        far = int(np.rint(1.2 * width[i])) + 5
        core = int(0.3 * width[i])
        top = box(row, middle, core, core)
        left = right = np.inf
        for t in range(min(int(np.rint(0.5 * width[i])) + 1, far - 1) + 1, far + 1):
            left = min(left, box(row, middle - t, 1, 1))
            right = min(right, box(row, middle + t, 1, 1))
        below, slope_below, found_below = fall(row, middle, -1, 0.5 * (top + left), far)
        above, slope_above, found_above = fall(row, middle, 1, 0.5 * (top + right), far)
        out[0, i] = 0.5 * (above - below)
        if side[i] != 0.0:
            # From one edge alone: the other one is next to another layer.
            up = side[i] > 0.0
            out[0, i] = above - 0.5 * width[i] if up else 0.5 * width[i] - below
            out[1, i] = width[i]
            out[2, i] = top - (right if up else left)
            out[3, i] = 1.0 / (slope_above if up else slope_below)
            out[4, i] = found_above if up else found_below
            continue
        if width[i] <= thin:
            base = 0.5 * (left + right)
            base += 0.1 * (top - base)
            reach = int(min(0.5 * width[i] + 2.0, far))
            total = moment = 0.0
            for t in range(-reach, reach + 1):
                weight = max(row[middle + t] - base, 0.0)
                total += weight
                moment += weight * t
            out[0, i] = moment / max(total, 1e-6)
        out[1, i] = above + below
        out[2, i] = top - max(left, right)
        out[3, i] = 0.5 * np.hypot(1.0 / slope_below, 1.0 / slope_above)
        out[4, i] = found_below and found_above
    return out


@compiled(grey(grey, vector))
def responses(profiles, width):
    """Each section's mean over a band of its width less that over the band and what is beside it, shape of profiles."""
    n, m = profiles.shape
    out = np.empty((n, m), dtype=np.float32)
    for i in range(n):
        row = profiles[i]
        size = int(np.rint(width[i]))
        core = size | 1
        both = core + (2 * max(size, 2) | 1)
        inner = outer = 0.0
        for k in range(-(core // 2), core - core // 2):
            inner += row[min(max(k, 0), m - 1)]
        for k in range(-(both // 2), both - both // 2):
            outer += row[min(max(k, 0), m - 1)]
        for k in range(m):
            out[i, k] = inner / core - outer / both
            inner += row[min(k + core - core // 2, m - 1)] - row[max(k - core // 2, 0)]
            outer += row[min(k + both - both // 2, m - 1)] - row[max(k - both // 2, 0)]
    return out


@compiled()
def longest_step(curve):
    """Between neighbouring points."""
    longest = 0.0
    for i in range(1, len(curve)):
        longest = max(longest, np.hypot(curve[i, 0] - curve[i - 1, 0], curve[i, 1] - curve[i - 1, 1]))
    return longest


@compiled(numba.boolean[::1](matrix, matrix, numba.int64))
def on_own_layer(places, curve, layer):
    """See :func:`.cross_sections.on_own_layer`."""
    out, spacing = np.empty(len(places), dtype=np.bool_), longest_step(curve)
    for i in range(len(places)):
        nearest, least, j = i, np.hypot(curve[i, 0] - places[i, 0], curve[i, 1] - places[i, 1]), 0
        # Those within a pixel of their own point are: to ask only for the others takes half the time.
        while least >= 1.0 and j < len(curve):
            x, y = curve[j, 0] - places[i, 0], curve[j, 1] - places[i, 1]
            distance = np.sqrt(x * x + y * y)
            if distance < least:
                nearest, least = j, distance
            # So many points on it cannot be nearer yet.
            j += 1 + max(int((distance - least) / spacing), 0)
        out[i] = abs(nearest - i) <= layer
    return out


@compiled()
def free_side(curve, across, width, layer, margin):
    """On which side of each point of a curve only its outer edge is clear of another layer, shape (n,).

    0 where no other layer (more than ``layer`` points away) is within ``margin`` of its band of this ``width``, else
    the sign by which the normal ``across`` points away from it.  The layer next to the gripper is above.
    """
    out, spacing, widest = np.zeros(len(curve)), longest_step(curve), np.max(width)
    for i in range(len(curve)):
        least, j = margin, 0
        while j < len(curve):
            if abs(j - i) <= layer:
                j = i + layer + 1
                continue
            x, y = curve[j, 0] - curve[i, 0], curve[j, 1] - curve[i, 1]
            distance = np.sqrt(x * x + y * y)
            gap = distance - 0.5 * (width[i] + width[j])
            if gap < least:
                least = gap
                out[i] = -np.sign(across[i, 1]) if j > i else np.sign(across[i, 1])
            # So many points on it cannot be near enough yet: to look at each takes ten times as long.
            j += 1 + max(int((distance - 0.5 * (width[i] + widest) - margin) / spacing), 0)
    return out


@compiled(matrix(vector, numba.float64))
def factor(weights, cutoff):
    """L and D of the matrix L D L^T of :mod:`stripfold.film.smoothing`: D and the diagonals below it, shape (n, 4).

    A wave of length ``cutoff``, in spacings, is halved.
    """
    n = len(weights)
    scale = (cutoff / (2.0 * np.pi)) ** 6
    out = np.zeros((n, 4))
    for r in range(n - 3):
        for a in range(4):
            for b in range(a + 1):
                out[r + a, a - b] += scale * THIRD[a] * THIRD[b]
    for i in range(n):
        out[i, 0] += weights[i] + 1e-9
        for k in range(min(3, i), 0, -1):
            # Entry (i, i - k), less what the columns before it contribute.
            j = i - k
            for c in range(max(0, i - 3), j):
                out[i, k] -= out[i, i - c] * out[j, j - c] * out[c, 0]
            out[i, k] /= out[j, 0]
        for k in range(1, min(3, i) + 1):
            out[i, 0] -= out[i, k] ** 2 * out[i - k, 0]
    return out


@compiled(numba.void(matrix, matrix))
def substitute(factors, right):
    """Solve in place for the columns of ``right``, shape (n, k)."""
    n, m = right.shape
    for i in range(n):
        for k in range(1, min(3, i) + 1):
            for c in range(m):
                right[i, c] -= factors[i, k] * right[i - k, c]
    for i in range(n - 1, -1, -1):
        for c in range(m):
            right[i, c] /= factors[i, 0]
        for k in range(1, min(3, n - 1 - i) + 1):
            for c in range(m):
                right[i, c] -= factors[i + k, k] * right[i + k, c]


@compiled(matrix(matrix, vector, numba.float64))
def smoothed(values, weights, cutoff):
    """Least squares with a penalty on third differences: :func:`.smoothing.smoothed`, for values of shape (n, k)."""
    out = np.empty_like(values)
    for i in range(len(values)):
        for k in range(values.shape[1]):
            out[i, k] = weights[i] * values[i, k]
    substitute(factor(weights, cutoff), out)
    return out


@compiled()
def robust(centres, base, good, across, cutoff):
    """Cauchy weights by the offsets from the smoothed centres."""
    weights, scaled = base.copy(), np.zeros(len(base))
    for _ in range(3):
        smooth = smoothed(centres, weights, cutoff)
        for i in range(len(base)):
            if good[i]:
                away = (centres[i, 0] - smooth[i, 0]) * across[i, 0] + (centres[i, 1] - smooth[i, 1]) * across[i, 1]
                scaled[i] = away * np.sqrt(base[i])
        # Hairs pull an edge outwards.  Smoothing takes a tight bend off by 0.1 px: that is no outlier.
        sigma = max(1.4826 * np.median(np.abs(scaled[good])), 0.1)
        for i in range(len(base)):
            weights[i] = base[i] / (1.0 + (scaled[i] / (2.4 * sigma)) ** 2)
    return weights

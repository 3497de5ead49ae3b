"""Compiled search for pairs of a node and a segment of a polygon that are near each other, for self-contact.

Nodes have places ``x`` and ``z``, shape (n,), segment j goes from node j to node j + 1.  Of node i the segments before
``before[i]`` and from ``after[i]`` on are far away along the polygon: only with these is it a pair.
"""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, index, vector

number = numba.float64


@compiled()
def longest(x, z):
    """Measure the longest segment."""
    most = 0.0
    for j in range(len(x) - 1):
        most = max(most, np.hypot(x[j + 1] - x[j], z[j + 1] - z[j]))
    return most


@compiled()
def distance(x, z, i, j):
    """Measure the distance of node i from segment j."""
    along, up = x[j + 1] - x[j], z[j + 1] - z[j]
    a, b = x[i] - x[j], z[i] - z[j]
    foot = min(max((a * along + b * up) / (along * along + up * up), 0.0), 1.0)
    return np.hypot(a - foot * along, b - foot * up)


@compiled()
def step(height, thickness):
    """Compute the factor of the required distance at a height: 0 up to h, 1 from 2 h, cubic between."""
    t = min(max(height / thickness - 1.0, 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)


@compiled()
def required(z, i, j, thickness):
    """Compute the required distance of node i and segment j."""
    return thickness * step(z[i], thickness) * step(0.5 * (z[j] + z[j + 1]), thickness)


@compiled(numba.types.Tuple((index, index))(vector, vector, vector, vector, index, index, number))
def in_contact(x0, z0, x1, z1, before, after, thickness):
    """Find the pairs nearer in one of two states than the required distance of one of them: nodes and segments."""
    n, spacing = len(x0), max(longest(x0, z0), longest(x1, z1))
    nodes, segments = [0 for _ in range(0)], [0 for _ in range(0)]
    for i in range(n):
        for part in range(2):
            j, end = (0, before[i]) if part == 0 else (after[i], n - 1)
            while j < end:
                away = min(np.hypot(x0[i] - x0[j], z0[i] - z0[j]), np.hypot(x1[i] - x1[j], z1[i] - z1[j]))
                # So many segments on none can be near enough.
                skipped = int((away - thickness) / spacing)
                if skipped > 0:
                    j += skipped
                    continue
                least = min(distance(x0, z0, i, j), distance(x1, z1, i, j))
                if least < max(required(z0, i, j, thickness), required(z1, i, j, thickness)):
                    nodes.append(i)
                    segments.append(j)
                j += 1
    return np.array(nodes, dtype=np.int64), np.array(segments, dtype=np.int64)


@compiled(numba.types.UniTuple(number, 2)(vector, vector, index, index, number, number, number))
def clearance(x, z, before, after, thickness, low, rate):
    """Find the least gap, distance less required distance, of the pairs for which one is required, and a displacement.

    Up to this displacement of all nodes none of the pairs higher than ``low`` can come into contact: a gap
    shrinks ``rate`` times as fast as nodes move, and no required distance exceeds h.  Infinite where there is no pair.
    """
    n, spacing = len(x), longest(x, z)
    gap = safe = np.inf
    for i in range(n):
        if z[i] <= low:
            continue
        for part in range(2):
            j, end = (0, before[i]) if part == 0 else (after[i], n - 1)
            while j < end:
                enough = max(gap, 2.0 * safe) + thickness
                away = np.hypot(x[i] - x[j], z[i] - z[j])
                skipped = int((away - enough) / spacing) if away > enough else 0
                if skipped > 0:
                    j += skipped
                    continue
                if 0.5 * (z[j] + z[j + 1]) > low:
                    apart, asked = distance(x, z, i, j), required(z, i, j, thickness)
                    safe = min(safe, max((apart - asked) / rate, 0.5 * (apart - thickness)))
                    if asked > 0.0:
                        gap = min(gap, apart - asked)
                j += 1
    return gap, safe

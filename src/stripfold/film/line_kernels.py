"""Compiled loops over the cross sections of a strip in a picture: curves, grey values, edges, smoothing, following.

Curves have shape (n, 2), pixels, pictures shape (h, w); a section is a row of grey values along a curve's normal.  All
arrays are small (some hundred sections of some ten samples): a frame costs a few milliseconds.
"""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, index, mask, matrix, vector

THIN = 4.0
"""Width, pixels, up to which a band is located by its centroid: its two edges are not resolved."""
GOOD = 0.4
"""Score from which a section counts as measured."""
MERGED = 1.3
"""Width, relative to the strip's, from which a band is taken for the strip and something beside it."""
CLEAR = 4.0
"""Distance between the bands of two layers, pixels, below which what is between them is too narrow to be seen."""
WIDTH_TOLERANCE = 0.4
"""Standard deviation of the logarithm of the width in the score of a section of a strip that is followed."""
GAP_WEIGHT = 0.05
"""Weight of the expected place of a hidden section, relative to a measured one, of a strip that is followed."""
CONVERGED = 1.0
"""Largest offset, pixels, after which a line is not measured again."""
LEARNING_RATE = 0.2
"""Rate, per frame, at which width and contrast follow what was measured."""
WIDE, CLEAR_FALL, BESIDE = 8.0, 0.3, 5
"""Width, pixels, from which a band's shadow is told from it; share of a band's contrast by which the grey value falls
at its edge, and distance from there, pixels, up to which is seen what lies beside it."""
UNIT = 1 << 24
"""Steps of a pixel in which a place in a picture is counted."""
THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
"""Coefficients of a third difference."""

number, grey = numba.float64, numba.float32[:, ::1]
curve_type = numba.types.Array(numba.float64, 2, "A", readonly=True)
picture = numba.types.Array(numba.uint8, 2, "C", readonly=True)
pair = numba.types.UniTuple(number, 2)


@compiled(vector(curve_type))
def arc_length(points):
    """Measure the length of the polygon up to each point, shape (n,)."""
    out = np.zeros(len(points))
    for i in range(1, len(points)):
        out[i] = out[i - 1] + np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    return out


@compiled(matrix(curve_type))
def tangents(points):
    """Compute the unit tangents of a curve by central differences."""
    n = len(points)
    out = np.empty((n, 2))
    for i in range(n):
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        x, y = points[after, 0] - points[before, 0], points[after, 1] - points[before, 1]
        size = max(np.hypot(x, y), 1e-12)
        out[i, 0], out[i, 1] = x / size, y / size
    return out


@compiled(matrix(curve_type))
def normals(points):
    """Compute the unit normals of a curve: its tangents turned by a right angle."""
    out = tangents(points)
    for i in range(len(out)):
        out[i, 0], out[i, 1] = -out[i, 1], out[i, 0]
    return out


@compiled(mask(curve_type, numba.types.UniTuple(numba.int64, 2), number))
def inside(points, shape, margin):
    """Tell which points lie in a picture of ``shape``, at least ``margin`` from its border."""
    out = np.empty(len(points), dtype=np.bool_)
    for i in range(len(points)):
        x, y = points[i]
        within_x = margin <= x <= shape[1] - 1.0 - margin
        out[i] = within_x and margin <= y <= shape[0] - 1.0 - margin
    return out


@compiled(matrix(curve_type, vector))
def resampled(points, s):
    """Evaluate a cubic Hermite spline through points at the increasing arc lengths ``s``."""
    arc = arc_length(points)
    n = len(arc) - 1
    chord, slope = np.empty((n, 2)), np.empty((n + 1, 2))
    for i in range(n):
        for k in range(2):
            chord[i, k] = (points[i + 1, k] - points[i, k]) / (arc[i + 1] - arc[i])
    for k in range(2):
        slope[0, k], slope[n, k] = chord[0, k], chord[n - 1, k]
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
    """Interpolate the grey value between pixels; outside the image that of its border counts."""
    height, width = image.shape
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    j, i = max(min(int(x), width - 2), 0), max(min(int(y), height - 2), 0)
    right, below = min(j + 1, width - 1), min(i + 1, height - 1)
    # Differences of unsigned numbers would not be negative.
    first, second = float(image[i, j]), float(image[below, j])
    first += (x - j) * (image[i, right] - first)
    second += (x - j) * (image[below, right] - second)
    return first + (y - i) * (second - first)


@compiled(grey(picture, curve_type, curve_type, index, numba.boolean))
def sampled(image, points, across, reach, bright):
    """Sample rounded grey values at each pixel up to ``reach`` to both sides, shape (n, 2 max(reach) + 1), 0 beyond.

    Outside the picture its border is repeated; of a strip that is not ``bright`` the values are inverted.
    """
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


@compiled()
def box(row, k, reach):
    """Average a row from ``k - reach`` to ``k + reach``, all of which it has."""
    total = 0.0
    for i in range(k - reach, k + reach + 1):
        total += row[i]
    return total / (2 * reach + 1)


@compiled()
def three(row, k):
    """Average three values of a row."""
    # Written out: as a loop of :func:`box` it takes a tenth of the time of following a strip.
    return (row[k - 1] + row[k] + row[k + 1]) / 3.0


@compiled()
def fall(row, middle, step, level, far):
    """Find where a row first falls below a level on one side of its middle, how steeply, and whether within ``far``."""
    at, found = 1, False
    for k in range(1, far + 1):
        if row[middle + step * k] < level:
            at, found = k, True
            break
    before, after = row[middle + step * (at - 1)], row[middle + step * at]
    drop = max(before - after, 1e-3)
    return at - 1 + min(max((before - level) / drop, 0.0), 1.0), max(drop, 1.0), found


@compiled()
def beside(row, middle, step, far, top, least):
    """Measure the grey value next to a band on one side of its middle: a shadow's, where one lies there.

    ``top``: that of the band; ``least``: the lowest one within ``far``, which is the table's where there is a shadow.
    """
    level = top - CLEAR_FALL * (top - least)
    for k in range(1, far - BESIDE):
        if three(row, middle + step * k) <= level:
            value = np.inf
            for t in range(k + 2, k + BESIDE + 1):
                value = min(value, three(row, middle + step * t))
            if value <= level:
                return value
    return least


@compiled(matrix(picture, curve_type, curve_type, vector, numba.boolean, vector))
def bands(image, points, across, width, bright, side):
    """Measure the sub-pixel edges of a band of about this ``width`` in the middle of each section: rows of ``Edges``.

    Each edge is where the grey value is half-way between the band's and that beside it, on its own side.  Unless
    ``side``, of :func:`free_side`, is 0 the centre is half of ``width`` from the edge on that side.
    """
    n = len(points)
    far_of = np.empty(n, dtype=np.int64)
    for i in range(n):
        far_of[i] = int(np.rint(1.2 * width[i])) + 5
    profiles, out = sampled(image, points, across, far_of + 1, bright), np.empty((5, n))
    middle = profiles.shape[1] // 2
    for i in range(n):
        row, far, core = profiles[i], far_of[i], int(0.3 * width[i])
        top = box(row, middle, core)
        left = right = np.inf
        for t in range(min(int(np.rint(0.5 * width[i])) + 1, far - 1) + 1, far + 1):
            left = min(left, three(row, middle - t))
            right = min(right, three(row, middle + t))
        if width[i] > WIDE:
            left, right = beside(row, middle, -1, far, top, left), beside(row, middle, 1, far, top, right)
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
        if width[i] <= THIN:
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
    """Subtract from each section's mean over a band of its width that over the band and what is beside it."""
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
    """Measure the longest distance between neighbouring points."""
    longest = 0.0
    for i in range(1, len(curve)):
        longest = max(longest, np.hypot(curve[i, 0] - curve[i - 1, 0], curve[i, 1] - curve[i - 1, 1]))
    return longest


@compiled(mask(curve_type, curve_type, numba.int64))
def on_own_layer(places, curve, layer):
    """Tell which places are nearest to their own part of a curve, up to ``layer`` points away, not to another layer."""
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
def free_side(curve, across, width, layer):
    """Tell on which side of each point the edge is clear of another layer, ``layer`` points away or more, shape (n,).

    0 where none is within :data:`CLEAR` of its band of this ``width``, else the sign by which the normal ``across``
    points away from it.  The layer next to the gripper is above.
    """
    out, spacing, widest = np.zeros(len(curve)), longest_step(curve), np.max(width)
    for i in range(len(curve)):
        least, j = CLEAR, 0
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
            j += 1 + max(int((distance - 0.5 * (width[i] + widest) - CLEAR) / spacing), 0)
    return out


@compiled(matrix(vector, number))
def factor(weights, cutoff):
    """Factorise the matrix L D L^T of :func:`smoothed`: D and the diagonals below it, shape (n, 4)."""
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


@compiled(matrix(matrix, vector, number))
def smoothed(values, weights, cutoff):
    """Smooth equally spaced values, shape (n, k), n > 6 (Whittaker-Henderson, a penalty on third differences).

    A wave of length ``cutoff`` (in spacings) is halved, one of twice that length loses 1.5 %.  Gaps (``weights``,
    shape (n,), zero) are bridged with the least change of curvature.
    """
    out = np.empty_like(values)
    for i in range(len(values)):
        for k in range(values.shape[1]):
            out[i, k] = weights[i] * values[i, k]
    substitute(factor(weights, cutoff), out)
    return out


@compiled(vector(vector, vector, mask, vector, vector, number))
def score(seen_width, seen_contrast, found, width, contrast, tolerance):
    """Rate how much each section looks like a strip of this ``width`` and ``contrast``, shape (n,), 0 to 1.

    ``tolerance`` is the standard deviation of the logarithm of the width.
    """
    out = np.zeros(len(width))
    for i in range(len(width)):
        if found[i]:
            clear = min(max(seen_contrast[i] / (0.7 * contrast[i]), 0.0), 1.0)
            wider = np.log(max(seen_width[i], 0.1) / width[i]) / tolerance
            out[i] = clear * np.exp(-0.5 * wider * wider)
    return out


@compiled(numba.types.Tuple((vector, mask))(vector, vector, vector, mask, number))
def strip_offset(offset, seen_width, width, good, cutoff):
    """Find the offsets of the strip's own centre, and where the band is the strip merged with something beside it.

    There its own edge is the one that agrees with the smooth curve through the other sections (``cutoff`` in spacings).
    """
    n, clean, own = len(good), np.zeros(len(good)), offset.copy()
    merged = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        merged[i] = good[i] and seen_width[i] > MERGED * width[i]
        clean[i] = good[i] and not merged[i]
    if np.sum(clean) < 0.3 * n:
        merged[:] = False
    if np.any(merged):
        expected = smoothed(offset.reshape(-1, 1), clean, 2.0 * cutoff)
        for k in np.flatnonzero(merged):
            slack = 0.5 * (seen_width[k] - width[k])
            lower, upper = offset[k] - slack, offset[k] + slack
            own[k] = lower if abs(lower - expected[k, 0]) < abs(upper - expected[k, 0]) else upper
    return own, merged


@compiled(vector(vector, vector, number))
def smooth_offsets(offset, scores, cutoff):
    """Smooth offsets as the motion of a strip is: outliers count little, gaps move as their neighbours."""
    n, last, base = len(offset), -1, np.full(len(offset), 0.05)
    filled = smooth = np.empty((n, 1))
    for i in range(n):
        if scores[i] < GOOD:
            continue
        base[i], before = scores[i], offset[last] if last >= 0 else offset[i]
        for j in range(last + 1, i + 1):
            filled[j, 0] = before + (offset[i] - before) * (j - last) / (i - last)
        last = i
    filled[last + 1 :] = offset[last]
    weights = base.copy()
    for _ in range(3):
        smooth = smoothed(filled, weights, cutoff)
        for i in range(n):
            weights[i] = base[i] / (1.0 + ((filled[i, 0] - smooth[i, 0]) / 2.0) ** 2)
    return smooth.reshape(-1)


@compiled(numba.types.Tuple((matrix, vector))(matrix, vector, vector, curve_type, number, number))
def smooth_centres(centres, noise, scores, across, cutoff, expected):
    """Smooth centres robustly; return them, shape (n, 2), and their weights, shape (n,).

    ``noise`` is that of ``Edges``, ``expected`` the weight of a centre that was not measured, over that of another.
    """
    good = np.flatnonzero(scores >= GOOD)
    usual, total, base = np.median(noise[good]), 0.0, np.full(len(scores), expected)
    for i in good:
        base[i] = scores[i] / min(max(noise[i] / usual, 0.5), 3.0) ** 2
        total += base[i]
    for i in good:
        base[i] *= len(good) / total
    weights, scaled = base.copy(), np.empty(len(good))
    for _ in range(3):
        smooth = smoothed(centres, weights, cutoff)
        for k, i in enumerate(good):
            away = (centres[i, 0] - smooth[i, 0]) * across[i, 0] + (centres[i, 1] - smooth[i, 1]) * across[i, 1]
            scaled[k] = abs(away) * np.sqrt(base[i])
        # Hairs pull an edge outwards.  Smoothing takes a tight bend off by 0.1 px: that is no outlier.
        sigma = max(1.4826 * np.median(scaled), 0.1)
        for k, i in enumerate(good):
            weights[i] = base[i] / (1.0 + (scaled[k] / (2.4 * sigma)) ** 2)
    return smoothed(centres, weights, cutoff), weights


@compiled(vector(vector))
def denoised(values):
    """Remove the noise of values along the strip."""
    return smoothed(values.reshape(-1, 1), np.ones(len(values)), 5.0).reshape(-1)


@compiled()
def moved(curve, offset, across):
    """Move the points of a curve along its normals."""
    out = np.empty_like(curve)
    for i in range(len(curve)):
        for k in range(2):
            out[i, k] = curve[i, k] + offset[i] * across[i, k]
    return out


@compiled()
def put(points, into):
    """Copy points: to assign a whole array takes seconds to compile."""
    for i in range(len(points)):
        for k in range(2):
            into[i, k] = points[i, k]


@compiled()
def rate(found, centres, curve, seen, width, contrast, layer, scores):
    """Score the sections with these edges; those not in view, of another layer or far off, 0.  Count the good ones."""
    rated = score(found[1], found[2], found[4] > 0.0, width, contrast, WIDTH_TOLERANCE)
    own, count = on_own_layer(centres, curve, layer), 0
    for i in range(len(curve)):
        scores[i] = rated[i] if own[i] and seen[i] else 0.0
        count += scores[i] >= GOOD
    return count


@compiled()
def hold_ends(curve, offset, across, ends, scores):
    """Set the offsets of both ends to where they are known to be."""
    for k in (0, -1):
        offset[k] = (ends[k, 0] - curve[k, 0]) * across[k, 0] + (ends[k, 1] - curve[k, 1]) * across[k, 1]
        scores[k] = 1.0


@compiled(pair(picture, matrix, vector, matrix, vector, vector, vector, vector, numba.boolean, index, number, number))
def follow(image, curve, offset, ends, width, contrast, sizes, scores, bright, layers, cutoff, widest):
    """Measure a strip near a curve, in place; see :func:`.line.follow`.

    ``curve``, shape (n, 2), pixels, becomes that of the strip, roughly ``offset`` away along the normals; ``width`` and
    ``contrast`` are updated, ``sizes`` are the rounded widths, ``scores`` the result.  ``layers``: distances along the
    strip of another layer, in the search and beside it, spacings, as ``cutoff``; ``widest``: largest width, pixels.
    Returns the share of the sections in view that were measured, negative for hardly any, and the longest hidden part.
    """
    n, shape = len(curve), image.shape
    across = normals(curve)
    centres = moved(curve, offset, across)
    found = bands(image, centres, across, sizes, bright, free_side(curve, across, width, layers[1]))
    if rate(found, centres, curve, inside(centres, shape, 0.0), width, contrast, layers[0], scores) < 6:
        return -1.0, 0.0
    hold_ends(curve, offset, across, ends, scores)
    put(moved(curve, smooth_offsets(offset, scores, 2.0 * cutoff), across), curve)
    good = merged = seen = np.zeros(n, dtype=np.bool_)
    side = assumed = np.zeros(n)
    # Where the strip bends sharply the first smooth curve cuts the corner: measured again from the second.
    for _ in range(2):
        across = normals(curve)
        side, assumed = free_side(curve, across, width, layers[1]), sizes.copy()
        for i in range(n):
            if side[i] != 0.0:
                assumed[i] = width[i]
        found, seen = bands(image, curve, across, assumed, bright, side), inside(curve, shape, 0.0)
        close = seen.copy()
        for i in range(n):
            close[i] &= abs(found[0, i]) <= 0.5 * width[i] + 1.0
        if rate(found, moved(curve, found[0], across), curve, close, width, contrast, layers[0], scores) < 6:
            return -1.0, 0.0
        good = scores >= GOOD
        own, merged = strip_offset(found[0], found[1], width, good, cutoff)
        farthest = 0.0
        for i in range(n):
            own[i] = own[i] if good[i] else 0.0
            farthest = max(farthest, abs(own[i]))
        # The gripper hides the end that it holds, and something may hide the other.
        hold_ends(curve, own, across, ends, scores)
        put(smooth_centres(moved(curve, own, across), found[3], scores, across, cutoff, GAP_WEIGHT)[0], curve)
        if farthest < CONVERGED:
            break
    wider, clearer = np.zeros(n), np.zeros(n)
    for i in range(n):
        # Layers that are seen as one must not become the usual width.
        if scores[i] > GOOD and not merged[i] and side[i] == 0.0:
            wider[i] = LEARNING_RATE * (min(max(found[1, i], 0.7 * width[i]), 1.4 * width[i]) - width[i])
            clearer[i] = LEARNING_RATE * (found[2, i] - contrast[i])
    wider, clearer = denoised(wider), denoised(clearer)
    measured = visible = run = longest = 0
    for i in range(n):
        width[i] = max(min(width[i] + wider[i], widest), 1.0)
        contrast[i] = max(contrast[i] + clearer[i], 1.0)
        visible += seen[i]
        measured += seen[i] and good[i]
        run = run + 1 if seen[i] and not good[i] else 0
        longest = max(longest, run)
    return measured / visible, longest / n

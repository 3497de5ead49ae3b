"""The line of a strip through its cross sections, and the strip followed from one picture to the next."""

from __future__ import annotations

import numba
import numpy as np

from stripfold.kernels.compiler import compiled, index, mask, matrix, vector
from stripfold.kernels.curves import picture, sampled, tangents
from stripfold.kernels.sections import edges, free_side, on_own_layer, robust, smoothed

number = numba.float64


@compiled(vector(vector, vector, mask, vector, vector, number))
def score(seen_width, seen_contrast, found, width, contrast, tolerance):
    """See :func:`.cross_sections.score_of`."""
    out = np.zeros(len(width))
    for i in range(len(width)):
        if found[i]:
            clear = min(max(seen_contrast[i] / (0.7 * contrast[i]), 0.0), 1.0)
            wider = np.log(max(seen_width[i], 0.1) / width[i]) / tolerance
            out[i] = clear * np.exp(-0.5 * wider * wider)
    return out


@compiled(numba.types.Tuple((vector, mask))(vector, vector, vector, mask, number, number))
def strip_offset(offset, seen_width, width, good, cutoff, ratio):
    """See :func:`.cross_sections.strip_offset`; from ``ratio`` times its width a band is more than the strip."""
    merged = good & (seen_width > ratio * width)
    clean = good & ~merged
    if not np.any(merged) or np.sum(clean) < 0.3 * len(clean):
        return offset, np.zeros(len(good), dtype=np.bool_)
    expected = smoothed(offset.reshape(-1, 1), np.where(clean, 1.0, 0.0), 2.0 * cutoff)
    own = offset.copy()
    for i in np.flatnonzero(merged):
        slack = 0.5 * (seen_width[i] - width[i])
        lower, upper = offset[i] - slack, offset[i] + slack
        own[i] = lower if abs(lower - expected[i, 0]) < abs(upper - expected[i, 0]) else upper
    return own, merged


@compiled(vector(vector, vector, number, number))
def smooth_offsets(offset, scores, cutoff, least):
    """See :func:`.cross_sections.smooth_offsets`; sections with a score of ``least`` count as measured."""
    places, good = np.arange(len(offset)).astype(np.float64), scores >= least
    filled = np.interp(places, places[good], offset[good])
    base = np.where(good, scores, 0.05)
    weights, smooth = base.copy(), filled
    for _ in range(3):
        smooth = smoothed(filled.reshape(-1, 1), weights, cutoff).reshape(-1)
        weights = base / (1.0 + ((filled - smooth) / 2.0) ** 2)
    return smooth


@compiled(numba.types.Tuple((matrix, vector))(matrix, vector, vector, matrix, number, number, number))
def smooth_centres(centres, noise, scores, across, cutoff, expected, least):
    """See :func:`.cross_sections.smooth_centres`; sections with a score of ``least`` count as measured."""
    good = scores >= least
    usual, base = np.median(noise[good]), np.zeros(len(scores))
    for i in np.flatnonzero(good):
        base[i] = scores[i] / min(max(noise[i] / usual, 0.5), 3.0) ** 2
    base /= np.mean(base[good])
    base[~good] = expected
    weights = robust(centres, base, good, across, cutoff)
    return smoothed(centres, weights, cutoff), weights


@compiled()
def normals(curve):
    """The tangents turned by a right angle."""
    out = tangents(curve)
    for i in range(len(out)):
        out[i, 0], out[i, 1] = -out[i, 1], out[i, 0]
    return out


@compiled()
def inside(points, shape):
    """Which points are in a picture."""
    out = np.empty(len(points), dtype=np.bool_)
    for i in range(len(points)):
        x, y = points[i]
        out[i] = (x >= 0.0) & (y >= 0.0) & (x <= shape[1] - 1.0) & (y <= shape[0] - 1.0)
    return out


@compiled()
def bands(image, points, across, width, bright, side, thin):
    """See :func:`.cross_sections.edges_at`; an array of shape (5, n).

    Unless ``side``, of :func:`.free_side`, is 0 the centre is half of ``width`` from the edge on that side.
    """
    reach = np.empty(len(width), dtype=np.int64)
    for i in range(len(width)):
        reach[i] = int(np.rint(1.2 * width[i])) + 6
    return edges(sampled(image, points, across, reach, bright), width, side, thin)


@compiled()
def longest_run(hidden):
    """Of True."""
    longest = run = 0
    for value in hidden:
        run = run + 1 if value else 0
        longest = max(longest, run)
    return longest


@compiled()
def learnt(values):
    """Values along the strip without their noise."""
    return smoothed(values.reshape(-1, 1), np.ones(len(values)), 5.0).reshape(-1)


pair, limits_type = numba.types.UniTuple(number, 2), numba.types.UniTuple(number, 9)


@compiled(
    pair(picture, matrix, vector, matrix, vector, vector, vector, vector, numba.boolean, index, number, limits_type)
)
def follow(image, curve, offset, ends, width, contrast, sizes, scores, bright, layers, cutoff, limits):
    """Measure a strip near a curve, in place; see :func:`.following.follow`.

    Parameters
    ----------
    image
        Grey values.
    curve, offset
        Places of the sections, shape (n, 2), and how far along its normal the strip roughly is from each, pixels.  The
        curve becomes that of the strip.
    ends
        Shape (2, 2): where its first and last points are.
    width, contrast, sizes
        Of the strip on each section: its width, which is updated, its contrast, which is, too, and the rounded width.
    scores
        Result, shape (n,).
    bright, layers, cutoff
        Whether the strip is; distances along it of another layer, in the search and beside it, and the cut-off of the
        smoothing, spacings.
    limits
        Score of a measured section; width of merged layers, relative to the strip's; clear distance, and width of a
        thin band, pixels; tolerance of the width; weight of a hidden section; offset of a line that has converged,
        pixels; rate of learning; largest width, pixels.

    Returns the share of the sections in view that were measured, negative where hardly any was, and the longest hidden
    part.
    """
    least, ratio, clear, thin, tolerance, hidden, converged, rate, widest = limits
    n, usual = len(curve), width.copy()
    across = normals(curve)
    centres = curve + offset.reshape(-1, 1) * across
    side = free_side(curve, across, width, layers[1], clear)
    found = bands(image, centres, across, sizes, bright, side, thin)
    scores[:] = score(found[1], found[2], found[4] > 0.0, width, contrast, tolerance)
    scores *= on_own_layer(centres, curve, layers[0]) & inside(centres, image.shape)
    if np.sum(scores >= least) < 6:
        return -1.0, 0.0
    for k in (0, -1):
        offset[k], scores[k] = np.sum((ends[k] - curve[k]) * across[k]), 1.0
    curve += smooth_offsets(offset, scores, 2.0 * cutoff, least).reshape(-1, 1) * across
    good = merged = seen = np.zeros(n, dtype=np.bool_)
    # Where the strip bends sharply the first smooth curve cuts the corner: measured again from the second.
    for _ in range(2):
        across = normals(curve)
        side = free_side(curve, across, width, layers[1], clear)
        found = bands(image, curve, across, np.where(side != 0.0, width, sizes), bright, side, thin)
        seen = inside(curve, image.shape)
        scores[:] = score(found[1], found[2], found[4] > 0.0, width, contrast, tolerance)
        scores *= on_own_layer(curve + found[0].reshape(-1, 1) * across, curve, layers[0]) & seen
        scores[np.abs(found[0]) > 0.5 * width + 1.0] = 0.0
        good = scores >= least
        if np.sum(good) < 6:
            return -1.0, 0.0
        own, merged = strip_offset(found[0], found[1], width, good, cutoff, ratio)
        own = np.where(good, own, 0.0)
        done = np.max(np.abs(own)) < converged
        # The gripper hides the end that it holds, and something may hide the other.
        for k in (0, -1):
            own[k], scores[k] = np.sum((ends[k] - curve[k]) * across[k]), 1.0
        centres = curve + own.reshape(-1, 1) * across
        curve[:] = smooth_centres(centres, found[3], scores, across, cutoff, hidden, least)[0]
        if done:
            break
    # Layers that are seen as one must not become the usual width.
    rates = np.where((scores > least) & ~merged & (side == 0.0), rate, 0.0)
    width += learnt(rates * (np.minimum(np.maximum(found[1], 0.7 * usual), 1.4 * usual) - usual))
    width[:] = np.maximum(np.minimum(width, widest), 1.0)
    contrast += learnt(rates * (found[2] - contrast))
    contrast[:] = np.maximum(contrast, 1.0)
    return np.mean(good[seen]), longest_run(~good & seen) / n

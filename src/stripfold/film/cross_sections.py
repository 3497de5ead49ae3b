"""Cross sections of a strip in a picture: grey values along the normals of a curve, and the strip's edges on them.

All arrays are small (some hundred sections of some ten samples): a frame costs a few milliseconds.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold import kernels
from stripfold.base.arrays import Array, Mask, Picture

Grey = NDArray[np.float32]

THIN = 4.0
"""Width, pixels, up to which a band is located by its centroid: its two edges are not resolved."""
GOOD = 0.4
"""Score from which a section counts as measured."""
MERGED = 1.3
"""Width, relative to the strip's, from which a band is taken for the strip and something beside it."""
LAYER_DISTANCE = 5.0
"""Distance along the strip, in widths, from which another part of it is another layer."""
CLEAR = 4.0
"""Distance between the bands of two layers, pixels, below which what is between them is too narrow to be seen."""
LONGEST_CUTOFF = 0.055
"""Largest wave length that smoothing halves, as a share of the strip's length."""
WIDEST = 1.3
"""Largest width of a strip along it, relative to the usual one."""
WIDTH_STEP = 0.25
"""Widths are rounded to steps of this logarithm: sections of one width are processed together."""

DECAY = 0.7
"""Decay of the search for a band next to where it is expected, as a share of its reach."""


class Edges(NamedTuple):
    """A band on each section, arrays of shape (n,).

    ``offset`` of its centre from the middle of the section and ``width`` at half contrast, pixels; ``contrast``, grey
    levels; ``noise``, how far the edges move per grey level, pixels; ``found``, whether both edges were.
    """

    offset: Array
    width: Array
    contrast: Array
    noise: Array
    found: Mask


def arc_length(points: Array) -> Array:
    """Length of the polygon up to each of ``points``, shape (n,)."""
    return np.asarray(kernels.curves.arc_length(np.ascontiguousarray(points)))


def tangents(points: Array) -> Array:
    """Unit tangents of a curve through ``points``, shape (n, 2)."""
    return np.asarray(kernels.curves.tangents(np.ascontiguousarray(points)))


def normals(points: Array) -> Array:
    """Unit normals of a curve through ``points``, shape (n, 2): the tangents turned by a right angle."""
    along = tangents(points)
    return np.column_stack([-along[:, 1], along[:, 0]])


def end_direction(points: Array) -> Array:
    """Unit vector, shape (2,), in which a curve ends, over a few points since each scatters."""
    step = points[-1] - points[-1 - min(3, len(points) - 1)]
    return np.asarray(step / max(float(np.hypot(*step)), 1e-9))


def resampled(points: Array, s: Array) -> Array:
    """A smooth curve through ``points``, shape (n, 2), at the arc lengths ``s``, shape (m,)."""
    # A cubic Hermite spline; that of scipy takes many times as long for so few points.
    return np.asarray(kernels.curves.resampled(np.ascontiguousarray(points), s))


def respaced(points: Array, first: float, last: float, count: int) -> tuple[Array, Array]:
    """``count`` equally spaced points of a curve from one arc length to another, and their arc lengths.

    The curve is extended straight where ``first`` is negative or ``last`` exceeds its length.
    """
    s = np.linspace(first, last, count)
    beyond = last - arc_length(points)[-1]
    if beyond > 0.0:
        points = np.concatenate([points, [points[-1] + beyond * end_direction(points)]])
    if first < 0.0:
        points = np.concatenate([[points[0] - first * end_direction(points[::-1])], points])
    return resampled(points, s - min(first, 0.0)), s


def cutoff_of(width: float, length: float) -> float:
    """Wave length that smoothing halves, pixels: hairs and weave are shorter, bends of a strip longer."""
    return max(min(3.0 * width, LONGEST_CUTOFF * length), 24.0)


def rounded(width: Array) -> Array:
    """Widths in whole pixels, of few distinct values."""
    steps = np.exp(WIDTH_STEP * np.rint(np.log(np.maximum(width, 1.0)) / WIDTH_STEP))
    return np.maximum(np.rint(steps), 1.0)


def layer_distance(width: float, reach: float, h: float) -> int:
    """How many spacings ``h`` along a strip another layer is away at least, pixels; ``reach`` is that of a search."""
    return int((LAYER_DISTANCE * width + 2.0 * reach) / h)


def on_own_layer(places: Array, curve: Array, layer: int) -> Mask:
    """Which places are nearest to their own part of a curve, up to ``layer`` points away, and not to another layer."""
    places, curve = np.ascontiguousarray(places), np.ascontiguousarray(curve)
    return np.asarray(kernels.sections.on_own_layer(places, curve, layer))


def inside(points: Array, shape: tuple[int, ...], margin: float = 0.0) -> Mask:
    """Which ``points``, shape (n, 2), lie in a picture of ``shape``, at least ``margin`` from its border."""
    x, y = points.T
    return (x >= margin) & (y >= margin) & (x <= shape[1] - 1 - margin) & (y <= shape[0] - 1 - margin)


def sample(image: Picture, points: Array, across: Array, reach: NDArray[np.intp] | int, bright: bool) -> Grey:
    """Rounded grey values at each pixel up to ``reach`` to both sides, shape (n, 2 reach + 1); dark strips inverted.

    Where sections have a ``reach`` each, shape (n,), rows are as long as the longest, and 0 beyond their own.
    Outside the picture the values at its border are repeated.
    """
    points, across = np.ascontiguousarray(points), np.ascontiguousarray(across)
    reach = np.full(len(points), reach)
    return np.asarray(kernels.curves.sampled(np.ascontiguousarray(image), points, across, reach, bright))


def locate(image: Picture, points: Array, across: Array, width: Array, reach: float, bright: bool, along: int) -> Array:
    """Roughly where a band is on each section, shape (n,): whole pixels from the middle, at most ``reach``.

    The response to a template (the band minus what is beside it) is smoothed over ``along`` neighbours and decays
    from the middle: another part of the strip close by may be as clear, but only the strip itself is near everywhere.
    ``width``, shape (n,), has few distinct values.
    """
    limit = int(np.ceil(reach))
    half = limit + int(np.ceil(width.max())) + 1
    profiles = sample(image, points, across, half, bright)
    response = kernels.sections.responses(profiles, width)
    response = cv2.GaussianBlur(response, (1, 2 * along + 1), 0.0, sigmaY=max(along / 2.0, 0.5))
    t = np.arange(-half, half + 1)
    near = np.exp(-0.5 * (t / max(DECAY * reach, 1.0)) ** 2) * (np.abs(t) <= limit)
    return np.asarray(t[np.argmax((np.maximum(response, 0.0) + 1e-6) * near, axis=1)], dtype=np.float64)


def edges_at(image: Picture, points: Array, across: Array, width: Array | float, bright: bool) -> Edges:
    """:func:`measure_edges` on sections through ``points`` of a picture."""
    return measure_edges(sample(image, points, across, search_range(width) + 1, bright), width)


def search_range(width: Array | float) -> NDArray[np.intp]:
    """How far from the centre of a band of ``width`` its edges and what is beside it are looked for, pixels."""
    return np.rint(1.2 * np.asarray(width)).astype(np.intp) + 5


def measure_edges(profiles: Grey, width: Array | float) -> Edges:
    """Sub-pixel edges of a band that lies in the middle of each section.

    Each edge is where the grey value is half-way between the band's and that beside it, on its own side: a strip
    often has its dimmer face on one side and the background on the other.

    ``profiles`` has shape (n, 2 r + 1), with r at least the largest :func:`search_range`; ``width`` is the band's
    approximate width on each section, shape (n,), or on all, pixels.
    """
    width = np.full(len(profiles), width, dtype=np.float64)
    *values, found = kernels.sections.edges(profiles, width, np.zeros(len(width)), THIN)
    return Edges._make([*values, found > 0.0])


def score_of(edges: Edges, width: Array | float, contrast: Array | float, tolerance: float) -> Array:
    """How much each section looks like a strip of this ``width`` and ``contrast``, shape (n,), 0 to 1.

    ``tolerance`` is the standard deviation of the logarithm of the width.
    """
    width, contrast = (np.full(len(edges.width), value, dtype=np.float64) for value in (width, contrast))
    return np.asarray(kernels.lines.score(edges.width, edges.contrast, edges.found, width, contrast, tolerance))


def strip_offset(edges: Edges, width: Array | float, good: Mask, cutoff: float) -> tuple[Array, Mask]:
    """Offsets of the strip's own centre, shape (n,), and where the band is the strip merged with something beside it.

    There one edge is the strip's own, the one that agrees with the smooth curve through the other sections (cut-off
    in spacings); the centre is half a width from it.
    """
    width = np.full(len(good), width, dtype=np.float64)
    offset, merged = kernels.lines.strip_offset(edges.offset, edges.width, width, good, cutoff, MERGED)
    return np.asarray(offset), np.asarray(merged)


def smooth_offsets(offset: Array, score: Array, cutoff: float) -> Array:
    """Offsets as smooth as the motion of a strip, shape (n,): outliers count little, gaps move as their neighbours."""
    return np.asarray(kernels.lines.smooth_offsets(offset, score, cutoff, GOOD))


def smooth_centres(
    centres: Array, noise: Array, score: Array, across: Array, cutoff: float, expected: float
) -> tuple[Array, Array]:
    """Robustly smoothed centres, shape (n, 2), and their weights, shape (n,).

    ``noise`` is that of :class:`Edges`, ``across`` are the normals, ``cutoff`` is in spacings, and ``expected`` the
    weight of a centre that was not measured, relative to that of a measured one.
    """
    across = np.ascontiguousarray(across)
    smooth, weights = kernels.lines.smooth_centres(centres, noise, score, across, cutoff, expected, GOOD)
    return np.asarray(smooth), np.asarray(weights)

"""Sections across a strip: grey values along the normals of a curve, and where the strip's two edges are on them.

All arrays are small (some hundred sections of some ten samples): a frame of a film costs about a millisecond.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array, Mask

# Single precision for grey values: they have eight bits.
Grey = NDArray[np.float32]

THIN = 4.0
"""Up to this width, pixels, a band is located by its centroid: its edges are not apart from each other."""


class Edges(NamedTuple):
    """What was found on each section, all of shape (n,).

    ``offset`` of the band's centre from the middle of the section, ``width`` between its edges at half contrast, both
    in pixels; ``contrast`` in grey levels; ``noise``, how far the edges move per grey level, pixels; ``found``.
    """

    offset: Array
    width: Array
    contrast: Array
    noise: Array
    found: Mask


def tangents(points: Array) -> Array:
    """Unit tangents of a curve through ``points``, shape (n, 2)."""
    way = np.empty_like(points)
    way[1:-1] = points[2:] - points[:-2]
    way[0], way[-1] = points[1] - points[0], points[-1] - points[-2]
    return np.asarray(way / np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None])


def normals(along: Array) -> Array:
    """Tangents turned by a right angle."""
    return np.column_stack([-along[:, 1], along[:, 0]])


def interpolated(points: Array, arc: Array, s: Array) -> Array:
    """A smooth curve through ``points``, shape (n, 2), at arc lengths ``s``, shape (m,): cubic between neighbours.

    Scipy's splines do the same; for a hundred points their checks cost ten times as much as the interpolation.
    """
    slope = np.gradient(points, arc, axis=0)
    i = np.clip(np.searchsorted(arc, s, side="right") - 1, 0, len(arc) - 2)
    h = arc[i + 1] - arc[i]
    u = ((s - arc[i]) / h)[:, None]
    before, after = points[i], points[i + 1]
    bend = (1.0 - u) * (h[:, None] * slope[i] - (after - before)) - u * (h[:, None] * slope[i + 1] - (after - before))
    return np.asarray((1.0 - u) * before + u * after + u * (1.0 - u) * bend)


def sample(image: NDArray[np.uint8], points: Array, across: Array, reach: int, bright: bool) -> Grey:
    """Grey values at each pixel up to ``reach`` to both sides; shape (n, 2 reach + 1); a dark strip is turned bright.

    Outside the picture the values at its border go on.
    """
    t = np.arange(-reach, reach + 1, dtype=np.float32)
    x = (points[:, 0, None] + across[:, 0, None] * t).astype(np.float32)
    y = (points[:, 1, None] + across[:, 1, None] * t).astype(np.float32)
    values = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)
    return np.asarray(values if bright else 255.0 - values, dtype=np.float32)


def inside(points: Array, shape: tuple[int, ...], margin: float = 0.0) -> Mask:
    """Which ``points``, shape (n, 2), lie in a picture of ``shape``, at least ``margin`` off its border."""
    x, y = points.T
    return (x >= margin) & (y >= margin) & (x <= shape[1] - 1 - margin) & (y <= shape[0] - 1 - margin)


def locate(profiles: Grey, width: float, along: int) -> Array:
    """Roughly where a band of ``width`` is on each section, shape (n,), pixels from its middle.

    The answer to a template, a band less what is beside it, is smoothed over ``along`` neighbours and falls off from
    the middle: another part of the strip close by may be as clear, but only the strip itself is near everywhere.
    """
    reach = profiles.shape[1] // 2
    core, wide = max(round(width), 1) | 1, (2 * max(round(width), 2)) | 1
    beside = cv2.blur(profiles, (wide + core, 1), borderType=cv2.BORDER_REPLICATE)
    answer = cv2.blur(profiles, (core, 1), borderType=cv2.BORDER_REPLICATE) - beside
    smooth = cv2.GaussianBlur(answer, (1, 2 * along + 1), 0.0, sigmaY=max(along / 2.0, 0.5))
    t = np.arange(-reach, reach + 1)
    answer = np.maximum(smooth, 0.0) * np.exp(-0.5 * (t / (0.6 * reach)) ** 2).astype(np.float32)
    return np.asarray(t[np.argmax(answer, axis=1)], dtype=np.float64)


def edges_at(image: NDArray[np.uint8], points: Array, across: Array, width: Array | float, bright: bool) -> Edges:
    """:func:`measure` on sections through ``points`` of a picture."""
    return measure(sample(image, points, across, int(np.max(sight(width))), bright), width)


def measure(profiles: Grey, width: Array | float) -> Edges:
    """Sub-pixel centres of a band that lies in the middle of each section.

    Each edge is where the grey value is half way between the band's and that beside it, on its own side: a strip
    often has its dimmer face on one side and the background on the other.

    Parameters
    ----------
    profiles
        Shape (n, 2 r + 1), with r at least :func:`sight` of the widest.
    width
        About how wide the band is, on each section (shape (n,)) or on all, pixels.
    """
    width = np.broadcast_to(np.asarray(width, dtype=np.float64), len(profiles))
    reach = profiles.shape[1] // 2
    t = np.arange(-reach, reach + 1, dtype=np.float32)
    seen = sight(width)
    blurred = cv2.blur(profiles, (3, 1), borderType=cv2.BORDER_REPLICATE)
    top, left, right = np.empty((3, len(profiles)), np.float32)
    # Sections of one width together: of these the columns to look at are the same.
    for size in np.unique(width):
        rows = np.flatnonzero(width == size)
        core, far = int(0.3 * size), int(sight(size))
        out = min(int(np.rint(0.5 * size)) + 1, far - 1)
        top[rows] = profiles[rows, reach - core : reach + core + 1].mean(axis=1, dtype=np.float64)
        left[rows] = blurred[rows, reach - far : reach - out].min(axis=1)
        right[rows] = blurred[rows, reach + out + 1 : reach + far + 1].min(axis=1)
    below, found_below, slope_below = _crossing(profiles[:, reach::-1], 0.5 * (top + left), seen)
    above, found_above, slope_above = _crossing(profiles[:, reach:], 0.5 * (top + right), seen)
    offset, wide = 0.5 * (above - below), above + below
    thin = np.flatnonzero(width <= THIN)
    if thin.size:
        base, high = 0.5 * (left + right)[thin], top[thin]
        near = np.abs(t) <= np.minimum(0.5 * width[thin] + 2.0, seen[thin])[:, None]
        weight = np.maximum(profiles[thin] - (base + 0.1 * (high - base))[:, None], 0.0) * near
        offset[thin] = (weight @ t) / np.maximum(weight.sum(axis=1), 1e-6)
    contrast = top - np.maximum(left, right)
    noise = 0.5 * np.hypot(1.0 / slope_below, 1.0 / slope_above)
    offset, wide, clear, noise = (np.asarray(a, dtype=np.float64) for a in (offset, wide, contrast, noise))
    return Edges(offset, wide, clear, noise, found_below & found_above)


def sight(width: Array | float) -> NDArray[np.intp]:
    """How far to both sides of a band of ``width`` its edges and what is beside it are looked for, pixels."""
    return np.rint(1.2 * np.asarray(width)).astype(np.intp) + 5


def _crossing(values: Grey, level: Grey, seen: NDArray[np.intp]) -> tuple[Array, Mask, Array]:
    """Where each row first falls below its level within what is ``seen``: place, whether it does, and how steeply."""
    low = values < level[:, None]
    low[:, 0] = False
    at = np.argmax(low, axis=1)
    rows = np.arange(len(values))
    found = (at > 0) & (at <= seen)
    at = np.where(found, at, 1)
    before, after = values[rows, at - 1], values[rows, at]
    drop = np.maximum(before - after, 1e-3)
    place = at - 1 + np.clip((before - level) / drop, 0.0, 1.0)
    return place, found, np.maximum(drop, 1.0)

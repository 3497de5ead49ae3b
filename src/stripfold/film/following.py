"""The strip in one frame, next to where it is expected from the frames before.

The line is a material curve: it begins where the gripper holds the strip and ends on the lying part, at a place that
does not move, so its length does not change.  Its width and contrast are known at each point, because a strip that is
seen obliquely is three times as wide where it lies as where it hangs.  A section that does not look like that, or is
nearer to another layer, counts as hidden: there the line moves as its neighbours do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Picture
from stripfold.film.centreline import Centreline
from stripfold.film.cross_sections import (
    CLEAR,
    GOOD,
    MERGED,
    THIN,
    WIDEST,
    arc_length,
    cutoff_of,
    edges_at,
    end_direction,
    layer_distance,
    locate,
    normals,
    resampled,
    respaced,
    rounded,
)
from stripfold.film.smoothing import median, smoothed

MIN_MEASURED = 0.5
"""Least share of the sections in view that must be measured."""
SHARPER = 2.0 / 3.0
"""Cut-off of the smoothing relative to that in a single picture: a bend that it takes off is taken off again in each
frame, until it is off the strip."""
MAX_GAP = 0.25
"""Longest hidden part, as a share of the line."""
WIDTH_TOLERANCE = 0.4
"""Standard deviation of the logarithm of the width in the score of a section."""
LEARNING_RATE = 0.2
"""How fast width and contrast follow what was measured, per frame."""
GAP_WEIGHT = 0.05
"""Weight of the expected place of a hidden section, relative to a measured one."""
CONVERGED = 1.0
"""Largest offset, pixels, after which a line is not measured again."""


class Followed(NamedTuple):
    """A line, the ``share`` of the sections in view that were measured, and the longest hidden part (``gap``)."""

    line: Centreline
    share: float
    gap: float

    @property
    def sound(self) -> bool:
        """Whether enough of it was measured."""
        return self.share >= MIN_MEASURED and self.gap <= MAX_GAP


def with_appearance(image: Picture, line: Centreline) -> Centreline:
    """A line that was just found, with smooth width and contrast, which :func:`follow` compares sections with."""
    width = _denoised(np.maximum(line.width, 1.0))
    edges = edges_at(image, line.points, normals(line.points), rounded(width), line.bright)
    clear = edges.found & (edges.contrast > 0.25 * line.contrast)
    contrast = np.where(clear, edges.contrast, line.contrast)
    return replace(line, width=width, contrast=_denoised(np.minimum(contrast, 1.5 * line.contrast)))


def follow(image: Picture, guess: Centreline, ends: Array, reach: float) -> Followed | None:
    """The strip next to where it is expected, or None where hardly any of it is seen.

    ``guess`` says where it is expected and what it looks like, ``ends``, shape (2, 2), where its first point is, by
    the gripper's marker, and its last one; it may be up to ``reach`` from ``guess``; pixels.
    """
    arc = guess.arc
    typical = median(guess.width)
    s = np.linspace(0.0, arc[-1], max(int(arc[-1] / np.clip(0.5 * typical, 3.0, 6.0)), 24) + 1)
    h = float(s[1])
    cutoff = SHARPER * cutoff_of(typical, float(arc[-1])) / h
    layer = layer_distance(typical, reach, h)
    width, contrast = np.interp(s, arc, guess.width), np.interp(s, arc, guess.contrast)
    sizes = rounded(width)

    curve = resampled(guess.points, s)
    offset = locate(image, curve, normals(curve), sizes, reach, guess.bright, max(round(typical / h), 2))
    layers, score = np.array([layer, layer_distance(typical, 0.0, h)]), np.empty(len(s))
    limits = GOOD, MERGED, CLEAR, THIN, WIDTH_TOLERANCE, GAP_WEIGHT, CONVERGED, LEARNING_RATE, WIDEST * typical
    share, gap = kernels.lines.follow(
        image, curve, offset, ends, width, contrast, sizes, score, guess.bright, layers, cutoff, limits
    )
    if share < 0.0:
        return None
    points, places = between_ends(curve, ends, len(guess.points))
    line = replace(
        guess,
        points=points,
        sd=np.full(len(points), np.nan),
        width=np.interp(places, s, width),
        contrast=np.interp(places, s, contrast),
        score=np.interp(places, s, score),
    )
    return Followed(line, share, gap)


def between_ends(curve: Array, ends: Array, count: int) -> tuple[Array, Array]:
    """Equally spaced points of a curve between the projections of ``ends``, shape (2, 2), and their arc lengths."""
    length = float(arc_length(curve)[-1])
    first = -float((ends[0] - curve[0]) @ end_direction(curve[::-1]))
    last = length + float((ends[1] - curve[-1]) @ end_direction(curve))
    return respaced(curve, min(first, 0.5 * length), max(last, 0.5 * length), count)


def _denoised(values: Array) -> Array:
    """Values along the strip without their noise."""
    return smoothed(values, np.ones(len(values)), 5.0)

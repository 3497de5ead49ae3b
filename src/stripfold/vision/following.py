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

from stripfold.arrays import Array, Mask, Picture
from stripfold.vision.centreline import Centreline
from stripfold.vision.cross_sections import (
    GOOD,
    WIDEST,
    Edges,
    arc_length,
    cutoff_of,
    edges_at,
    end_direction,
    free_side,
    inside,
    layer_distance,
    locate,
    normals,
    on_own_layer,
    resampled,
    respaced,
    rounded,
    score_of,
    smooth_centres,
    smooth_offsets,
    strip_offset,
)
from stripfold.vision.smoothing import median, smoothed

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
DECAY = 0.7
"""Decay of the search for the strip next to where it is expected, as a share of its reach."""


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

    def scored(curve: Array, centres: Array, edges: Edges) -> Array:
        return score_of(edges, width, contrast, WIDTH_TOLERANCE) * on_own_layer(centres, curve, layer)

    curve = resampled(guess.points, s)
    across = normals(curve)
    offset = locate(image, curve, across, sizes, reach, guess.bright, max(round(typical / h), 2), DECAY)
    centres = curve + offset[:, None] * across
    own = layer_distance(typical, 0.0, h)
    side = free_side(curve, across, width, own)
    score = scored(curve, centres, edges_at(image, centres, across, sizes, guess.bright, side))
    score *= inside(centres, image.shape)
    if np.sum(score >= GOOD) < 6:
        return None
    offset[[0, -1]], score[[0, -1]] = _end_offsets(curve, across, ends), 1.0
    curve = curve + smooth_offsets(offset, score, 2.0 * cutoff)[:, None] * across
    # Where the strip bends sharply the first smooth curve cuts the corner: measured again from the second.
    for _ in range(2):
        across = normals(curve)
        side = free_side(curve, across, width, own)
        edges = edges_at(image, curve, across, np.where(side != 0.0, width, sizes), guess.bright, side)
        seen = inside(curve, image.shape)
        score = scored(curve, curve + edges.offset[:, None] * across, edges) * seen
        score[np.abs(edges.offset) > 0.5 * width + 1.0] = 0.0
        good = score >= GOOD
        if good.sum() < 6:
            return None
        offset, merged = strip_offset(edges, width, good, cutoff)
        offset = np.where(good, offset, 0.0)
        converged = float(np.abs(offset).max()) < CONVERGED
        # The gripper hides the end that it holds, and something may hide the other.
        offset[[0, -1]], score[[0, -1]] = _end_offsets(curve, across, ends), 1.0
        centres = curve + offset[:, None] * across
        curve, _ = smooth_centres(centres, edges.noise, score, across, cutoff, GAP_WEIGHT)
        if converged:
            break

    points, places = between_ends(curve, ends, len(guess.points))
    # Layers that are seen as one must not become the usual width.
    rate = np.where((score > GOOD) & ~merged & (side == 0.0), LEARNING_RATE, 0.0)
    width = width + _denoised(rate * (np.clip(edges.width, 0.7 * width, 1.4 * width) - width))
    width = np.minimum(width, WIDEST * typical)
    contrast = contrast + _denoised(rate * (edges.contrast - contrast))
    line = replace(
        guess,
        points=points,
        sd=np.full(len(points), np.nan),
        width=np.interp(places, s, np.maximum(width, 1.0)),
        contrast=np.interp(places, s, np.maximum(contrast, 1.0)),
        score=np.interp(places, s, score),
    )
    return Followed(line, float(good[seen].mean()), _longest_run(~good & seen) / len(good))


def between_ends(curve: Array, ends: Array, count: int) -> tuple[Array, Array]:
    """Equally spaced points of a curve between the projections of ``ends``, shape (2, 2), and their arc lengths."""
    length = float(arc_length(curve)[-1])
    first = -float((ends[0] - curve[0]) @ end_direction(curve[::-1]))
    last = length + float((ends[1] - curve[-1]) @ end_direction(curve))
    return respaced(curve, min(first, 0.5 * length), max(last, 0.5 * length), count)


def _end_offsets(curve: Array, across: Array, ends: Array) -> Array:
    """Offsets of the known ends, shape (2,)."""
    return np.einsum("ij,ij->i", ends - curve[[0, -1]], across[[0, -1]])


def _longest_run(hidden: Mask) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hidden, [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _denoised(values: Array) -> Array:
    """Values along the strip without their noise."""
    return smoothed(values, np.ones(len(values)), 5.0)

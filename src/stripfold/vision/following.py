"""The strip of one frame from that of the frame before: only as far as it can have gone, and along all of its length.

The line is a curve fixed in the material: it begins where the gripper holds the strip and ends on the lying part, at a
place that does not move, and so its length does not change either.  Each
place along it is known by how wide and how clear the strip is there, for a strip that is seen obliquely is three times
as wide where it lies as where it hangs.  What does not look like that, or is nearer to another layer, is hidden: there
the line moves as its neighbours do.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array, Mask, Picture
from stripfold.vision.layers import Layers
from stripfold.vision.measuring import GOOD, MERGED, Centreline, smoothed_centres
from stripfold.vision.sections import Edges, edges_at, inside, interpolated, normals, sample, tangents
from stripfold.vision.smooth import median, smoothed_values

LEAST_SHARE = 0.5
"""Share of the sections in view that must be measured."""
WIDEST_GAP = 0.25
"""Longest hidden part, as a share of the line."""
WIDER = 0.4
"""Logarithm of a change of width that halves a score, about."""
CLEAR = 0.7
"""Contrast from which a section is as clear as it can be, in what it usually has."""
LEARNT = 0.2
"""How fast what the strip looks like follows what was measured, per frame."""
HIDDEN = 0.05
"""Weight of where a hidden part is expected, in that of a measured section."""
SETTLED = 1.0
"""Largest offset, pixels, after which a line is not measured again."""
SIZES = 0.25
"""Step of the sizes that are told apart, logarithm."""
LAYER = 5.0
"""From how far along the strip another part of it is another layer, in widths."""


@dataclass(frozen=True, eq=False)
class Look:
    """What the strip looks like at the points of a line.

    Attributes
    ----------
    width
        Shape (n,), of the visible band, pixels.
    contrast
        Shape (n,), to what is beside it, grey levels.
    """

    width: Array
    contrast: Array


@dataclass(frozen=True, eq=False)
class Followed:
    """A line, what it looks like, and how well it was seen.

    Attributes
    ----------
    line
        As many points as the guess had.
    look
        What the strip looks like at the line's points.
    share
        Of the sections in view, those that were measured.
    gap
        The longest hidden part, as a share of the line.
    """

    line: Centreline
    look: Look
    share: float
    gap: float

    @property
    def sound(self) -> bool:
        """Whether enough was seen."""
        return self.share >= LEAST_SHARE and self.gap <= WIDEST_GAP


def first_look(image: Picture, line: Centreline) -> Look:
    """What the strip of a line that was just found looks like."""
    width = _evened(np.maximum(line.width, 1.0))
    edges = _edges(image, line.points, normals(tangents(line.points)), width, line.bright)
    clear = edges.found & (edges.contrast > 0.25 * line.contrast)
    contrast = np.where(clear, edges.contrast, line.contrast)
    return Look(width, _evened(np.minimum(contrast, 1.5 * line.contrast)))


def follow(image: Picture, guess: Centreline, look: Look, ends: Array, reach: float) -> Followed | None:
    """The strip next to where it is expected, or None where next to nothing of it is seen.

    Parameters
    ----------
    image
        Grey values, shape (h, w).
    guess
        Where it is expected.
    look
        What it looks like at the points of ``guess``.
    ends
        Shape (2, 2): where the line's first point is now, by the gripper's marker, and its last one, pixels.
    reach
        How far from ``guess`` it may be, pixels.
    """
    arc = guess.arc
    typical = median(look.width)
    count = max(int(arc[-1] / np.clip(0.5 * typical, 3.0, 6.0)), 24)
    s = np.linspace(0.0, arc[-1], count + 1)
    h = float(s[1])
    curve = interpolated(guess.points, arc, s)
    width, contrast = np.interp(s, arc, look.width), np.interp(s, arc, look.contrast)
    layers = Layers(curve, int((LAYER * typical + 2.0 * reach) / h))
    cutoff = max(3.0 * typical, 24.0) / h

    across = normals(tangents(curve))
    offset = _located(image, curve, across, width, reach, guess.bright, max(round(typical / h), 2))
    there = curve + offset[:, None] * across
    edges = _edges(image, there, across, width, guess.bright)
    score = _score(edges, width, contrast) * inside(there, image.shape) * layers.own(there, curve)
    if np.sum(score >= GOOD) < 6:
        return None
    known = np.einsum("ij,ij->i", ends - curve[[0, -1]], across[[0, -1]])
    settled = curve + _evened_offset(offset, score, 2.0 * cutoff, known)[:, None] * across

    # Where the strip bends sharply the first smooth curve cuts the corner: measured again from the second.
    for _ in range(2):
        across = normals(tangents(settled))
        edges = _edges(image, settled, across, width, guess.bright)
        seen = inside(settled, image.shape)
        centres = settled + edges.offset[:, None] * across
        score = _score(edges, width, contrast) * seen * layers.own(centres, settled)
        score = np.where(np.abs(edges.offset) > 0.5 * width + 1.0, 0.0, score)
        good = score >= GOOD
        if good.sum() < 6 or not seen.any():
            return None
        offset = _one_edge(edges, width, good, cutoff)
        centres = settled + np.where(good, offset, 0.0)[:, None] * across
        # The gripper hides the end that it holds, and something may hide the other.
        known = np.einsum("ij,ij->i", ends - settled[[0, -1]], across[[0, -1]])
        centres[[0, -1]] = settled[[0, -1]] + known[:, None] * across[[0, -1]]
        score[[0, -1]] = 1.0
        smooth, _ = smoothed_centres(centres, edges, score, across, cutoff, HIDDEN)
        if float(np.abs(offset[good]).max()) < SETTLED:
            break
        settled = smooth
    gap = _longest(~good & seen) / len(good)
    points, places = between(smooth, ends, len(guess.points))
    line = Centreline(
        points,
        np.full(len(points), np.nan),
        np.interp(places, s[good], edges.width[good]),
        np.interp(places, s, score),
        guess.bright,
        median(edges.contrast[good]),
        guess.open_ends,
    )
    sure = np.where(score > GOOD, LEARNT, 0.0)
    learnt = Look(
        np.maximum(
            np.interp(places, s, width + _evened(sure * (np.clip(edges.width, 0.7 * width, 1.4 * width) - width))), 1.0
        ),
        np.interp(places, s, np.maximum(contrast + _evened(sure * (edges.contrast - contrast)), 1.0)),
    )
    return Followed(line, learnt, float(good[seen].mean()), gap)


def _located(image: Picture, curve: Array, across: Array, width: Array, reach: float, bright: bool, n: int) -> Array:
    """Roughly where the band is on each section, shape (n,), pixels from the guess, at most ``reach``."""
    allowed = int(np.ceil(reach))
    half = allowed + int(np.ceil(width.max())) + 1
    profiles = sample(image, curve, across, half, bright)
    core = _sizes(width) | 1
    t = np.arange(-half, half + 1)
    answer = np.zeros_like(profiles)
    for size in np.unique(core):
        wide = 2 * max(int(size), 2) | 1
        of_size = profiles[core == size]
        inner = cv2.blur(of_size, (int(size), 1), borderType=cv2.BORDER_REPLICATE)
        answer[core == size] = inner - cv2.blur(of_size, (wide + int(size), 1), borderType=cv2.BORDER_REPLICATE)
    smooth = cv2.GaussianBlur(answer, (1, 2 * n + 1), 0.0, sigmaY=max(n / 2.0, 0.5))
    near = np.exp(-0.5 * (t / max(0.7 * reach, 1.0)) ** 2) * (np.abs(t) <= allowed)
    return np.asarray(t[np.argmax(np.maximum(smooth, 0.0) * near + 1e-6 * near, axis=1)], dtype=np.float64)


def _edges(image: Picture, curve: Array, across: Array, width: Array, bright: bool) -> Edges:
    """The band's edges on sections, each measured as the width there asks for."""
    return edges_at(image, curve, across, _sizes(width).astype(np.float64), bright)


def _sizes(width: Array) -> NDArray[np.intp]:
    """Widths in whole pixels, a few for all sections: those of one size are looked at together."""
    steps = np.exp(SIZES * np.rint(np.log(np.maximum(width, 1.0)) / SIZES))
    return np.maximum(np.rint(steps), 1.0).astype(np.intp)


def _score(edges: Edges, width: Array, contrast: Array) -> Array:
    clear = np.clip(edges.contrast / (CLEAR * contrast), 0.0, 1.0)
    wider = np.log(np.maximum(edges.width, 0.1) / width) / WIDER
    return np.asarray(np.where(edges.found, clear * np.exp(-0.5 * wider**2), 0.0))


def _evened_offset(offset: Array, score: Array, cutoff: float, known: Array) -> Array:
    """Offsets as smooth as the motion of a strip, at its ends as ``known``; what does not fit in counts little."""
    offset, score = offset.copy(), score.copy()
    offset[[0, -1]], score[[0, -1]] = known, 1.0
    good = score >= GOOD
    index = np.arange(len(offset))
    offset = np.where(good, offset, np.interp(index, index[good], offset[good]))
    weights = base = np.where(good, score, 0.05)
    for _ in range(3):
        smooth = smoothed_values(offset[:, None], weights, cutoff)[:, 0]
        weights = base / (1.0 + ((offset - smooth) / 2.0) ** 2)
    return smooth


def _one_edge(edges: Edges, width: Array, good: Mask, cutoff: float) -> Array:
    """Offsets, where the band merges with something by the edge that fits its neighbours."""
    merged = good & (edges.width > MERGED * width)
    clean = good & ~merged
    if not merged.any() or clean.sum() < 0.3 * len(clean):
        return edges.offset
    expected = smoothed_values(edges.offset[:, None], clean.astype(np.float64), 2.0 * cutoff)[:, 0]
    slack = 0.5 * (edges.width - width)
    lower, upper = edges.offset - slack, edges.offset + slack
    own = np.where(np.abs(lower - expected) < np.abs(upper - expected), lower, upper)
    return np.where(merged, own, edges.offset)


def _longest(hidden: Mask) -> int:
    """The longest run."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hidden.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max()) if len(edges) else 0


def between(curve: Array, ends: Array, count: int) -> tuple[Array, Array]:
    """Equally spaced points of a curve from one end to the other, and where on it each is, by its own lengths.

    The curve is extended straight where it does not reach so far.
    """
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    length = float(arc[-1])
    along = np.stack([curve[2] - curve[0], curve[-1] - curve[-3]])
    along /= np.maximum(np.hypot(*along.T), 1e-9)[:, None]
    first = min(float(np.dot(ends[0] - curve[0], along[0])), 0.5 * length)
    last = max(length + float(np.dot(ends[1] - curve[-1], along[1])), 0.5 * length)
    if first < 0.0:
        curve, arc = np.concatenate([[curve[0] + first * along[0]], curve]), np.concatenate([[first], arc])
    if last > length:
        curve, arc = np.concatenate([curve, [curve[-1] + (last - length) * along[1]]]), np.append(arc, last)
    s = np.linspace(first, last, count)
    return interpolated(curve, arc, s), s


def _evened(values: Array) -> Array:
    """The values along the strip without their noise."""
    return smoothed_values(values[:, None], np.ones(len(values)), 5.0)[:, 0]

"""The centreline of a strip in a picture about which nothing is known.

From a rough path (:mod:`stripfold.film.segmentation`), the strip's two edges are measured on cross sections, and
their centres smoothed along the arc with a cut-off that follows from the strip's width.  A point's uncertainty comes
from how far the centres scatter about the smoothed curve, and how far neighbours scatter together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter

from stripfold.base.arrays import Array, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.film.cross_sections import (
    GOOD,
    WIDEST,
    Edges,
    arc_length,
    cutoff_of,
    edges_at,
    end_direction,
    inside,
    layer_distance,
    locate,
    normals,
    on_own_layer,
    resampled,
    respaced,
    rounded,
    sample,
    score_of,
    smooth_centres,
    smooth_offsets,
    strip_offset,
    tangents,
)
from stripfold.film.segmentation import RoughPath, candidates, smooth_path
from stripfold.film.smoothing import variances

MIN_MEASURED = 0.5
"""Least share of the sections that must be measured."""
WIDTH_TOLERANCE = 0.7
"""Standard deviation of the logarithm of the width in the score of a section."""
GAP_WEIGHT = 0.003
"""Weight of the expected place of a hidden section, relative to a measured one."""
GAP_SLOPE = 0.03
"""Uncertainty of a hidden section over its distance from the nearest measured one."""
MIN_SD = 0.01
"""Least uncertainty of a point, pixels."""
HOLDER = 4
"""Least number of sections along what holds a strip's end, about half a width apart."""
REACH, MIN_REACH = 1.0, 8.0
"""How far from a rough path a strip is looked for, in widths, and at least, pixels: but for its gaps the path is in the
strip, and farther away may be another layer."""


@dataclass(frozen=True, eq=False)
class Centreline:
    """A strip's centreline in a picture, from the gripper's end along the strip.

    ``points``, shape (n, 2), pixels, are equally spaced.  At each, shape (n,): ``sd`` normal to the curve, pixels (nan
    in a film, where nothing depends on it); ``width``, pixels, and ``contrast``, grey levels, of the visible band;
    ``score``, from 0 (hidden) to 1 (as clear as the strip typically is).  ``bright``: whether the strip is brighter
    than its surroundings; ``open_ends``: whether it leaves the picture at its first and at its last point.
    """

    points: Array
    sd: Array
    width: Array
    contrast: Array
    score: Array
    bright: bool
    open_ends: tuple[bool, bool] = (False, False)

    @property
    def arc(self) -> Array:
        """Arc length at the points, shape (n,), pixels."""
        return arc_length(self.points)

    @property
    def length(self) -> float:
        """Visible length, pixels."""
        return float(self.arc[-1])

    def reversed(self) -> Centreline:
        """The same, from the other end."""
        flipped = {name: getattr(self, name)[::-1] for name in ("points", "sd", "width", "contrast", "score")}
        return replace(self, **flipped, open_ends=self.open_ends[::-1])

    def between(self, first: float, last: float) -> Centreline:
        """The part between two arc lengths, in as many points; extended straight where it does not reach so far."""
        points, s = respaced(self.points, first, last, len(self.points))
        values = {name: np.interp(s, self.arc, getattr(self, name)) for name in ("sd", "width", "contrast", "score")}
        return replace(self, points=points, **values)


class _Band(NamedTuple):
    """Typical appearance of a strip.

    Widths at each section, pixels; how many sections are ``beyond`` each end; whether it is ``bright``; contrast, grey
    levels.
    """

    widths: Array
    beyond: int
    bright: bool
    contrast: float

    @property
    def width(self) -> float:
        """Typical width, pixels."""
        return float(np.median(self.widths))

    def score(self, edges: Edges) -> Array:
        """Of each section; 0 beyond an end of the strip, where something else may look like it."""
        score = score_of(edges, self.widths, self.contrast, WIDTH_TOLERANCE)
        for outwards in (score[: self.beyond][::-1], score[-self.beyond :]):
            outwards *= np.logical_and.accumulate(outwards >= GOOD)
        return score


def find(image: Picture, start: ArrayLike | None = None, *, points: int = 80, source: str = "picture") -> Centreline:
    """The longest and clearest strip in a picture, grey values of shape (h, w).

    ``start`` is the pixel of the gripper's end: the line leads away from it, to the side on which more of the strip
    is.  Without it the line starts at the strip's end further left.  ``points`` is their number, ``source`` the
    picture's name for errors.

    Raises
    ------
    TrackingError
        No strip.
    """
    rough = _best_candidate(image, None if start is None else np.asarray(start, dtype=np.float64), source)
    path, widths = smooth_path(rough)
    contrast = rough.contrast
    # The skeleton of a rough mask is a few pixels off: measured twice, the second time from a smooth curve.
    for reach in (True, True, False):
        # Where layers are seen as one the band is wider than anywhere else.
        widths = np.minimum(widths, WIDEST * np.median(widths))
        curve, widths, beyond = _sections(path, widths)
        band = _Band(rounded(widths), beyond, rough.bright, contrast)
        line = _measured(image, _located(image, curve, band, source) if reach else curve, band, points, source)
        # Without the corners of the ends.
        path, widths = line.points, median_filter(line.width, max(points // 9, 3))
        contrast = float(line.contrast[0])
    return line if start is None else _starting_at(line, np.asarray(start, dtype=np.float64))


def _best_candidate(image: Picture, start: Array | None, source: str) -> RoughPath:
    best: tuple[float, RoughPath | None] = (0.0, None)
    for rough in candidates(image):
        worth = 1.0
        if start is not None:
            away = np.hypot(*(rough.points - start).T)
            nearest = int(np.argmin(away))
            tail, head = rough.points[nearest:], rough.points[: nearest + 1][::-1]
            kept = slice(nearest, None) if len(tail) >= len(head) else slice(nearest, None, -1)
            rough = replace(rough, points=rough.points[kept], widths=rough.widths[kept])
            worth /= 1.0 + (away[nearest] / (4.0 * rough.width + 20.0)) ** 2
        elif rough.points[0, 0] > rough.points[-1, 0]:
            rough = rough.reversed()
        worth *= rough.length * min(rough.contrast, 100.0)
        if worth > best[0]:
            best = (worth, rough)
    if best[1] is None or best[1].length < 20.0:
        needed = "a strip much brighter or darker than what is around it"
        raise TrackingError(source, "no strip was found", needed, "light the strip, or put a plain cloth behind it")
    return best[1]


def _sections(points: Array, widths: Array) -> tuple[Array, Array, int]:
    """Equally spaced points for sections, shape (n, 2), widths there, and how many are beyond each end of the curve."""
    arc, width = arc_length(points), float(np.median(widths))
    inner = max(int(arc[-1] / np.clip(0.5 * width, 3.0, 8.0)), 12)
    curve, s = respaced(points, 0.0, arc[-1], inner + 1)
    beyond = max(int(np.ceil(_margin(width) / s[1])), 2)
    more = s[1] * np.arange(1, beyond + 1)[:, None]
    before = curve[0] + more[::-1] * end_direction(curve[::-1])
    curve = np.concatenate([before, curve, curve[-1] + more * end_direction(curve)])
    return curve, np.pad(np.interp(s, arc, widths), beyond, mode="edge"), beyond


def _margin(width: float) -> float:
    """How far beyond its last known end a strip is looked for, pixels."""
    return max(3.0 * width, 12.0)


def _spacing(curve: Array) -> float:
    return float(np.hypot(*(curve[len(curve) // 2 + 1] - curve[len(curve) // 2])))


def _lost(source: str, share: float) -> TrackingError:
    found = f"the strip was found along {share:.0%} of where it was looked for"
    advice = "it may be hidden, blurred, or have moved too far between two pictures"
    return TrackingError(source, found, f"at least {MIN_MEASURED:.0%}", advice)


def _located(image: Picture, curve: Array, band: _Band, source: str) -> Array:
    """The curve moved to where the strip roughly is, at most :data:`REACH` away."""
    h = _spacing(curve)
    cutoff = cutoff_of(band.width, h * len(curve)) / h
    reach = max(REACH * band.width, MIN_REACH)
    across = normals(curve)
    offset = locate(image, curve, across, band.widths, reach, band.bright, max(round(band.width / h), 2))
    there = curve + offset[:, None] * across
    score = band.score(edges_at(image, there, across, band.widths, band.bright)) * inside(curve, image.shape)
    score *= on_own_layer(there, curve, layer_distance(band.width, reach, h))
    good = score >= GOOD
    if good.sum() < 6:
        raise _lost(source, float(good.mean()))
    return np.asarray(curve + smooth_offsets(offset, score, 2.0 * cutoff)[:, None] * across)


def _measured(image: Picture, curve: Array, band: _Band, points: int, source: str) -> Centreline:
    """Measure, trim the ends, smooth, and space equally."""
    h = _spacing(curve)
    cutoff = cutoff_of(band.width, h * len(curve)) / h
    across = normals(curve)
    edges = edges_at(image, curve, across, band.widths, band.bright)
    score = np.where(inside(curve, image.shape), band.score(edges), 0.0)
    good = score >= GOOD
    pairs = np.flatnonzero(good[1:] & good[:-1])
    if pairs.size == 0:
        raise _lost(source, float(good.mean()))
    # From the first to the last measured section that has a measured neighbour.
    keep = slice(int(pairs[0]), int(pairs[-1]) + 2)
    curve, across, score, good = curve[keep], across[keep], score[keep], good[keep]
    widths = band.widths[keep]
    edges = Edges._make(values[keep] for values in edges)
    if good.mean() < MIN_MEASURED:
        raise _lost(source, float(good.mean()))
    offset, merged = strip_offset(edges, widths, good, cutoff)
    score = np.where(merged, np.maximum(0.5 * score, GOOD), score)
    # A hidden section is roughly where it was expected.
    centres = curve + np.where(good, offset, 0.0)[:, None] * across
    smooth, weights = smooth_centres(centres, edges.noise, score, across, cutoff, GAP_WEIGHT)
    away = np.einsum("ij,ij->i", centres - smooth, across)
    sd = _uncertainty(away, weights, good, cutoff, h)

    first, last = -_tip(image, smooth[::-1], band, h), arc_length(smooth)[-1] + _tip(image, smooth, band, h)
    even, s = respaced(smooth, first, last, points)
    arc = arc_length(smooth)
    # What reaches the border wider than the strip is what holds its end; hairs are shorter.
    held = [merged[:HOLDER].all(), merged[-HOLDER:].all()]
    at_border = ~inside(even[[0, -1]], image.shape, 1.0) & ~np.array(held)
    return Centreline(
        points=even,
        sd=np.interp(s, arc, sd),
        width=np.interp(s, arc[good], np.where(merged, widths, edges.width)[good]),
        contrast=np.full(points, np.median(edges.contrast[good])),
        score=np.interp(s, arc, score),
        bright=band.bright,
        open_ends=(bool(at_border[0]), bool(at_border[1])),
    )


def _uncertainty(away: Array, weights: Array, good: Mask, cutoff: float, h: float) -> Array:
    """Standard deviation of smoothed centres, shape (n,), pixels, from how far the centres are ``away`` from them.

    Neighbours that scatter together raise it.  ``h`` is the spacing, pixels, ``cutoff`` in spacings.
    """
    variance = variances(weights, cutoff)
    own = weights[good]
    freedom = max(float(len(own) - own @ variance[good]), 1.0)
    sigma2 = float(own @ away[good] ** 2) / freedom * len(own) / float(own.sum())
    scaled = away * np.sqrt(weights)
    pairs = good[1:] & good[:-1]
    power = float(np.mean(scaled[good] ** 2))
    rho = 0.0
    if pairs.sum() >= 8 and power > 0.0:
        rho = float(np.clip(np.mean(scaled[1:][pairs] * scaled[:-1][pairs]) / power, 0.0, 0.8))
    sd = np.sqrt(sigma2 * variance * (1.0 + rho) / (1.0 - rho))
    index = np.arange(len(good))
    hidden = np.abs(index[:, None] - index[good]).min(axis=1)
    return np.asarray(np.sqrt(sd**2 + MIN_SD**2 + (GAP_SLOPE * hidden * h) ** 2))


def _tip(image: Picture, curve: Array, band: _Band, h: float) -> float:
    """How far beyond the last point of ``curve`` the strip ends, pixels.

    The end is where the mean over half of the width falls to half of the contrast, or the picture's border.
    """
    back = round(3.0 * h)
    t = np.arange(-back, round(_margin(band.width)) + 1, dtype=np.float64)
    away = end_direction(curve)
    line = curve[-1] + t[:, None] * away
    across = np.broadcast_to([-away[1], away[0]], line.shape)
    values = sample(image, line, across, int(0.25 * band.width), band.bright).mean(axis=1)
    seen = inside(line, image.shape)
    level = float(np.median(values[: max(back // 2, 1)])) - 0.5 * band.contrast
    i = int(np.argmax((values < level) | ~seen))
    if i == 0:
        return 0.0
    if not seen[i]:
        return float(t[i - 1])
    part = (values[i - 1] - level) / max(float(values[i - 1] - values[i]), 1e-3)
    return float(t[i - 1] + np.clip(part, 0.0, 1.0))


def _starting_at(line: Centreline, start: Array) -> Centreline:
    """The line from its point next to ``start``."""
    fine = np.linspace(0.0, 0.9 * line.length, 8 * len(line.points))
    places = resampled(line.points, fine)
    near = int(np.argmin(np.hypot(*(places - start).T)))
    first = fine[near] + float((start - places[near]) @ tangents(places)[near])
    return line.between(max(first, 0.0), line.length)

"""The measurement of a strip's centreline next to a curve that is nearly it: what finding and refining end in.

Sections across the strip, its two edges on each at half contrast, and a smoothing of the centres along the arc with a
cut-off that follows from the strip's width.  The uncertainty of a point comes from how far the centres scatter about
the smoothed curve, and how far neighbours scatter together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array, Mask, Picture
from stripfold.errors import TrackingError
from stripfold.vision.sections import (
    Edges,
    edges_at,
    inside,
    interpolated,
    locate,
    measure,
    normals,
    sample,
    sight,
    tangents,
)
from stripfold.vision.smooth import median, smoothed_values, variances

GOOD = 0.4
"""Score from which a section counts as measured."""
LOST = 0.5
"""Share of the sections that must be measured."""
MOVED = "it may be hidden, blurred, or have moved too far between two pictures"
MERGED = 1.3
"""Width, in the strip's typical ones, from which a band is the strip and something else."""
HIDDEN = 0.003
"""Weight of where a hidden part of the strip was expected, in that of a measured section."""
ASTRAY = 0.03
"""How far a hidden part may be off, in its distance from what was measured."""
BEND = 0.1
"""Largest distance that smoothing takes a curve off its bends, pixels."""
FLOOR = 0.01
"""Least uncertainty of a point, pixels: the picture's own grid."""
EXTENSION = 3.0
"""How far beyond its last known end a strip is looked for, in its widths; at least 12 pixels."""


@dataclass(frozen=True, eq=False)
class Centreline:
    """A strip's centreline in a picture, from the gripper's end along the strip.

    Parameters
    ----------
    points
        Shape (n, 2), pixels, equally spaced along the arc.
    sd
        Shape (n,), one standard deviation normal to the curve, pixels; nan in a film, where nothing depends on it.
    width
        Shape (n,), of the visible band, pixels.
    score
        Shape (n,), from 0 (hidden) to 1 (as clear as the strip typically is).
    bright
        Whether the strip is brighter than what is around it.
    contrast
        Its typical difference to that, grey levels.
    open_ends
        Whether the strip leaves the picture at its first and at its last point.
    """

    points: Array
    sd: Array
    width: Array
    score: Array
    bright: bool
    contrast: float
    open_ends: tuple[bool, bool] = (False, False)

    @property
    def arc(self) -> Array:
        """Arc length at the points, shape (n,), pixels."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Visible length, pixels."""
        return float(self.arc[-1])

    def reversed(self) -> Centreline:
        """The same, from the other end."""
        flipped = {name: getattr(self, name)[::-1] for name in ("points", "sd", "width", "score")}
        return replace(self, **flipped, open_ends=self.open_ends[::-1])


class Band(NamedTuple):
    """What is known of a strip before it is measured."""

    width: float
    bright: bool
    contrast: float


def default_reach(band: Band) -> int:
    return int(np.ceil(max(4.0 * band.width, 16.0)))


def _spacing(band: Band) -> float:
    """Distance of the sections, pixels."""
    return float(np.clip(0.5 * band.width, 3.0, 8.0))


def _cutoff(band: Band) -> float:
    """Wave length that smoothing halves, pixels: hairs and weave are shorter, bends of a strip longer."""
    return max(3.0 * band.width, 24.0)


def sections_of(points: Array, band: Band) -> Array:
    """Points for sections, equally spaced along the curve and some beyond its ends; shape (n, 2)."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    inner = max(int(arc[-1] / _spacing(band)), 12)
    h = arc[-1] / inner
    curve = interpolated(points, arc, h * np.arange(inner + 1))
    more = max(int(np.ceil(max(EXTENSION * band.width, 12.0) / h)), 2)
    beyond = np.arange(1, more + 1)[:, None]
    before = curve[0] + h * beyond[::-1] * _end(curve[::-1])
    after = curve[-1] + h * beyond * _end(curve)
    return np.concatenate([before, curve, after])


def measured(image: Picture, curve: Array, band: Band, reach: int, points: int, source: str) -> Centreline:
    """Locate (unless ``reach`` is 0), measure, smooth, trim the ends, and space equally."""
    h = float(np.hypot(*(curve[len(curve) // 2 + 1] - curve[len(curve) // 2])))
    # Where it moved by more than its width, the normals were not its own: looked for again from where it seems to be.
    while reach:
        across = normals(tangents(curve))
        profiles = sample(image, curve, across, reach, band.bright)
        offset = locate(profiles, band.width, max(round(band.width / h), 2))
        score = _score(measure(_shifted(profiles, offset, band), band.width), band) * inside(curve, image.shape)
        curve = _settled(curve, across, offset, score, 2.0 * _cutoff(band) / h, source)
        moved = float(np.quantile(np.abs(offset[score >= GOOD]), 0.9)) if np.any(score >= GOOD) else 0.0
        reach = reach // 2 if moved > band.width else 0
    across = normals(tangents(curve))
    edges = edges_at(image, curve, across, band.width, band.bright)
    score = np.where(inside(curve, image.shape), _score(edges, band), 0.0)
    first, last = _ends(score, source)
    keep = slice(first, last + 1)
    curve, across, score = curve[keep], across[keep], score[keep]
    edges = Edges._make(values[keep] for values in edges)
    share = float(np.mean(score >= GOOD))
    if share < LOST:
        _lost(source, share)
    edges, score = _parted(edges, score, band, _cutoff(band) / h)
    # Where nothing was measured the strip is roughly where it was, moved as its neighbours were.
    centres = curve + np.where(score >= GOOD, edges.offset, 0.0)[:, None] * across
    smoothed, weights = smoothed_centres(centres, edges, score, across, _cutoff(band) / h, HIDDEN)
    sd = uncertainty(centres, smoothed, weights, score >= GOOD, across, _cutoff(band) / h, h)
    return _equally(image, smoothed, sd, edges, score, band, points, h)


def _shifted(profiles: NDArray[np.float32], offset: Array, band: Band) -> NDArray[np.float32]:
    """The middle parts of sections, moved so that the band is in their middle; shape (n, m)."""
    half, reach = int(sight(band.width)), profiles.shape[1] // 2
    columns = reach + offset.astype(int)[:, None] + np.arange(-half, half + 1)
    return np.take_along_axis(profiles, np.clip(columns, 0, profiles.shape[1] - 1), axis=1)


def _settled(curve: Array, across: Array, offset: Array, score: Array, cutoff: float, source: str) -> Array:
    """The curve moved by the offsets, those that do not fit their neighbours left out."""
    if np.sum(score >= GOOD) < 6:
        _lost(source, float(np.mean(score >= GOOD)))
    good = score >= GOOD
    # A hidden part moved as what is next to it.
    index = np.arange(len(offset))
    offset = np.where(good, offset, np.interp(index, index[good], offset[good]))
    weights = base = np.where(good, score, 0.05)
    for _ in range(3):
        smoothed = smoothed_values(offset[:, None], weights, cutoff)[:, 0]
        weights = base / (1.0 + ((offset - smoothed) / 2.0) ** 2)
    return np.asarray(curve + smoothed[:, None] * across)


def _score(edges: Edges, band: Band) -> Array:
    """How much each section looks like the strip: clear, and as wide as it is."""
    clear = np.clip(edges.contrast / (0.7 * band.contrast), 0.0, 1.0)
    wider = np.log(np.maximum(edges.width, 0.1) / band.width) / 0.7
    return np.asarray(np.where(edges.found, clear * np.exp(-0.5 * wider**2), 0.0))


def _ends(score: Array, source: str) -> tuple[int, int]:
    """First and last of the sections that are measured and have a measured neighbour."""
    good = score >= GOOD
    pairs = np.flatnonzero(good[1:] & good[:-1])
    if pairs.size == 0:
        _lost(source, float(good.mean()))
    return int(pairs[0]), int(pairs[-1]) + 1


def _lost(source: str, share: float) -> None:
    found = f"the strip was found along {100.0 * share:.0f} % of where it was looked for"
    raise TrackingError(source, found, f"at least {100.0 * LOST:.0f} %", MOVED)


def _parted(edges: Edges, score: Array, band: Band, cutoff: float) -> tuple[Edges, Array]:
    """Sections on which the strip merges with another part of itself, or with a hair: one edge is the strip's own.

    Which one says the smooth curve through the other sections; half a width from it is the centre.
    """
    merged = (edges.width > MERGED * band.width) & (score >= GOOD)
    clean = np.where((score >= GOOD) & ~merged, 1.0, 0.0)
    if not merged.any() or clean.sum() < 0.3 * len(clean):
        return edges, score
    expected = smoothed_values(edges.offset[:, None], clean, 2.0 * cutoff)[:, 0]
    slack = 0.5 * (edges.width - band.width)
    lower, upper = edges.offset - slack, edges.offset + slack
    own = np.where(np.abs(lower - expected) < np.abs(upper - expected), lower, upper)
    offset = np.where(merged, own, edges.offset)
    return edges._replace(offset=offset), np.where(merged, np.maximum(0.5 * score, GOOD), score)


def smoothed_centres(
    centres: Array, edges: Edges, score: Array, across: Array, cutoff: float, expected: float
) -> tuple[Array, Array]:
    """Smoothed centres, shape (n, 2), and the weights it took for that, shape (n,).

    ``cutoff`` in spacings; ``expected`` is the weight of a centre that was not measured.
    """
    good = score >= GOOD
    typical = median(edges.noise[good])
    spread = np.clip(edges.noise / typical, 0.5, 3.0)
    base = np.where(good, score / spread**2, 0.0)
    base /= base[good].mean()
    base[~good] = expected
    weights = base
    for _ in range(3):
        values = smoothed_values(centres, weights, cutoff)
        away = np.einsum("ij,ij->i", centres - values, across)
        scaled = np.where(good, away * np.sqrt(base), 0.0)
        # Hairs pull an edge outwards: what is far off counts less (Cauchy's weights).  What the smoothing itself
        # takes off a tight bend is no outlier.
        sigma = max(1.4826 * median(np.abs(scaled[good])), BEND)
        weights = base / (1.0 + (scaled / (2.4 * sigma)) ** 2)
    return smoothed_values(centres, weights, cutoff), weights


def uncertainty(
    centres: Array, values: Array, weights: Array, good: Mask, across: Array, cutoff: float, h: float
) -> Array:
    """Standard deviation of smoothed centres, shape (n,), pixels, from how they scatter; see :func:`smoothed_centres`.

    ``h`` is the spacing, pixels.
    """
    variance = variances(weights, cutoff)
    away = np.einsum("ij,ij->i", centres - values, across)
    own = weights[good]
    freedom = max(float(len(own) - np.sum(own * variance[good])), 1.0)
    sigma2 = float(own @ away[good] ** 2) / freedom * len(own) / float(own.sum())
    sd = np.sqrt(sigma2 * variance * _inflation(away * np.sqrt(weights), good))
    index = np.arange(len(good))
    hidden = np.abs(index[:, None] - index[good]).min(axis=1) if not good.all() else np.zeros(len(good))
    return np.asarray(np.hypot(np.hypot(sd, FLOOR), ASTRAY * hidden * h))


def _inflation(away: Array, good: Mask) -> float:
    """By how much neighbours that scatter together raise the variance of a mean."""
    pairs = good[1:] & good[:-1]
    power = float(np.mean(away[good] ** 2))
    if pairs.sum() < 8 or power == 0.0:
        return 1.0
    rho = float(np.clip(np.mean(away[1:][pairs] * away[:-1][pairs]) / power, 0.0, 0.8))
    return (1.0 + rho) / (1.0 - rho)


def _equally(
    image: Picture, curve: Array, sd: Array, edges: Edges, score: Array, band: Band, points: int, h: float
) -> Centreline:
    """Up to the strip's ends along the arc, in equal distances."""
    good = score >= GOOD
    beyond = [_tip(image, piece, band, h) for piece in (curve[::-1], curve)]
    outer = [curve[0] + _end(curve[::-1]) * beyond[0], curve[-1] + _end(curve) * beyond[1]]
    whole = [curve]
    if beyond[0] > 0.0:
        whole.insert(0, outer[0][None])
    if beyond[1] > 0.0:
        whole.append(outer[1][None])
    places = np.concatenate(whole)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    own = arc[int(beyond[0] > 0.0) :][: len(curve)]
    s = np.linspace(max(-beyond[0], 0.0), arc[-1] + min(beyond[1], 0.0), points)
    shown = interpolated(places, arc, s)
    borders = 0.5 * band.width + 1.0
    first, last = (not bool(value) for value in inside(shown[[0, -1]], image.shape, borders))
    return Centreline(
        points=shown,
        sd=np.interp(s, own, sd),
        width=np.interp(s, own[good], edges.width[good]),
        score=np.interp(s, own, score),
        bright=band.bright,
        contrast=float(np.median(edges.contrast[good])),
        open_ends=(first, last),
    )


def _end(curve: Array) -> Array:
    """Direction in which a curve ends: of a piece longer than the scatter of its points."""
    way = curve[-1] - curve[-1 - min(3, len(curve) - 1)]
    return np.asarray(way / max(float(np.hypot(*way)), 1e-9))


def _tip(image: Picture, curve: Array, band: Band, h: float) -> float:
    """How far beyond the last point of ``curve`` the strip ends, pixels.

    The end is where the mean over half of the width falls to half of the contrast, or the picture's border.
    """
    back, out = round(3.0 * h), round(max(EXTENSION * band.width, 12.0))
    t = np.arange(-back, out + 1, dtype=np.float64)
    away = _end(curve)
    line = curve[-1] + t[:, None] * away
    across = np.broadcast_to([-away[1], away[0]], line.shape)
    values = sample(image, line, across, int(0.25 * band.width), band.bright).mean(axis=1)
    seen = inside(line, image.shape)
    inner = float(np.median(values[: max(back // 2, 1)]))
    level = inner - 0.5 * band.contrast
    low = np.flatnonzero((values < level) | ~seen)
    if low.size == 0 or low[0] == 0:
        return 0.0
    i = int(low[0])
    if not seen[i]:
        return float(t[i - 1])
    part = (values[i - 1] - level) / max(float(values[i - 1] - values[i]), 1e-3)
    return float(t[i - 1] + np.clip(part, 0.0, 1.0))

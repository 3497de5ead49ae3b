"""The centreline of a strip in a picture, from its two edges on cross sections.

In a picture about which nothing is known (:func:`find`) a rough path (:mod:`stripfold.film.segmentation`) is measured,
and the centres are smoothed along the arc with a cut-off that follows from the strip's width.  A point's uncertainty
comes from how far the centres scatter about the smoothed curve, and how far neighbours scatter together.

In a film (:func:`follow`) the line is a material curve: it begins where the gripper holds the strip and ends on the
lying part, at a place that does not move, so its length does not change.  Its width and contrast are known at each
point, because a strip that is seen obliquely is three times as wide where it lies as where it hangs.  A section that
does not look like that, or is nearer to another layer, counts as hidden: there the line moves as its neighbours do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter

from stripfold.base.arrays import Array, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.film import line_kernels
from stripfold.film.line_kernels import GOOD, arc_length, inside, normals, resampled, tangents
from stripfold.film.segmentation import RoughPath, candidates, cutoff_of, smooth_path

LAYER_DISTANCE = 5.0
"""Distance along the strip, in widths, from which another part of it is another layer."""
WIDEST = 1.3
"""Largest width of a strip along it, relative to the usual one."""
WIDTH_STEP = 0.25
"""Widths are rounded to steps of this logarithm: sections of one width are processed together."""
DECAY = 0.7
"""Decay of the search for a band next to where it is expected, as a share of its reach."""
MIN_MEASURED = 0.5
"""Least share of the sections (in a film of those in view) that must be measured."""
SLANTED = 0.92
"""Width of a section over the median of those before it, a width long, from which it is one of the strip."""
STRAIGHT_WORTH = 1e-3
"""Factor on the worth of what is straight where a strip hangs, as a ruler or the edge of the table."""
ROUGH_TOLERANCE = 0.7
"""Standard deviation of the logarithm of the width in the score of a section of an unknown strip."""
PASSES, FACE_TOLERANCE = 6, 0.3
"""Most passes with, and that deviation for, a strip whose face may be seen, wide and of another tone than its edge."""
ROUGH_GAP_WEIGHT = 0.003
"""Weight of the expected place of a hidden section, relative to a measured one, of an unknown strip."""
GAP_SLOPE = 0.03
"""Uncertainty of a hidden section over its distance from the nearest measured one."""
MIN_SD = 0.01
"""Least uncertainty of a point, pixels."""
HOLDER = 4
"""Least number of sections along what holds a strip's end, about half a width apart."""
REACH, MIN_REACH = 1.0, 8.0
"""How far from a rough path a strip is looked for, in widths, and at least, pixels: farther may be another layer."""
SHARPER = 2.0 / 3.0
"""Cut-off of the smoothing in a film relative to that in a picture: a bend that it takes off adds up over frames."""
MAX_HIDDEN = 0.25
"""Longest hidden part of a line that is followed, as a share of it."""


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
    """Typical appearance of a strip: widths at each section, how many are ``beyond`` each end, contrast, and the
    ``tolerance`` of the widths, of their logarithm.
    """

    widths: Array
    beyond: int
    bright: bool
    contrast: float
    tolerance: float

    @property
    def width(self) -> float:
        """Typical width, pixels."""
        return float(np.median(self.widths))

    def score(self, edges: Edges) -> Array:
        """Of each section; 0 beyond an end of the strip, where something else may look like it."""
        contrast = np.full(len(self.widths), self.contrast)
        score: Array = line_kernels.score(
            edges.width, edges.contrast, edges.found, self.widths, contrast, self.tolerance
        )
        for outwards in (score[: self.beyond][::-1], score[-self.beyond :]):
            outwards *= np.logical_and.accumulate(outwards >= GOOD)
        return score


def end_direction(points: Array) -> Array:
    """Compute the unit vector, shape (2,), in which a curve ends, over a few points since each scatters."""
    step = points[-1] - points[-1 - min(3, len(points) - 1)]
    return np.asarray(step / max(float(np.hypot(*step)), 1e-9))


def respaced(points: Array, first: float, last: float, count: int) -> tuple[Array, Array]:
    """Space ``count`` points of a curve, extended straight, between two arc lengths; return them and these."""
    s = np.linspace(first, last, count)
    beyond = last - arc_length(points)[-1]
    if beyond > 0.0:
        points = np.concatenate([points, [points[-1] + beyond * end_direction(points)]])
    if first < 0.0:
        points = np.concatenate([[points[0] - first * end_direction(points[::-1])], points])
    return resampled(points, s - min(first, 0.0)), s


def rounded(width: Array) -> Array:
    """Round widths to whole pixels, of few distinct values."""
    steps = np.exp(WIDTH_STEP * np.rint(np.log(np.maximum(width, 1.0)) / WIDTH_STEP))
    return np.maximum(np.rint(steps), 1.0)


def layer_distance(width: float, reach: float, h: float) -> int:
    """Count the spacings ``h`` along a strip from which on another layer is met, in a search as far as ``reach``."""
    return int((LAYER_DISTANCE * width + 2.0 * reach) / h)


def locate(image: Picture, points: Array, across: Array, width: Array, reach: float, bright: bool, along: int) -> Array:
    """Find roughly where a band is on each section, shape (n,): whole pixels from the middle, at most ``reach``.

    The response to a template (the band minus what is beside it) is smoothed over ``along`` neighbours and decays
    from the middle: another part of the strip close by may be as clear, but only the strip itself is near everywhere.
    """
    limit = int(np.ceil(reach))
    half = limit + int(np.ceil(width.max())) + 1
    profiles = line_kernels.sampled(image, points, across, np.full(len(points), half), bright)
    response = line_kernels.responses(profiles, width)
    response = cv2.GaussianBlur(response, (1, 2 * along + 1), 0.0, sigmaY=max(along / 2.0, 0.5))
    t = np.arange(-half, half + 1)
    near = np.exp(-0.5 * (t / max(DECAY * reach, 1.0)) ** 2) * (np.abs(t) <= limit)
    return np.asarray(t[np.argmax((np.maximum(response, 0.0) + 1e-6) * near, axis=1)], dtype=np.float64)


def edges_at(image: Picture, points: Array, across: Array, width: Array | float, bright: bool) -> Edges:
    """Measure the edges of a band of about this ``width`` on sections through ``points``; see :func:`.bands`."""
    width = np.full(len(points), width, dtype=np.float64)
    *values, found = line_kernels.bands(image, points, across, width, bright, np.zeros(len(width)))
    return Edges._make([*values, found > 0.0])


def find(
    image: Picture,
    start: ArrayLike | None = None,
    *,
    points: int = 80,
    source: str = "picture",
    sag: float = 0.0,
    face: bool = False,
) -> Centreline:
    """Find the longest and clearest strip in a picture, grey values of shape (h, w), in so many ``points``.

    ``sag``: least one of a strip that hangs, over its length: what is straighter is found only where nothing else is.
    ``face``: whether the face of one that hangs may be seen, which has no layers: all of its width is its own.
    ``start`` is the pixel of the gripper's end: the line leads away from it, to the side on which more of the strip
    is; without it from the end further left.  Raises TrackingError, which names the ``source``: no strip.
    """
    image = np.ascontiguousarray(image)
    rough = _best_candidate(image, None if start is None else np.asarray(start, dtype=np.float64), source, sag, face)
    path, widths = smooth_path(rough)
    contrast = rough.contrast
    # The skeleton of a rough mask is a few pixels off: measured twice, the second time from a smooth curve.
    # A wide strip that hangs ends far beyond its skeleton.
    for reach in (True, True, *(False,) * (PASSES if face else 1)):
        # Where layers are seen as one the band is wider than anywhere else.
        widths = widths if face else np.minimum(widths, WIDEST * np.median(widths))
        curve, widths, beyond = _sections(path, widths)
        band = _Band(rounded(widths), beyond, rough.bright, contrast, FACE_TOLERANCE if face else ROUGH_TOLERANCE)
        curve = _located(image, curve, band, source) if reach else curve
        line, before = _measured(image, curve, band, points, source, face), path
        # Without the corners of the ends.
        path, widths = line.points, median_filter(line.width, max(points // 9, 3))
        contrast = float(line.contrast[0])
        if not reach and np.abs(before[[0, -1]] - path[[0, -1]]).max() < 1.0:
            break
    return line if start is None else _starting_at(line, np.asarray(start, dtype=np.float64))


def _best_candidate(image: Picture, start: Array | None, source: str, sag: float, face: bool) -> RoughPath:
    best: tuple[float, RoughPath | None] = (0.0, None)
    for rough in candidates(image, face):
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
        if sag and _sag(rough) < sag * rough.length:
            worth *= STRAIGHT_WORTH
        if worth > best[0]:
            best = (worth, rough)
    if best[1] is None or best[1].length < 20.0:
        needed = "a strip much brighter or darker than what is around it"
        raise TrackingError(source, "no strip was found", needed, "light the strip, or put a plain cloth behind it")
    return best[1]


def _sag(rough: RoughPath) -> float:
    """Largest distance from the straight line through both ends, pixels: without its ends, where a skeleton bends."""
    points, _ = smooth_path(rough)
    return float(np.abs((points - points[0]) @ normals(points[[0, -1]])[0]).max())


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
    score = band.score(edges_at(image, there, across, band.widths, band.bright)) * inside(curve, image.shape, 0.0)
    score *= line_kernels.on_own_layer(there, curve, layer_distance(band.width, reach, h))
    good = score >= GOOD
    if good.sum() < 6:
        raise _lost(source, float(good.mean()))
    return np.asarray(curve + line_kernels.smooth_offsets(offset, score, 2.0 * cutoff)[:, None] * across)


def _measured(image: Picture, curve: Array, band: _Band, points: int, source: str, face: bool) -> Centreline:
    """Measure, trim the ends, smooth, and space equally; the lower end of a strip whose ``face`` is seen is slanted."""
    h = _spacing(curve)
    cutoff = cutoff_of(band.width, h * len(curve)) / h
    across = normals(curve)
    edges = edges_at(image, curve, across, band.widths, band.bright)
    score = np.where(inside(curve, image.shape, 0.0), band.score(edges), 0.0)
    good = score >= GOOD
    if face:
        _without_slant(edges.width, good, h, last=bool(curve[-1, 1] > curve[0, 1]))
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
    offset, merged = line_kernels.strip_offset(edges.offset, edges.width, widths, good, cutoff)
    score = np.where(merged, np.maximum(0.5 * score, GOOD), score)
    # A hidden section is roughly where it was expected.
    centres = curve + np.where(good, offset, 0.0)[:, None] * across
    smooth, weights = line_kernels.smooth_centres(centres, edges.noise, score, across, cutoff, ROUGH_GAP_WEIGHT)
    away = np.einsum("ij,ij->i", centres - smooth, across)
    sd = _uncertainty(away, weights, good, cutoff, h)

    first = -_tip(image, smooth[::-1], band, h, face)
    last = arc_length(smooth)[-1] + _tip(image, smooth, band, h, face)
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


def _without_slant(width: Array, good: Mask, h: float, last: bool) -> None:
    """Leave out the sections on which a slanted end narrows a band: their middles lead to its corner."""
    index = np.flatnonzero(good)
    index = index if last else index[::-1]
    found = width[index]
    before = max(int(np.median(found) / h), 3) if found.size else 0
    end = len(index)
    while end > 2 * before and found[end - 1] < SLANTED * np.median(found[end - 1 - before : end - 1]):
        end -= 1
    good[index[end:]] = False


def _uncertainty(away: Array, weights: Array, good: Mask, cutoff: float, h: float) -> Array:
    """Standard deviation of smoothed centres, shape (n,), pixels, from how far the centres are ``away`` from them.

    Neighbours that scatter together raise it.  ``h`` is the spacing, pixels, ``cutoff`` in spacings.
    """
    # The posterior variance of smoothed values, in units of that of a value of weight 1.
    inverse = np.eye(len(weights))
    line_kernels.substitute(line_kernels.factor(weights, cutoff), inverse)
    variance = np.diag(inverse)
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


def _tip(image: Picture, curve: Array, band: _Band, h: float, face: bool) -> float:
    """How far beyond the last point of ``curve`` the strip ends, pixels.

    The end is where the mean over half of the width falls to half of the contrast, or the picture's border.  Behind a
    strip whose ``face`` is seen the background may have another tone at its end: the contrast is of the largest step.
    """
    back = round(3.0 * h)
    t = np.arange(-back, round(_margin(band.width)) + 1, dtype=np.float64)
    away = end_direction(curve)
    line = curve[-1] + t[:, None] * away
    across = np.broadcast_to([-away[1], away[0]], line.shape)
    reach = np.full(len(line), int(0.25 * band.width))
    values = line_kernels.sampled(image, line, across, reach, band.bright).mean(axis=1)
    contrast, size = band.contrast, max(round(0.5 * band.width), 3)
    if face and len(values) > 2 * size:
        means = np.convolve(values, np.full(size, 1.0 / size), "valid")
        contrast = float((means[:-size] - means[size:]).max())
    seen = inside(line, image.shape, 0.0)
    level = float(np.median(values[: max(back // 2, 1)])) - 0.5 * contrast
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


class Followed(NamedTuple):
    """A line, the ``share`` of the sections in view that were measured, and the longest hidden part (``gap``)."""

    line: Centreline
    share: float
    gap: float

    @property
    def sound(self) -> bool:
        """Whether enough of it was measured."""
        return self.share >= MIN_MEASURED and self.gap <= MAX_HIDDEN


def with_appearance(image: Picture, line: Centreline) -> Centreline:
    """A line that was just found, with smooth width and contrast, which :func:`follow` compares sections with."""
    width = line_kernels.denoised(np.maximum(line.width, 1.0))
    edges = edges_at(image, line.points, normals(line.points), rounded(width), line.bright)
    clear = edges.found & (edges.contrast > 0.25 * line.contrast)
    contrast = np.where(clear, edges.contrast, line.contrast)
    return replace(line, width=width, contrast=line_kernels.denoised(np.minimum(contrast, 1.5 * line.contrast)))


def follow(image: Picture, guess: Centreline, ends: Array, reach: float) -> Followed | None:
    """The strip next to where it is expected, or None where hardly any of it is seen.

    ``guess`` says where it is expected and what it looks like, ``ends``, shape (2, 2), where its first point is, by
    the gripper's marker, and its last one; it may be up to ``reach`` from ``guess``; pixels.
    """
    arc = guess.arc
    typical = float(np.median(guess.width))
    s = np.linspace(0.0, arc[-1], max(int(arc[-1] / np.clip(0.5 * typical, 3.0, 6.0)), 24) + 1)
    h = float(s[1])
    cutoff = SHARPER * cutoff_of(typical, float(arc[-1])) / h
    width, contrast = np.interp(s, arc, guess.width), np.interp(s, arc, guess.contrast)
    sizes = rounded(width)

    curve = resampled(guess.points, s)
    offset = locate(image, curve, normals(curve), sizes, reach, guess.bright, max(round(typical / h), 2))
    layers = np.array([layer_distance(typical, reach, h), layer_distance(typical, 0.0, h)])
    score = np.empty(len(s))
    share, gap = line_kernels.follow(
        image, curve, offset, ends, width, contrast, sizes, score, guess.bright, layers, cutoff, WIDEST * typical
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

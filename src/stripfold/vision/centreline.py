"""The centreline of a strip in a picture of which nothing is known; :mod:`.following` goes on from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from stripfold.arrays import Array, Picture
from stripfold.errors import TrackingError
from stripfold.vision.mask import Rough, candidates
from stripfold.vision.measuring import Band, Centreline, default_reach, measured, sections_of
from stripfold.vision.sections import interpolated, tangents
from stripfold.vision.smooth import smoothed_values

__all__ = ["Centreline", "find"]


POINTS = 80


def find(
    image: Picture, start: ArrayLike | None = None, *, points: int = POINTS, source: str = "picture"
) -> Centreline:
    """The longest and clearest strip in a picture.

    Parameters
    ----------
    image
        Grey values, shape (h, w).
    start
        Pixel of the gripper's end: what leads away from it on one side is taken.  Without it the strip starts at its
        end further left.
    points
        How many points to return.
    source
        Name for errors.

    Raises
    ------
    TrackingError
        No strip.
    """
    best: tuple[float, Rough] | None = None
    for rough in candidates(image):
        if start is not None:
            rough = _from_start(rough, np.asarray(start, dtype=np.float64))
        worth = rough.length * min(rough.contrast, 100.0)
        if start is not None:
            away = float(np.hypot(*(rough.points[0] - np.asarray(start))))
            worth /= 1.0 + (away / (4.0 * rough.width + 20.0)) ** 2
        if best is None or worth > best[0]:
            best = (worth, rough)
    needed = "a strip much brighter or darker than what is around it"
    if best is None or best[1].length < 20.0:
        raise TrackingError(source, "no strip was found", needed, "light the strip, or put a plain cloth behind it")
    rough = best[1]
    if start is None and rough.points[0, 0] > rough.points[-1, 0]:
        rough = replace(rough, points=rough.points[::-1])
    band = Band(rough.width, rough.bright, rough.contrast)
    curve = sections_of(_thinned(rough), band)
    # The skeleton of a rough mask is a few pixels off: measured twice, the second time from a smooth curve.
    for _ in range(2):
        line = measured(image, curve, band, default_reach(band), points, source)
        band = Band(float(np.median(line.width)), band.bright, line.contrast)
        curve = sections_of(line.points, band)
    line = measured(image, curve, band, 0, points, source)
    return line if start is None else _cut(line, np.asarray(start, dtype=np.float64))


def _from_start(rough: Rough, start: Array) -> Rough:
    """The way from its point nearest to ``start``, in the direction in which more of it is left."""
    nearest = int(np.argmin(np.hypot(*(rough.points - start).T)))
    tail, head = rough.points[nearest:], rough.points[: nearest + 1][::-1]
    return replace(rough, points=tail if len(tail) >= len(head) else head)


def _thinned(rough: Rough) -> Array:
    """Smooth points along the way of a skeleton, its ends left out: there it runs into corners and frays."""
    steps = np.linalg.norm(np.diff(rough.points, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    off = min(3.0 * rough.width, 0.1 * arc[-1])
    length = float(arc[-1]) - 2.0 * off
    count = max(int(length / 2.0), 12)
    s = np.linspace(off, off + length, count)
    even = np.column_stack([np.interp(s, arc, rough.points[:, i]) for i in range(2)])
    return smoothed_values(even, np.ones(count), max(3.0 * rough.width, 20.0) / (length / (count - 1)))


def _cut(line: Centreline, start: Array) -> Centreline:
    """The line from its point next to ``start``, with as many points."""
    arc = line.arc
    fine = np.linspace(0.0, 0.9 * arc[-1], 8 * len(arc))
    places = interpolated(line.points, arc, fine)
    near = int(np.argmin(np.hypot(*(places - start).T)))
    along = tangents(places)[near]
    s = np.linspace(max(fine[near] + float(np.dot(start - places[near], along)), 0.0), arc[-1], len(arc))
    moved = {name: np.interp(s, arc, getattr(line, name)) for name in ("sd", "width", "score")}
    return replace(line, points=interpolated(line.points, arc, s), **moved)

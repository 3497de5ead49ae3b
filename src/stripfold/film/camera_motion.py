"""Whether the camera stood still, from the robot's stops to the film and along it.

Corners of one picture are found again in another (Lucas and Kanade, on a pyramid), and the similarity on which most of
them agree, a shift with a turn and a zoom, is that of the picture: what has moved by itself is outvoted.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import median_filter

from stripfold.base.arrays import Array, Index, Picture
from stripfold.base.errors import MeasurementError
from stripfold.film.gripper import Track
from stripfold.film.video import Thumbnails

FINE, COARSE, GAIN = 1.0, 5.0, 400.0
"""Standard deviations of the Gaussians between which structures count, pixels, and grey levels for each of their
logarithm: finer is noise, coarser light and shadow."""
CORNERS, QUALITY, APART, WINDOW = 300, 0.05, 6.0, (15, 15)
"""Most corners, least quality relative to the best, least distance, and the window that is found again, pixels."""
SAME = 1.0
"""Distance of a corner from where the similarity, or the way back, leads, pixels, up to which it agrees."""
CELLS, EACH = (4, 3), 3
"""Parts of a picture, across and down, and corners of each that count: one that a recorder writes on has many."""
MIN_CORNERS, AGREED = 5, 0.5
"""Corners that must be found again, and the share of them that must agree: less where the room has changed."""
MOVED, SCATTER = 0.8, 4.0
"""Median shift of the corners, pixels of the small copies, and over their scatter, from which the camera has moved."""
FIRST = 8
"""Frames averaged, at the beginning of the film and at the snap."""
USUAL, JUMP = 9, 3
"""Frames over which the marker's usual velocity is taken, and within which a knock moves it."""
MIN_JUMP, JUMP_SHARE = 1.5, 0.5
"""Least jump of the marker, pixels, and least relative to its usual motion in as many frames: jitter of the times."""
MOVED_BY = "the camera moved by"
"""What the messages say."""
ADVICE = "take the pictures of plane and robot grid again with the camera where it is now, or film again"


class Shift(NamedTuple):
    """How far the second picture is shifted at a place, x and y, pixels, nan where it cannot be seen; whether any of it
    clearly is.
    """

    x: float
    y: float
    moved: bool

    @property
    def problem(self) -> str:
        """What is wrong with a camera that should have stood still since the robot's stops; empty for nothing."""
        if self.moved:
            return f"{MOVED_BY} {np.hypot(self.x, self.y):.1f} px since the pictures of the robot grid"
        if np.isfinite(self.x):
            return ""
        return "nothing with clear corners stands still in view: whether the camera moved since the grid is unknown"

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Where the camera moved, an error within says so: it may be the cause."""
        try:
            yield
        except MeasurementError as error:
            if not self.moved:
                raise
            found = f"{self.problem}, and {error.found}"
            raise MeasurementError(error.source, found, "a camera that stands still", ADVICE) from error


def between(first: Array | Picture, second: Array | Picture, place: Array | None = None) -> Shift:
    """Estimate the shift of what both pictures show, from the first to the second, shape (h, w).

    ``place``: where, pixels, shape (2,); without it in the middle of the corners.
    """
    before, after = _structure(first), _structure(second)
    corners = cv2.goodFeaturesToTrack(before, CORNERS, QUALITY, APART)
    unknown = Shift(np.nan, np.nan, False)
    if corners is None:
        return unknown
    there, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None, winSize=WINDOW, maxLevel=3)
    back, found_back, _ = cv2.calcOpticalFlowPyrLK(after, before, there, None, winSize=WINDOW, maxLevel=3)
    returned = np.hypot(*(back - corners).reshape(-1, 2).T) < SAME
    again = returned & (found.ravel() > 0) & (found_back.ravel() > 0)
    corners, there = corners.reshape(-1, 2)[again], there.reshape(-1, 2)[again]
    spread = _spread(corners, before.shape[::-1])
    corners, there = corners[spread], there[spread]
    if len(corners) < MIN_CORNERS:
        return unknown
    matrix, agreed = cv2.estimateAffinePartial2D(corners, there, ransacReprojThreshold=SAME)
    if matrix is None or agreed.sum() < MIN_CORNERS or agreed.mean() < AGREED:
        return unknown

    def shifts(places: Array) -> Array:
        return np.asarray(places @ matrix[:, :2].T + matrix[:, 2] - places)

    agree = agreed.ravel() > 0
    moved, off = shifts(corners[agree]), (there - corners)[agree]
    # A similarity has four parameters.
    scatter = np.sqrt(np.sum((off - moved) ** 2) / (2 * len(off) - 4))
    far = np.median(np.linalg.norm(moved, axis=1)) >= max(MOVED, SCATTER * scatter)
    x, y = shifts(corners[agree].mean(axis=0) if place is None else place).tolist()
    return Shift(x, y, bool(far))


def _spread(corners: Array, size: tuple[int, ...]) -> Index:
    """Numbers of the first :data:`EACH` corners in each part of a picture of this size, shape (n,)."""
    cells = np.floor(corners / size * CELLS) @ (1, CELLS[0])
    order = np.argsort(cells, kind="stable")
    rank = np.arange(len(order)) - np.searchsorted(cells[order], cells[order])
    return np.sort(order[rank < EACH])


def _structure(picture: Array | Picture) -> Picture:
    """A picture's logarithm without what is finer than :data:`FINE` or coarser than :data:`COARSE`, in grey levels."""
    light = np.asarray(picture, np.float32) + np.float32(4.0)  # dark noise has no large logarithm
    fine = cv2.GaussianBlur(light, (0, 0), FINE)
    contrast = np.log(fine) - np.log(cv2.GaussianBlur(fine, (0, 0), COARSE))
    return np.asarray(np.clip(128.0 + GAIN * contrast, 0.0, 255.0), np.uint8)


def since_stops(stops: Picture, film: Thumbnails, frames: slice = slice(FIRST), place: Array | None = None) -> Shift:
    """Estimate the shift, pixels of the film, from the pictures of the robot's stops to some small frames of the film.

    ``stops`` are small copies, shape (n, h, w), of which what stands still counts: the mean of the middle third of the
    values at each pixel.  ``place``: as for :func:`between`, pixels of the film.
    """
    out = len(stops) // 3
    still = np.sort(stops, axis=0)[out : len(stops) - out].mean(axis=0)
    there = None if place is None else place / film.whole
    x, y, moved = between(still, np.mean(film.pictures[frames], axis=0), there)
    return Shift(x * film.whole, y * film.whole, moved)


def knock(gripper: Track, film: Thumbnails) -> tuple[float, Array] | None:
    """Find when the camera was knocked in the film, s, and how far that moved the picture, shape (2,), pixels.

    The marker jumps, and all of the picture with it.
    """
    step = np.diff(gripper.time)[:, None]
    velocity = np.diff(gripper.centre, axis=0) / step
    usual = median_filter(velocity, size=(USUAL, 1), mode="nearest")
    excess = np.cumsum(np.vstack([np.zeros((JUMP, 2)), (velocity - usual) * step]), axis=0)
    jump = excess[JUMP:] - excess[:-JUMP]
    size = np.hypot(*jump.T)
    limit = np.maximum(MIN_JUMP, JUMP_SHARE * JUMP * np.hypot(*(usual * step).T))
    last = int(np.argmax(size / limit))
    if size[last] <= limit[last]:
        return None
    before = max(last + 1 - JUMP, 0) // film.every
    after = min(-(-(last + 1) // film.every), len(film.pictures) - 1)
    moved = between(film.pictures[before], film.pictures[after]).moved
    return (float(gripper.time[last]), jump[last]) if moved else None

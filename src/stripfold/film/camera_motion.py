"""Whether the camera stood still, from the robot's stops to the film and along it.

Two pictures are compared cell by cell: each cell of the first is correlated with the second at all shifts up to a
reach, and those in which it is found again vote with their correlation.  A cell with an edge votes for all shifts along
the edge, one with a corner for one shift.  What has moved by itself, changed, or has no texture is outvoted.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from stripfold.base.arrays import Array
from stripfold.base.errors import MeasurementError
from stripfold.film.gripper import Track
from stripfold.film.video import Thumbnails

CELL, REACH = 20, 12
"""Side of a cell and largest shift, pixels of the pictures compared, which are small copies of those filmed."""
FINE, COARSE = 1.0, 5.0
"""Standard deviations of the Gaussians between which structures count: finer is noise, coarser light and shadow."""
FOUND = 0.7
"""Correlation from which a cell is found again."""
CLEAR = 2.2
"""Lead of the best shift over those :data:`APART` from it, votes, from which the direction is determined: where nothing
but a grain along x was there, the lead was up to 1.8."""
APART = 3
AGREED = 0.55
"""Mean vote of the cells that are found for the best shift: 0.6 and more in one room; less where the room has changed,
whose cells resemble others by chance."""
MOVED, VOTES = 1.5, 1.0
"""Least shift, pixels of the small copies, that is noticed, and its lead over smaller ones, votes."""
HALVES = 2
"""How often the pictures are halved, so that larger shifts are within reach."""
FIRST = 8
"""Frames averaged at the beginning of the film."""
USUAL, JUMP = 9, 3
"""Frames over which the marker's usual velocity is taken, and within which a knock moves it."""
MIN_JUMP, JUMP_SHARE = 1.5, 0.5
"""Least jump of the marker, pixels, and least relative to its usual motion in as many frames: jitter of the times."""

MOVED_BY = "the camera moved by"
"""What the messages say."""
ADVICE = "take the pictures of plane and robot grid again with the camera where it is now, or film again"


class Shift(NamedTuple):
    """How far the second picture is shifted, x and y, pixels, nan where it cannot be seen; whether it clearly is."""

    x: float
    y: float
    moved: bool

    def times(self, factor: float) -> Shift:
        """The same in smaller pixels."""
        return Shift(self.x * factor, self.y * factor, self.moved)

    @property
    def problem(self) -> str:
        """What is wrong with a camera that should have stood still since the robot's stops; empty for nothing."""
        if self.moved:
            size = np.hypot(*np.nan_to_num([self.x, self.y]))
            return f"{MOVED_BY} {size:.1f} px between the pictures of the robot grid and the film"
        if np.isfinite(self.x):
            return ""
        return "nothing with upright edges stands still in view: whether the camera moved since the grid is unknown"

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


def between(first: Array, second: Array) -> Shift:
    """The shift of what both pictures show, from the first to the second, shape (h, w)."""
    shift = _between(first, second)
    if shift.moved:
        return shift
    for factor in 2 ** np.arange(1, HALVES):
        size = first.shape[1] // factor, first.shape[0] // factor
        coarse = _between(*(cv2.resize(picture, size, interpolation=cv2.INTER_AREA) for picture in (first, second)))
        if coarse.moved:
            return coarse.times(float(factor))
    return shift


def background(pictures: NDArray[np.uint8]) -> Array:
    """What stands still in pictures of shape (n, h, w): the mean of the middle third of the values at each pixel."""
    out = len(pictures) // 3
    return np.asarray(np.sort(pictures, axis=0)[out : len(pictures) - out].mean(axis=0))


def since_stops(stops: NDArray[np.uint8], film: Thumbnails, frames: slice = slice(FIRST)) -> Shift:
    """The shift from the pictures of the robot's stops to some frames of the film, by default the first ones.

    ``stops`` are small copies, shape (n, h, w); the shift is in pixels of the film.
    """
    shift = between(background(stops), np.asarray(np.mean(film.pictures[frames], axis=0)))
    return shift.times(film.whole)


def knock(gripper: Track, film: Thumbnails) -> tuple[float, Array] | None:
    """When the camera was knocked in the film, s, and how far that moved the picture, shape (2,), pixels.

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
    shift = between(film.pictures[before].astype(np.float64), film.pictures[after].astype(np.float64))
    if not shift.moved:
        return None
    return float(gripper.time[last]), jump[last]


def _between(first: Array, second: Array) -> Shift:
    """The shift within :data:`REACH`."""
    votes, found = _votes(*(_structure(picture) for picture in (first, second)))
    row, column = (int(i) for i in np.unravel_index(np.argmax(votes), votes.shape))
    away = np.abs(np.arange(len(votes)) - np.array([[column], [row]])) >= APART
    rivals = votes[row, away[0]].max(), votes[away[1], column].max()
    seen = [
        0 < at < 2 * REACH and votes[row, column] >= max(rival + CLEAR, AGREED * found)
        for at, rival in zip((column, row), rivals, strict=True)
    ]
    lines = zip((votes[row], votes[:, column]), (column, row), seen, strict=True)
    place = np.array([_vertex(line, at) - REACH if known else np.nan for line, at, known in lines])
    # A direction that is not seen may have any shift.
    size = float(np.hypot(*np.nan_to_num(place)))
    distance = [np.abs(np.arange(-REACH, REACH + 1)) * known for known in seen]
    small = np.hypot(distance[0], distance[1][:, None]) < MOVED
    moved = size >= MOVED and votes[row, column] - votes[small].max() >= VOTES
    return Shift(float(place[0]), float(place[1]), bool(moved))


def _votes(first: Array, second: Array) -> tuple[Array, int]:
    """Votes for each shift, shape (2 * REACH + 1, 2 * REACH + 1), y first, and of how many cells."""
    total, found = np.zeros((2 * REACH + 1, 2 * REACH + 1)), 0
    height, width = first.shape
    for y in range(REACH, height - REACH - CELL + 1, CELL):
        for x in range(REACH, width - REACH - CELL + 1, CELL):
            cell = first[y : y + CELL, x : x + CELL]
            around = second[y - REACH : y + CELL + REACH, x - REACH : x + CELL + REACH]
            alike = cv2.matchTemplate(around, cell, cv2.TM_CCOEFF_NORMED)
            if alike.max() >= FOUND:
                total += np.maximum(alike, 0.0)
                found += 1
    return total, found


def _structure(picture: Array) -> Array:
    """The logarithm of a picture without what is finer than :data:`FINE` or coarser than :data:`COARSE`."""
    light = picture.astype(np.float32) + np.float32(4.0)  # dark noise has no large logarithm
    fine = cv2.GaussianBlur(light, (0, 0), FINE)
    return np.asarray(np.log(fine) - np.log(cv2.GaussianBlur(fine, (0, 0), COARSE)))


def _vertex(line: Array, at: int) -> float:
    """Place of the maximum of a parabola through the largest value and its neighbours."""
    left, middle, right = line[at - 1 : at + 2]
    return at + 0.5 * (left - right) / (left - 2.0 * middle + right)

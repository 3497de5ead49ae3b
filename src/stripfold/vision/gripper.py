"""Where the gripper is in each frame: its marker is found once, then followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import TrackingError
from stripfold.vision.decoder import Image
from stripfold.vision.marker import Fit, Marker
from stripfold.vision.video import Frame

LONGEST_GAP = 0.5
"""For how long the marker may be out of sight, s."""
MOST_LOST = 0.2
"""Share of the frames in which it may be."""
LEAST_SCORE = 0.7
"""Correlation with its pattern: shadows and fingers leave 0.86 or more, other things reach 0.56 at most."""
_ADVICE = "keep the whole marker in view, sharp and evenly lit, with a white rim of one cell"


@dataclass(frozen=True, eq=False)
class Grip:
    """The marker in one frame.

    Attributes
    ----------
    time
        Of the frame, s.
    centre
        Shape (2,), pixels.
    corners
        Shape (4, 2), pixels, in OpenCV's order.
    sd
        Shape (2,): standard deviation of the centre along x and y, pixels.
    score
        Correlation of the picture with the marker, from 0 to 1.
    tracked
        Whether it was seen; where not, the place is foretold from the frames before.
    """

    time: float
    centre: Array
    corners: Array
    sd: Array
    score: float
    tracked: bool


@dataclass(frozen=True, eq=False)
class Track:
    """The marker in all frames.

    Attributes
    ----------
    time
        Shape (n,), s.
    centre, sd
        Shape (n, 2), pixels.
    corners
        Shape (n, 4, 2), pixels.
    score
        Shape (n,).
    tracked
        Shape (n,): whether it was seen; where not, the place is interpolated in time.
    """

    time: Array
    centre: Array
    corners: Array
    sd: Array
    score: Array
    tracked: NDArray[np.bool_]


class GripperTracker:
    """Follows a marker from frame to frame: call it with each in turn.

    Parameters
    ----------
    dictionary
        Name of the dictionary, as in a recording's description.
    number
        Which marker of it.
    source
        What is filmed, for errors.
    """

    def __init__(self, dictionary: str, number: int, source: str = "video") -> None:
        self._marker = Marker(dictionary, number)
        self._what, self._source = f"marker {number} of {dictionary}", source
        self._seen: list[tuple[float, Fit]] = []

    def __call__(self, frame: Frame) -> Grip:
        """The marker in the next frame.

        Raises
        ------
        TrackingError
            It is not in the first frame, or was out of sight for longer than :data:`LONGEST_GAP`.
        """
        if not self._seen:
            fit = self._found(frame.image, None)
            if fit is None:
                raise TrackingError(self._source, f"{self._what} is not in the first frame", "the marker", _ADVICE)
            return self._accepted(frame.time, fit)
        last_time, last = self._seen[-1]
        foretold = last.moved(self._speed() * (frame.time - last_time))
        fit = self._marker.fit(frame.image, foretold)
        if fit is None or fit.score < LEAST_SCORE:
            fit = self._found(frame.image, foretold, frame.time - last_time)
        if fit is not None:
            return self._accepted(frame.time, fit)
        if frame.time - last_time > LONGEST_GAP:
            raise TrackingError(
                self._source,
                f"{self._what} is lost from {last_time:.3f} to {frame.time:.3f} s",
                f"the marker, but for gaps of up to {LONGEST_GAP:g} s",
                _ADVICE,
            )
        # As wrong as if it had stopped when it was last seen.
        sd = np.hypot(last.sd, np.abs(foretold.centre - last.centre)) + 1.0
        return Grip(frame.time, foretold.centre, foretold.corners, sd, 0.0, False)

    def _accepted(self, time: float, fit: Fit) -> Grip:
        self._seen = [*self._seen[-1:], (time, fit)]
        return Grip(time, fit.centre, fit.corners, fit.sd, fit.score, True)

    def _speed(self) -> Array:
        """Shape (2,), pixels per second, as far as is known."""
        if len(self._seen) < 2:
            return np.zeros(2)
        (before, first), (after, second) = self._seen
        return (second.centre - first.centre) / (after - before)

    def _found(self, image: Image, near: Fit | None, gap: float = 0.0) -> Fit | None:
        """The marker, searched for around a place, the wider the longer it is lost, or in the whole picture."""
        corner = np.zeros(2, dtype=int)
        if near is not None:
            reach = near.side * (2.0 + 10.0 * gap / LONGEST_GAP)
            corner = np.clip(np.floor(near.centre - reach), 0, None).astype(int)
            end = np.clip(np.ceil(near.centre + reach), 0, None).astype(int)
            image = image[corner[1] : end[1], corner[0] : end[0]]
            if min(image.shape) < near.side:
                return None
        rough = self._marker.find(image)
        fit = None if rough is None else self._marker.fit(image, rough)
        return None if fit is None or fit.score < LEAST_SCORE else fit.moved(corner.astype(np.float64))


def joined(grips: Sequence[Grip], source: str = "video") -> Track:
    """The marker in all frames; where it was not seen, its place is interpolated between those where it was.

    Raises
    ------
    TrackingError
        It was out of sight in more than :data:`MOST_LOST` of the frames.
    """
    tracked = np.array([grip.tracked for grip in grips], dtype=bool)
    if not len(grips) or np.mean(~tracked) > MOST_LOST:
        lost = f"in {np.mean(~tracked):.0%} of {len(grips)} frames" if len(grips) else "for want of frames"
        raise TrackingError(source, f"the gripper's marker is lost {lost}", f"at most {MOST_LOST:.0%}", _ADVICE)
    time = np.array([grip.time for grip in grips])
    corners = np.array([grip.corners for grip in grips])
    centre, sd = np.array([grip.centre for grip in grips]), np.array([grip.sd for grip in grips])
    seen = np.flatnonzero(tracked)
    # After the last frame with the marker there is nothing to interpolate with: the foretold places stay.
    for k in np.flatnonzero(~tracked[: seen[-1]]):
        i, j = seen[seen < k][-1], seen[seen > k][0]
        share = (time[k] - time[i]) / (time[j] - time[i])
        centre[k] = centre[i] + share * (centre[j] - centre[i])
        corners[k] = corners[i] + share * (corners[j] - corners[i])
        sd[k] = np.hypot(np.maximum(sd[i], sd[j]), _bend(time, centre, seen, i, j))
    return Track(time, centre, corners, sd, np.array([grip.score for grip in grips]), tracked)


def _bend(time: Array, centre: Array, seen: NDArray[np.intp], i: int, j: int) -> Array:
    """How far the way between frames ``i`` and ``j`` may leave the straight line, shape (2,), pixels.

    The speeds before and after differ; at most, one changes into the other at once, half-way.
    """
    before, after = seen[seen < i], seen[seen > j]
    if not (len(before) and len(after)):
        return np.full(2, 0.5) + 0.25 * np.abs(centre[j] - centre[i])
    p, q = before[-1], after[0]
    speeds = (centre[i] - centre[p]) / (time[i] - time[p]), (centre[q] - centre[j]) / (time[q] - time[j])
    return np.asarray(0.25 * (time[j] - time[i]) * np.abs(speeds[1] - speeds[0]))

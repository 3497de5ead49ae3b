"""Tracking of the gripper's marker through a video: detected once, then followed from frame to frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from stripfold.base.arrays import Array, Index, Mask, Picture
from stripfold.base.errors import TrackingError
from stripfold.film.fitted import MARKER_REPEATED
from stripfold.film.holder import Fit, Holder
from stripfold.film.video import Frame

MAX_GAP = 0.5
"""Longest time for which the marker may be hidden, s."""
MAX_LOST = 0.2
"""Share of the frames in which it may be hidden."""
MIN_SCORE = 0.7
"""Correlation with the pattern: partly covered markers reach 0.86 or more, other objects at most 0.56."""
MIN_SIGNIFICANT = 6.0
"""Least motion by which frames are told to repeat the one before, in standard deviations of the centre."""
AROUND = 5
"""So many frames before a frame, and as many after it, say how fast the marker moves."""
_ADVICE = "keep the whole marker in view, in focus and evenly lit, with a white rim of one cell"


class Grip(NamedTuple):
    """The marker in one frame: time, s; centre, shape (2,), corners, shape (4, 2), and sd of the centre, pixels.

    A marker that was not seen (not ``tracked``, ``score`` 0) is extrapolated from the frames before.
    """

    time: float
    centre: Array
    corners: Array
    sd: Array
    score: float
    tracked: bool


@dataclass(frozen=True, eq=False)
class Track:
    """The marker in all n frames: the fields of :class:`Grip` with a leading dimension n."""

    time: Array
    centre: Array
    corners: Array
    sd: Array
    score: Array
    tracked: Mask


class GripperTracker:
    """Follows a marker or a template, called with each frame in turn; ``source`` names the video in errors."""

    def __init__(self, marker: Holder, source: str = "video") -> None:
        self._marker, self._name, self._source = marker, marker.name, source
        self._last_two: list[tuple[float, Fit]] = []

    def __call__(self, frame: Frame) -> Grip:
        """Find the marker in the next frame; TrackingError: not in the first, or hidden longer than :data:`MAX_GAP`."""
        if not self._last_two:
            fit = self._search(frame.image)
            if fit is None:
                raise TrackingError(self._source, f"{self._name} is not in the first frame", "the marker", _ADVICE)
            return self._accept(frame.time, fit)
        last_time, last = self._last_two[-1]
        gap = frame.time - last_time
        predicted = last.moved(self._velocity() * gap)
        fit = self._marker.fit(frame.image, predicted)
        if fit is None or fit.score < MIN_SCORE:
            fit = self._search_near(frame.image, predicted, gap)
        if fit is not None:
            return self._accept(frame.time, fit)
        if gap > MAX_GAP:
            raise TrackingError(
                self._source,
                f"{self._name} is lost from {last_time:.3f} to {frame.time:.3f} s",
                f"the marker, except for gaps of up to {MAX_GAP:g} s",
                _ADVICE,
            )
        # As uncertain as if it had stopped where it was last seen.
        sd = np.hypot(last.sd, np.abs(predicted.centre - last.centre)) + 1.0
        return Grip(frame.time, predicted.centre, predicted.corners, sd, 0.0, False)

    def _accept(self, time: float, fit: Fit) -> Grip:
        self._last_two = [*self._last_two[-1:], (time, fit)]
        return Grip(time, fit.centre, fit.corners, fit.sd, fit.score, True)

    def _velocity(self) -> Array:
        """Shape (2,), pixels per second; zero until the marker was seen twice."""
        if len(self._last_two) < 2:
            return np.zeros(2)
        (before, first), (after, second) = self._last_two
        return (second.centre - first.centre) / (after - before)

    def _search(self, picture: Picture) -> Fit | None:
        rough = self._marker.find(picture)
        fit = None if rough is None else self._marker.fit(picture, rough)
        return None if fit is None or fit.score < MIN_SCORE else fit

    def _search_near(self, picture: Picture, near: Fit, gap: float) -> Fit | None:
        """Search around ``near``, in a region that grows with the gap."""
        reach = near.side * (2.0 + 10.0 * gap / MAX_GAP)
        low = np.clip(np.floor(near.centre - reach), 0, None).astype(int)
        high = np.clip(np.ceil(near.centre + reach), 0, None).astype(int)
        part = picture[low[1] : high[1], low[0] : high[0]]
        fit = None if min(part.shape) < near.side else self._search(part)
        return None if fit is None else fit.moved(low.astype(np.float64))


def interpolate_gaps(grips: Sequence[Grip], source: str = "video") -> Track:
    """Interpolate where the marker was not seen; TrackingError: in more than :data:`MAX_LOST` of the frames."""
    lost = float(np.mean([not grip.tracked for grip in grips]))
    if lost > MAX_LOST:
        found = f"the gripper's marker is lost in {lost:.0%} of {len(grips)} frames"
        raise TrackingError(source, found, f"at most {MAX_LOST:.0%}", _ADVICE)
    time, centre, corners, sd, score, tracked = (np.array(values) for values in zip(*grips, strict=True))
    seen = np.flatnonzero(tracked)
    # After the last frame with the marker the extrapolated positions remain.
    for k in np.flatnonzero(~tracked[: seen[-1]]):
        i, j = seen[seen < k][-1], seen[seen > k][0]
        share = (time[k] - time[i]) / (time[j] - time[i])
        centre[k] = centre[i] + share * (centre[j] - centre[i])
        corners[k] = corners[i] + share * (corners[j] - corners[i])
        sd[k] = np.hypot(np.maximum(sd[i], sd[j]), _max_deviation(time, centre, seen, i, j))
    return Track(time, centre, corners, sd, score, tracked)


def _max_deviation(time: Array, centre: Array, seen: Index, i: int, j: int) -> Array:
    """Largest deviation between frames ``i`` and ``j``, shape (2,), pixels: if the velocity jumps half-way."""
    before, after = seen[seen < i], seen[seen > j]
    if not (len(before) and len(after)):
        return np.full(2, 0.5) + 0.25 * np.abs(centre[j] - centre[i])
    p, q = before[-1], after[0]
    velocities = (centre[i] - centre[p]) / (time[i] - time[p]), (centre[q] - centre[j]) / (time[q] - time[j])
    return np.asarray(0.25 * (time[j] - time[i]) * np.abs(velocities[1] - velocities[0]))


def repeated(track: Track) -> Mask:
    """Which frames repeat the one before, but for errors of coding: the marker rests, but moves before and after."""
    speed = np.hypot(*np.diff(track.centre, axis=0).T) / np.diff(track.time)
    around = sliding_window_view(np.pad(speed, AROUND, mode="edge"), 2 * AROUND + 1)
    # Not where the marker starts or stops.
    before, after = (np.median(part, axis=1) for part in (around[:, :AROUND], around[:, -AROUND:]))
    noise = float(np.hypot(*np.median(track.sd, axis=0)))
    still = np.zeros(len(track.time), dtype=bool)
    # Over two frames a slow marker moves by what is significant, where over one it does not.
    for frames in (1, 2):
        step = np.hypot(*(track.centre[frames:] - track.centre[:-frames]).T)
        usual = np.minimum(before[: len(step)], after[frames - 1 :])
        expected = usual * (track.time[frames:] - track.time[:-frames])
        rest = (frames * step < MARKER_REPEATED * expected) & (expected > MIN_SIGNIFICANT * noise)
        for back in range(frames):
            still[frames - back : len(still) - back] |= rest
    return still

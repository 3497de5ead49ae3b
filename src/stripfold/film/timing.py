"""Times of a video's frames: dropped frames, a variable rate, and the exposure of a row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array, Index, Mask

_DROPPED = 1.5
"""Interval over the usual one from which frames are missing."""
_UNEVEN, _MAX_UNEVEN = 0.25, 0.05
"""Deviation of an interval from a multiple of the usual one that is not jitter, and the share of such intervals from
which the rate is variable."""


@dataclass(frozen=True, eq=False)
class Timing:
    """The times of a video's frames.

    ``time``, ``doubled``: shape (n,): ascending times, s, and which frames repeat the one before.  ``period``: the
    usual interval between frames, s.  ``dropped``: indices of the frames before which one or more are missing.
    ``variable``: whether the rate varies, so that a gap does not imply missing frames.
    """

    time: Array
    doubled: Mask
    period: float
    dropped: Index
    variable: bool

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words."""
        repeated = int(self.doubled.sum())
        found = {
            f"{repeated} frames repeat the one before": repeated > 0,
            f"frames are missing in {len(self.dropped)} places": len(self.dropped) > 0,
            "the frame rate varies": self.variable,
        }
        return tuple(text for text, holds in found.items() if holds)


def timing(time: Array, doubled: Mask) -> Timing:
    """Period, dropped frames and regularity from the times of two frames or more; see :class:`Timing`."""
    intervals = np.diff(time)
    period = float(np.median(intervals))
    ratio = intervals / period
    uneven = np.abs(ratio - np.maximum(np.rint(ratio), 1.0)) > _UNEVEN
    dropped = np.flatnonzero(intervals > _DROPPED * period) + 1
    return Timing(time, doubled, period, dropped, float(uneven.mean()) > _MAX_UNEVEN)


def row_time(time: float | Array, row: float | Array, height: int, rolling_shutter: float) -> Array:
    """Time, s, at which a row, 0 to ``height - 1``, of a frame was exposed.

    ``time`` is that of the frame and of its first row; ``rolling_shutter`` is the time from the exposure of the first
    row to that of the last.
    """
    return np.asarray(time + np.asarray(row) / (height - 1) * rolling_shutter, dtype=np.float64)

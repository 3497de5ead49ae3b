"""Whether the frames of a recording came regularly, and how well a moment between them is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

_DROP = 1.5
"""Interval from which on a frame is missing, in usual intervals."""
_UNEVEN = 0.25
"""Departure from the usual interval that is no jitter any more, as a share of it."""
_MOST_UNEVEN = 0.05
"""Share of such intervals up to which a recording is of constant rate, but for dropped frames."""


@dataclass(frozen=True, eq=False)
class Timing:
    """The times of the frames of a recording.

    Attributes
    ----------
    time
        Shape (n,), s, ascending.
    doubled
        Shape (n,): frames that only repeat the one before.
    period
        The usual interval from frame to frame, s.
    jitter
        Standard deviation of the intervals around it, without those where frames are missing, s.
    dropped
        Numbers of the frames before which one or more are missing.
    variable
        Whether the rate varies: then gaps are no sign of missing frames.
    """

    time: Array
    doubled: NDArray[np.bool_]
    period: float
    jitter: float
    dropped: NDArray[np.intp]
    variable: bool

    def spacing(self, moment: float) -> float:
        """Time from the last picture before ``moment``, s, to the next after it, s: what happened between is not seen.

        A doubled frame is no picture of its own time.  Before the first and after the last it is infinite.
        """
        seen = self.time[~self.doubled]
        after = int(np.searchsorted(seen, moment, side="right"))
        if moment == seen[-1]:
            after -= 1
        return float(seen[after] - seen[after - 1]) if 0 < after < len(seen) else float("inf")

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words."""
        found = {
            f"frames are missing in {len(self.dropped)} places": len(self.dropped) > 0,
            "the rate of the frames varies": self.variable,
        }
        return tuple(text for text, holds in found.items() if holds)


def timing(time: Array, doubled: NDArray[np.bool_]) -> Timing:
    """What the times of the frames tell.

    Parameters
    ----------
    time
        Shape (n,), s, ascending.
    doubled
        Shape (n,).

    Raises
    ------
    InvalidInputError
        There are fewer than three frames.
    """
    if len(time) < 3:
        raise InvalidInputError("video", f"{len(time)} frames", "at least 3", "record the whole way of the gripper")
    steps = np.diff(time)
    period = float(np.median(steps))
    regular = steps[steps <= _DROP * period]
    # A whole number of missing frames is no sign of a rate that varies.
    uneven = np.abs(steps / period - np.maximum(np.rint(steps / period), 1.0)) > _UNEVEN
    variable = float(uneven.mean()) > _MOST_UNEVEN
    dropped = np.flatnonzero(steps > _DROP * period) + 1
    return Timing(time, doubled, period, float(np.std(regular)), dropped, variable)


def row_time(time: float | Array, row: float | Array, height: int, rolling_shutter: float) -> Array:
    """When a row of a frame was exposed, s.

    Parameters
    ----------
    time
        Of the frame, which is that of its first row, s.
    row
        From 0 to ``height - 1``; parts of a row are allowed.
    height
        Number of rows.
    rolling_shutter
        From the exposure of the first row to that of the last, s.
    """
    return np.asarray(time + np.asarray(row) / (height - 1) * rolling_shutter, dtype=np.float64)

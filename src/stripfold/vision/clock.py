"""The clock of the robot against that of the camera, from the way of the gripper that both have seen.

The log tells x by its own clock; the video tells x by the camera's.  Sought is the offset with
``t_log = t_video + offset``; a shift of x, from a mapping that is a little off, is fitted too.  A steady advance cannot
tell such a shift from an offset: where it started or stopped can, and so can the mapping, whose own uncertainty is
given.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from stripfold.arrays import Array
from stripfold.errors import SynchronisationError
from stripfold.vision.tables import ascending, table

MOST_ROWS = 1_000_000
LEAST_CORRELATION = 0.999
"""Concordance of x by the video and by the log; 0.999 is what a speed wrong by 4.5 % leaves."""
LEAST_OVERLAP = 0.5
"""Share of the video, or of a shorter log, that both clocks must cover."""
_MOST_SAMPLES = 2000
"""Frames used for the search of the offset; all are used at its end."""
_MOST_OFFSETS = 4000
_STILL = 5.0
"""Way of the gripper, in standard deviations of its x, below which it is at rest."""
_ADVICE = "give the log of this very run, and film the gripper from before it starts until after it stops"


@dataclass(frozen=True, eq=False)
class RobotLog:
    """Where the gripped end was, as the robot reports it; each of shape (n,): time, s, by its clock; x and z, m."""

    time: Array
    x: Array
    z: Array


@dataclass(frozen=True)
class Clock:
    """How the two clocks go together.

    Attributes
    ----------
    offset, sd
        Time of the log minus time of the video, s, and its standard deviation.
    free_offset, free_sd
        The same without trust in the mapping's x: from starts and stops alone; ``free_sd`` is infinite where there
        are none.
    shift
        x of the video minus x of the log, m, that is left.
    correlation
        Concordance of x by both, 1 at best.
    residual
        Root mean square of what is left of x, m.
    """

    offset: float
    sd: float
    free_offset: float
    free_sd: float
    shift: float
    correlation: float
    residual: float

    def to_log(self, time: float | Array) -> Array:
        """Times of the log, s, of times of the video."""
        return np.asarray(time + np.float64(self.offset))

    def to_video(self, time: float | Array) -> Array:
        """Times of the video, s, of times of the log."""
        return np.asarray(time - np.float64(self.offset))


def read_log(path: Path) -> RobotLog:
    """The log of a robot from a CSV ``t,x,z``, s and m.

    Raises
    ------
    InvalidInputError
        No such table, or times that do not increase.
    """
    values = table("robot_log", path, "t,x,z", (2, MOST_ROWS))
    return RobotLog(ascending("t", values[:, 0], path), values[:, 1], values[:, 2])


def synchronise(time: Array, x: Array, sd: float, log: RobotLog, mapping_sd: float, source: str = "robot_log") -> Clock:
    """The offset of the clocks.

    Parameters
    ----------
    time
        Shape (n,): of the frames, s, by the camera's clock; that of the gripper's row.
    x
        Shape (n,): of the gripped end by the video, m.
    sd
        Standard deviation of its noise from frame to frame, m.
    log
        The robot's.
    mapping_sd
        Standard deviation of an error of x that all frames share, m.
    source
        The log, for errors.

    Raises
    ------
    SynchronisationError
        The gripper does not move, no offset lets both see the same time, or both do not tell of the same motion.
    """
    moved = float(np.ptp(x))
    if len(time) < 10 or moved < _STILL * sd or np.ptp(log.x) < _STILL * sd:
        found = f"x changes by {moved * 1e3:.2f} mm in the video and {np.ptp(log.x) * 1e3:.2f} mm in the log"
        raise SynchronisationError(source, found, f"a way of at least {_STILL * sd * 1e3:.2g} mm", _ADVICE)
    offset = _searched(time, x, sd, log, mapping_sd)
    free = _refined(time, x, sd, log, np.inf, _searched(time, x, sd, log, np.inf))
    offset = _refined(time, x, sd, log, mapping_sd, offset)
    left, inside = _left(time, x, log, np.array([offset]))
    left, inside = left[0][inside[0]], inside[0]
    shift = _shift(left, sd, mapping_sd)
    seen = np.interp(time[inside] + offset, log.time, log.x)
    spread = float(np.var(x[inside]) + np.var(seen))
    correlation = 1.0 - float(np.mean((left - shift) ** 2)) / spread if spread > 0.0 else 0.0
    if correlation < LEAST_CORRELATION:
        raise SynchronisationError(
            source,
            f"x by the log and by the video agree with a correlation of {correlation:.4f} only",
            f"{LEAST_CORRELATION}",
            _ADVICE,
        )
    noise = max(sd, float(np.std(left)) * _shared(left))
    rate = _rate(time[inside] + offset, log)
    return Clock(
        offset,
        _sd(rate, noise, mapping_sd),
        free,
        _sd(rate, noise, np.inf),
        shift,
        correlation,
        float(np.sqrt(np.mean((left - shift) ** 2))),
    )


def _shared(left: Array) -> float:
    """By how much the scatter of a mean of ``left`` exceeds that of independent values of the same scatter."""
    centred = left - left.mean()
    power, total = float(centred @ centred), 1.0
    for lag in range(1, len(left) // 4):
        share = float(centred[lag:] @ centred[:-lag]) / power if power > 0.0 else 0.0
        if share < 2.0 / np.sqrt(len(left)):
            break
        total += 2.0 * share
    return float(np.sqrt(total))


def _left(time: Array, x: Array, log: RobotLog, offsets: Array) -> tuple[Array, Array]:
    """x by the video minus x by the log, and where the log has it; both of shape (m, n) for m offsets."""
    moments = time + offsets[:, None]
    inside = (moments >= log.time[0]) & (moments <= log.time[-1])
    return x - np.interp(moments, log.time, log.x), inside


def _shift(left: Array, sd: float, mapping_sd: float) -> float:
    """The likeliest shift of x, when the mapping says it is zero within ``mapping_sd``."""
    return float(np.sum(left) / (len(left) + (sd / mapping_sd) ** 2))


def _cost(time: Array, x: Array, sd: float, log: RobotLog, mapping_sd: float, offsets: Array) -> Array:
    """Mean square of what is left of x, with the likeliest shift, shape (m,); infinite where too little overlaps."""
    left, inside = _left(time, x, log, offsets)
    count = inside.sum(axis=1)
    total = np.where(inside, left, 0.0).sum(axis=1)
    squares = np.where(inside, left**2, 0.0).sum(axis=1) - total**2 / (np.maximum(count, 1) + (sd / mapping_sd) ** 2)
    shared = LEAST_OVERLAP * min(1.0, np.ptp(log.time) / np.ptp(time)) * len(time)
    return np.where(count >= max(shared, 5.0), squares / np.maximum(count, 1), np.inf)


def _searched(time: Array, x: Array, sd: float, log: RobotLog, mapping_sd: float) -> float:
    """The best of the offsets with which enough of both overlaps, to one step of the search, s."""
    every = -(-len(time) // _MOST_SAMPLES)
    time, x = time[::every], x[::every]
    low, high = log.time[0] - time[-1], log.time[-1] - time[0]
    offsets = np.linspace(low, high, min(_MOST_OFFSETS, int((high - low) / np.median(np.diff(time))) + 2))
    parts = np.array_split(offsets, -(-len(offsets) // 100))
    costs = np.concatenate([_cost(time, x, sd, log, mapping_sd, part) for part in parts])
    return float(offsets[int(np.argmin(costs))])


def _refined(time: Array, x: Array, sd: float, log: RobotLog, mapping_sd: float, offset: float) -> float:
    """The best offset within two steps of the search, s."""
    step = 2.0 * max((np.ptp(log.time) + np.ptp(time)) / _MOST_OFFSETS, float(np.median(np.diff(time))))

    def cost(value: float) -> float:
        found = float(_cost(time, x, sd, log, mapping_sd, np.array([value]))[0])
        return min(found, 1e300)

    # Two times: the first finds the valley, the second its bottom, to a small part of the first's width.
    for width in (step, step / 20.0):
        found = minimize_scalar(
            cost, bounds=(offset - width, offset + width), method="bounded", options={"xatol": 1e-7}
        )
        offset = float(found.x) if found.fun <= cost(offset) else offset
    return offset


def _rate(moments: Array, log: RobotLog) -> Array:
    """Speed along x by the log, m/s, at ``moments``."""
    width = max(float(np.median(np.diff(log.time))), 1e-3)
    ahead, behind = (np.interp(moments + sign * width / 2.0, log.time, log.x) for sign in (1.0, -1.0))
    return np.asarray((ahead - behind) / width)


def _sd(rate: Array, noise: float, mapping_sd: float) -> float:
    """Standard deviation of the offset, s: the shift, known to ``mapping_sd``, is estimated with it."""
    known = float(np.sum(rate**2)) - float(np.sum(rate)) ** 2 / (len(rate) + (noise / mapping_sd) ** 2)
    return noise / float(np.sqrt(known)) if known > 1e-9 * float(np.sum(rate**2)) else float("inf")

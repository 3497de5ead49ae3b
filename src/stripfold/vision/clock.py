"""Synchronisation of the robot's clock with the camera's, from the gripper's motion that both recorded.

The log gives x by the robot's clock, the video gives x by the camera's.  The offset ``t_log - t_video`` is found by
least squares together with a shift of x, which is the error of the mapping and has a known standard deviation.  During
a steady advance the two cannot be told apart; starts and stops determine the offset by themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from stripfold.arrays import Array
from stripfold.errors import SynchronisationError
from stripfold.tables import check_increasing, read_table

MAX_ROWS = 1_000_000
MIN_CORRELATION = 0.999
"""Concordance correlation of x by the video and by the log; a speed wrong by 4.5 % leaves 0.999."""
MIN_OVERLAP = 0.5
"""Share of the video, or of a shorter log, that both must cover."""
MIN_FRAMES = 5
"""Frames that both must cover."""
_MAX_FRAMES, _MAX_OFFSETS = 2000, 4000
"""Frames and offsets in the grid search."""
_AT_REST = 5.0
"""Range of x, in standard deviations, below which the gripper is at rest."""
_ADVICE = (
    "give the log of this run, with x as in the robot grid, and film the gripper from before it starts until after it "
    "stops"
)


@dataclass(frozen=True, eq=False)
class RobotLog:
    """The gripped end as the robot reports it, each of shape (n,): time, s, by its clock; x and z, m."""

    time: Array
    x: Array
    z: Array


@dataclass(frozen=True)
class Clock:
    """The relation between the two clocks.

    ``offset`` is the time of the log minus that of the video, s, and ``sd`` its standard deviation; ``shift`` is what
    remains of x of the video minus x of the log, m; ``correlation`` is the concordance correlation of the two.
    """

    offset: float
    sd: float
    shift: float
    correlation: float

    def to_log(self, time: float | Array) -> Array:
        """Times of the log, s, from times of the video."""
        return np.asarray(time + np.float64(self.offset))


def read_log(path: Path) -> RobotLog:
    """The robot's log from a CSV file ``t,x,z``, s and m.

    Raises
    ------
    InvalidInputError
        Not such a table, or times that do not increase.
    """
    time, x, z = read_table("robot_log", path, "t,x,z", (2, MAX_ROWS)).T
    check_increasing("t", time, path)
    return RobotLog(time, x, z)


def synchronise(time: Array, x: Array, sd: float, log: RobotLog, mapping_sd: float, source: str = "robot_log") -> Clock:
    """The offset between the clocks.

    Parameters
    ----------
    time
        Shape (n,): exposure of the gripper in each frame, s, by the camera's clock.
    x
        Shape (n,): of the gripped end by the video, m.
    sd
        Standard deviation of its noise, m.
    log
        The robot's.
    mapping_sd
        Standard deviation of an error of x that all frames share, m.
    source
        Name of the log, for errors.

    Raises
    ------
    SynchronisationError
        The gripper does not move, or the video and the log do not show the same motion.
    """
    by_video, by_log = float(np.ptp(x)), float(np.ptp(log.x))
    if len(time) < 10 or min(by_video, by_log) < _AT_REST * sd:
        found = f"x changes by {by_video * 1e3:.2f} mm in the video and {by_log * 1e3:.2f} mm in the log"
        raise SynchronisationError(source, found, f"a motion of at least {_AT_REST * sd * 1e3:.2g} mm", _ADVICE)
    offset = _best_offset(time, x, log, sd / mapping_sd)
    residual, overlap = _residuals(time, x, log, np.array([offset]))
    if overlap.sum() < MIN_FRAMES:
        raise SynchronisationError(
            source, f"a log of {np.ptp(log.time):.3g} s", f"{MIN_FRAMES} frames or more", _ADVICE
        )
    residual, moments = residual[0, overlap[0]], time[overlap[0]] + offset
    # The most probable shift, given that it is zero within mapping_sd.
    shift = float(np.sum(residual) / (len(residual) + (sd / mapping_sd) ** 2))
    spread = float(np.var(x[overlap[0]]) + np.var(np.interp(moments, log.time, log.x)))
    correlation = 1.0 - float(np.mean((residual - shift) ** 2)) / spread if spread > 0.0 else 0.0
    if correlation < MIN_CORRELATION:
        found = f"x by the log and by the video have a correlation of {correlation:.4f} only"
        raise SynchronisationError(source, found, f"{MIN_CORRELATION}", _ADVICE)
    noise = max(sd, float(np.std(residual)) * np.sqrt(_correlation_length(residual)))
    return Clock(offset, _offset_sd(moments, log, noise, mapping_sd), shift, correlation)


def _residuals(time: Array, x: Array, log: RobotLog, offsets: Array) -> tuple[Array, Array]:
    """x by the video minus x by the log, and a mask of the overlap; both of shape (m, n) for m offsets."""
    moments = time + offsets[:, None]
    overlap = (moments >= log.time[0]) & (moments <= log.time[-1])
    return x - np.interp(moments, log.time, log.x), overlap


def _cost(time: Array, x: Array, log: RobotLog, ratio: float, offsets: Array) -> Array:
    """Mean squared residual with the most probable shift, shape (m,); infinite where too little overlaps.

    ``ratio`` is the standard deviation of x over that of the shift.
    """
    residual, overlap = _residuals(time, x, log, offsets)
    n = overlap.sum(axis=1)
    total = np.where(overlap, residual, 0.0).sum(axis=1)
    squares = np.where(overlap, residual**2, 0.0).sum(axis=1) - total**2 / (np.maximum(n, 1) + ratio**2)
    least = MIN_OVERLAP * min(1.0, np.ptp(log.time) / np.ptp(time)) * len(time)
    return np.where(n >= max(least, MIN_FRAMES), squares / np.maximum(n, 1), np.inf)


def _best_offset(time: Array, x: Array, log: RobotLog, ratio: float) -> float:
    """The offset with the least cost, s: a grid search over all overlaps, then two bounded minimisations."""
    period = float(np.median(np.diff(time)))
    every = -(-len(time) // _MAX_FRAMES)
    t, some_x = time[::every], x[::every]
    low, high = log.time[0] - t[-1], log.time[-1] - t[0]
    offsets = np.linspace(low, high, min(_MAX_OFFSETS, int((high - low) / (every * period)) + 2))
    parts = np.array_split(offsets, -(-len(offsets) // 100))  # bounds the memory
    offset = float(offsets[np.argmin(np.concatenate([_cost(t, some_x, log, ratio, part) for part in parts]))])

    def cost(value: float) -> float:
        return min(float(_cost(time, x, log, ratio, np.array([value]))[0]), 1e300)

    step = 2.0 * max((np.ptp(log.time) + np.ptp(time)) / _MAX_OFFSETS, period)
    for width in (step, step / 20.0):
        bounds = (offset - width, offset + width)
        found = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": 1e-7})
        offset = float(found.x) if found.fun <= cost(offset) else offset
    return offset


def _correlation_length(residual: Array) -> float:
    """Integrated autocorrelation of the residuals: how many of them count as one independent value."""
    centred = residual - residual.mean()
    power, length = float(centred @ centred), 1.0
    for lag in range(1, len(residual) // 4):
        autocorrelation = float(centred[lag:] @ centred[:-lag]) / power if power > 0.0 else 0.0
        if autocorrelation < 2.0 / np.sqrt(len(residual)):
            break
        length += 2.0 * autocorrelation
    return length


def _offset_sd(moments: Array, log: RobotLog, noise: float, mapping_sd: float) -> float:
    """Standard deviation of the offset, s, which is estimated together with the shift."""
    width = max(float(np.median(np.diff(log.time))), 1e-3)
    ahead, behind = (np.interp(moments + sign * width / 2.0, log.time, log.x) for sign in (1.0, -1.0))
    speed = (ahead - behind) / width
    power = float(np.sum(speed**2))
    information = power - float(np.sum(speed)) ** 2 / (len(speed) + (noise / mapping_sd) ** 2)
    return noise / float(np.sqrt(information)) if information > 1e-9 * power else float("inf")

"""Synchronisation of the robot's clock with the camera's, from the gripper's motion that both recorded.

The log gives x by the robot's clock, the video gives x by the camera's.  The offset ``t_log - t_video`` is estimated
together with the error of the mapping from pixels to x: a shift, whose standard deviation is known, and a slope and a
bend along the gripper's way, which are a share of it.  During a steady advance shift and offset cannot be told apart;
starts and stops determine the offset by themselves.

The sum of squares is no parabola in the offset: the log's noise gives it a minimum in the middle of every interval of
the log, and a film that begins or ends with the motion a kink.  The log is therefore smoothed over a few rows, and
offset and standard deviation are the mean and the width of the offset's probability, evaluated over a range of offsets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SynchronisationError
from stripfold.files.tables import read_table
from stripfold.film.fitted import BEND_SHARE, LAG_SD, SLOPE_SHARE

MAX_ROWS = 1_000_000
MIN_CORRELATION = 0.999
"""Concordance correlation of x by the video and by the log; a speed wrong by 4.5 % leaves 0.999."""
MIN_OVERLAP = 0.5
"""Share of the video, or of a shorter log, that both must cover."""
MIN_FRAMES = 5
"""Frames that both must cover."""
_MAX_FRAMES, _MAX_OFFSETS = 2000, 4000
"""Frames and offsets in the grid search."""
PLAUSIBLE = 3.0
"""Shift, in its standard deviations, that the mapping may have."""
OUTLIER = 2.0
"""Residual, in standard deviations, from which a frame has less weight: something passes in front of the marker."""
REPEATED = 0.4
"""Motion of the marker, pixels, up to which its error repeats: that depends on how its edges lie among the pixels, and
a compressed film repeats the picture of a marker at rest with its noise."""
SLOW = 1.5
"""Speed by the log over that by the video from which on a film is likely to be in slow motion."""
SLOW_MOTION = "a film in slow motion needs the true times of its frames, as timestamps"
SMOOTHING = 0.06
"""Half the time over which the log is averaged, s."""
_RANGE, _POINTS, _PASSES = 6.0, 121, 6
"""Offsets at which the probability is evaluated: half their range in standard deviations, their number, and how often
range and weights are improved."""
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
    """The relation between the clocks: ``offset`` of the log's time from the video's, s, its standard deviation ``sd``,
    ``shift`` of x by the video from that by the log, m, and their concordance ``correlation``.
    """

    offset: float
    sd: float
    shift: float
    correlation: float

    def to_log(self, time: float | Array) -> Array:
        """Times of the log, s, from times of the video."""
        return np.asarray(time + np.float64(self.offset))


def read_log(path: Path, columns: Sequence[str] | None = None) -> RobotLog:
    """Read the robot's log, a table ``t,x,z``, s and m; InvalidInputError: no such table, or times that go back.

    ``columns``: names or numbers of the columns t, x and z where the table calls them otherwise.
    """
    table = read_table("robot_log", path, "t,x,z", (2, MAX_ROWS), columns)
    time, x, z = table.numbers().T
    table.check_increasing(time)
    return RobotLog(time, x, z)


def middle_speed(time: Array, x: Array) -> float:
    """Speed, m/s, in the middle half of a motion along x, shape (n,), m."""
    away = np.abs(x - x[0])
    first, last = (int(np.argmax(away >= share * away.max())) for share in (0.25, 0.75))
    return float((away[last] - away[first]) / (time[last] - time[first])) if last > first else 0.0


def synchronise(
    time: Array,
    x: Array,
    sd: float,
    log: RobotLog,
    mapping_sd: float,
    pixel: float,
    predicted: bool = False,
    source: str = "robot_log",
    offset_sd: float = 0.0,
) -> Clock:
    """Estimate the offset between the clocks.

    ``time``, shape (n,), s, is the exposure of the gripper in each frame by the camera's clock, without frames that
    repeat the one before; ``x``, shape (n,), m, that of the gripped end by the video, with noise of at least ``sd``.
    ``mapping_sd`` and ``offset_sd`` are standard deviations of errors of x, m: that of the mapping, and one that is the
    same all along the gripper's way.  ``pixel``: width of a pixel at the gripper, m.  ``predicted``: whether frames are
    compressed, with loss, by prediction from others: moving things then lag in them.  ``source``: the log's name.

    Raises SynchronisationError: the gripper does not move, or video and log do not show the same motion.
    """
    by_video, by_log = float(np.ptp(x)), float(np.ptp(log.x))
    if len(time) < 10 or min(by_video, by_log) < _AT_REST * sd:
        found = f"x changes by {by_video * 1e3:.2f} mm in the video and {by_log * 1e3:.2f} mm in the log"
        raise SynchronisationError(source, found, f"a motion of at least {_AT_REST * sd * 1e3:.2g} mm", _ADVICE)
    slow, smooth = middle_speed(time, x), _smoothed(log)
    offset, step = _rough_offset(time, x, smooth, sd / float(np.hypot(mapping_sd, offset_sd)))
    moments = time + offset
    overlap = (moments >= log.time[0]) & (moments <= log.time[-1])
    if overlap.sum() < MIN_FRAMES:
        raise SynchronisationError(
            source, f"a log of {np.ptp(log.time):.3g} s", f"{MIN_FRAMES} frames or more", _ADVICE
        )
    time, x, place = time[overlap], x[overlap], np.interp(moments[overlap], smooth.time, smooth.x)
    spread = float(np.var(x) + np.var(place))
    correlation = 1.0 - float(np.var(x - place)) / spread if spread > 0.0 else 0.0
    if correlation < MIN_CORRELATION:
        found, advice = f"x by the log and by the video have a correlation of {correlation:.4f} only", _ADVICE
        if slow and (slower := middle_speed(log.time, log.x) / slow) > SLOW:
            found, advice = f"the gripper is {slower:.3g} times as fast by the log as in the video", SLOW_MOTION
        raise SynchronisationError(source, found, f"one motion, with a correlation of {MIN_CORRELATION}", advice)
    # A log of another origin must stay one: no offset may explain what the mapping cannot.
    mean = abs(float(np.mean(x - place)))
    if mean > PLAUSIBLE * np.hypot(mapping_sd, offset_sd):
        mapping_sd, offset_sd = mean / PLAUSIBLE, 0.0
    shift_sd = float(np.hypot(mapping_sd, offset_sd))
    lag_sd, same = LAG_SD * pixel * predicted, REPEATED * pixel
    offset, clock_sd, shift = _fine_offset(time, x, sd, smooth, mapping_sd, shift_sd, lag_sd, same, offset, step)
    return Clock(offset, clock_sd, shift, correlation)


def _smoothed(log: RobotLog) -> RobotLog:
    """The log with means of neighbouring rows, of the times too: a steady advance stays one at uneven times."""
    half = min(int(SMOOTHING / float(np.median(np.diff(log.time)))), (len(log.time) - 1) // 4)
    if half < 1:
        return log
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))

    def mean(values: Array) -> Array:
        # Relative to the first: times may be seconds since 1970.
        inner = values[0] + np.convolve(values - values[0], kernel, "valid")
        return np.concatenate([values[:1], inner, values[-1:]])

    return RobotLog(mean(log.time), mean(log.x), mean(log.z))


def _cost(time: Array, x: Array, log: RobotLog, ratio: float, offsets: Array) -> Array:
    """Mean squared residual with the most probable shift, shape (m,); infinite where too little overlaps.

    ``ratio`` is the standard deviation of x over that of the shift.
    """
    moments = time + offsets[:, None]
    overlap = (moments >= log.time[0]) & (moments <= log.time[-1])
    residual = np.where(overlap, x - np.interp(moments, log.time, log.x), 0.0)
    n = overlap.sum(axis=1)
    squares = (residual**2).sum(axis=1) - residual.sum(axis=1) ** 2 / (np.maximum(n, 1) + ratio**2)
    least = MIN_OVERLAP * min(1.0, np.ptp(log.time) / np.ptp(time)) * len(time)
    return np.where(n >= max(least, MIN_FRAMES), squares / np.maximum(n, 1), np.inf)


def _rough_offset(time: Array, x: Array, log: RobotLog, ratio: float) -> tuple[float, float]:
    """The offset with the least cost, s, by a grid search over all overlaps, and within what it may be wrong, s."""
    period = float(np.median(np.diff(time)))
    every = -(-len(time) // _MAX_FRAMES)
    t, some_x = time[::every], x[::every]
    low, high = log.time[0] - t[-1], log.time[-1] - t[0]
    offsets = np.linspace(low, high, min(_MAX_OFFSETS, int((high - low) / (every * period)) + 2))
    parts = np.array_split(offsets, -(-len(offsets) // 100))  # bounds the memory
    offset = float(offsets[np.argmin(np.concatenate([_cost(t, some_x, log, ratio, part) for part in parts]))])
    return offset, max(float(offsets[1] - offsets[0]), period)


def _fine_offset(
    time: Array,
    x: Array,
    sd: float,
    log: RobotLog,
    mapping_sd: float,
    shift_sd: float,
    lag_sd: float,
    same: float,
    offset: float,
    step: float,
) -> tuple[float, float, float]:
    """Mean and standard deviation of the offset, s, and the shift, m, from a rough offset known within ``step``.

    ``shift_sd`` is that of an error that all x share, ``mapping_sd`` that of the part of it with a slope and a bend,
    ``lag_sd`` that of the lag of a moving marker, m.  Frames whose x differ by less than ``same``, m, count as one.
    """
    # By how much smoothing rounds the log's sudden starts and stops.
    twice = _smoothed(log)
    ordered = np.sort(x)
    repeats = np.searchsorted(ordered, x + 0.5 * same, "right") - np.searchsorted(ordered, x - 0.5 * same)
    along = 2.0 * (x - x.min()) / np.ptp(x) - 1.0
    errors = np.column_stack([np.ones_like(x), along, 1.5 * along**2 - 0.5, np.zeros_like(x)])
    known = 1.0 / (mapping_sd * np.array([shift_sd / mapping_sd, SLOPE_SHARE, BEND_SHARE, 1.0])) ** 2
    speed = np.gradient(twice.x, twice.time)
    speed /= np.abs(speed).max()
    offset_sd = step
    for _ in range(_PASSES):
        # In units of the mapping's error, so that a lag of 0 is one that changes nothing.
        errors[:, 3] = lag_sd / mapping_sd * np.interp(time + offset, twice.time, speed)
        residual = x - np.interp(time + offset, log.time, log.x)
        weight, noise = _weights(residual, errors, known, sd)
        rounded = np.interp(time + offset, log.time, log.x) - np.interp(time + offset, twice.time, twice.x)
        weight /= repeats * (1.0 + (rounded / noise) ** 2)
        offsets = offset + offset_sd * np.linspace(-_RANGE, _RANGE, _POINTS)
        residuals = np.array([x - np.interp(time + value, log.time, log.x) for value in offsets])
        # Of the errors of the mapping only the most probable ones: what others add does not depend on the offset.
        normal = errors.T @ (weight[:, None] * errors) + np.diag(known) * noise**2
        mixed = (residuals * weight) @ errors
        squares = (residuals**2) @ weight - np.sum(mixed * np.linalg.solve(normal, mixed.T).T, axis=1)
        probability = np.exp(-0.5 * (squares - squares.min()) / noise**2)
        probability /= probability.sum()
        offset = float(probability @ offsets)
        # Never narrower than the spacing of the offsets: the next pass has a finer one.
        offset_sd = max(float(np.sqrt(probability @ (offsets - offset) ** 2)), offsets[1] - offsets[0])
    residual = x - np.interp(time + offset, log.time, log.x)
    return offset, offset_sd, float(np.linalg.solve(normal, errors.T @ (weight * residual))[0])


def _weights(residual: Array, errors: Array, known: Array, sd: float) -> tuple[Array, float]:
    """Weights of the frames, shape (n,), and the noise, m, of one that is independent of the others."""
    weight = np.ones_like(residual)
    noise = float(np.std(residual))
    for _ in range(10):
        normal = errors.T @ (weight[:, None] * errors) + np.diag(known) * noise**2
        rest = residual - errors @ np.linalg.solve(normal, errors.T @ (weight * residual))
        noise = max(sd, 1.4826 * float(np.median(np.abs(rest))))
        weight = 1.0 / np.maximum(np.abs(rest) / (OUTLIER * noise), 1.0) ** 2
    limit = OUTLIER * noise
    return weight, noise * float(np.sqrt(_correlation_length(np.clip(rest, -limit, limit))))


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

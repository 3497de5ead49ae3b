"""lambda_c from a recording, with its uncertainty: the event, and the end of the quasi-static branch.

lambda is the gripper's advance past the place where its end of the strip lay flat.  It is taken from the robot's log,
at the event's time by the video, where there is a log; from the video otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import MeasurementError
from stripfold.vision import clock, snap
from stripfold.vision.calibration import Calibration, calibrate_folder
from stripfold.vision.clock import Clock, RobotLog
from stripfold.vision.override import Override
from stripfold.vision.recording import Recording
from stripfold.vision.snap import Speed, StaticFit
from stripfold.vision.strip_tracker import TRACKED_SHARE
from stripfold.vision.tracking import Tracks, track

DRAWS = 200
"""Draws of the mapping and of the noise."""
SEED = 20180601
COVERED = 1.96
"""Half width of a 95 % interval in standard deviations."""
Z_DRIFT = 0.002
"""How far the gripper's height may drift, m, before it is flagged."""
Z_OFF = 0.05
"""How far it may be from the description, as a share of the height."""
SPEED_OFF = 0.2
"""How far the speed may be from the description before it is flagged, as a share."""
LENGTH_OFF = 0.02
"""How far the measured length may be from the strip's before it is flagged, as a share."""
PLACES_DIFFER = 3.0
"""How far x by the log and by the video may differ at the event, in standard deviations, before it is flagged."""
UNDECIDED = 1.3
"""Peak of the speed over that of following from which a snap cannot be ruled out."""
UNTOLD = 0.4
"""Standard deviation of the onset's time from which it is not told, s."""
LEVEL = 0.2
"""Standard deviation of the level of the onset, as a share of its height: the layers hide each other at the peak."""
BETWEEN = 0.2
"""Standard deviation of a moment between two frames, as a share of the time between them."""
MISSING = 1.5
"""Time between the frames around the event, in usual ones, from which frames are missing there."""
FEWEST_FRAMES = 10
FEWEST_STATIONS = 5
AROUND = 0.5
"""Half the time over which the gripper's way is fitted, s."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """What a recording says; lengths in m, times in s by the video's clock.

    Attributes
    ----------
    snapped
        Whether there was a snap; without one ``event`` is a lower bound of lambda, the farthest that the gripper got.
    event_time, event
        When the snap sets in, and lambda then.
    sd
        Standard deviation of ``event``, from all of ``parts``.
    parts
        Its parts: ``shape`` (noise of the strip's points), ``level`` (how well the peak of the speed is known),
        ``frames`` (what happens between frames), ``mapping``, ``gripper``, ``clock``.
    by_video, by_log
        lambda from the video alone and from the log; nan where there is none.
    static
        The end of the quasi-static branch; None where it does not bend enough to tell.
    speed
        Of the gripper around the event, m/s.
    flags
        What a user should know, in words; empty where all is well.
    manual
        Whether the event was set by hand.
    """

    recording: Recording
    calibration: Calibration
    tracks: Tracks
    motion: Speed
    clock: Clock | None
    snapped: bool
    event_time: float
    event: float
    sd: float
    parts: dict[str, float]
    by_video: float
    by_log: float
    static: StaticFit | None
    speed: float
    flags: tuple[str, ...]
    manual: str

    @property
    def interval(self) -> tuple[float, float]:
        """Of 95 %, m."""
        return self.event - COVERED * self.sd, self.event + COVERED * self.sd


def measure(recording: Recording, progress: Callable[[str], None] | None = None) -> Measurement:
    """Measure a recording.

    Raises
    ------
    InvalidInputError
        A file that cannot be read.
    MeasurementError
        Files that can be read but not measured: see its subclasses.
    """
    say = progress or (lambda _: None)
    say("calibrating")
    calibration = calibrate_folder(recording.folder, recording.entries)
    tracks = track(recording, calibration, say)
    say("measuring")
    return evaluate(recording, calibration, tracks, Override.read(recording))


def evaluate(recording: Recording, calibration: Calibration, tracks: Tracks, override: Override | None) -> Measurement:
    """The numbers of a recording whose film has been followed; see :func:`measure`."""
    gripper = recording.entries["gripper"]
    random = np.random.default_rng(SEED)
    flags = [*tracks.report.problems, *tracks.timing.problems]
    _check_height(recording, tracks, flags)
    flags += _of_length(recording, tracks)
    motion = snap.speed(*_raised(recording, tracks))
    shift = _shift_of(calibration, tracks, random)
    log = _log(recording)
    synchronised = None
    if log is not None:
        noise = float(np.median(tracks.gripper.sd[:, 0])) * calibration.quality["resolution"]
        synchronised = clock.synchronise(tracks.grip_time, tracks.place[:, 0], noise, log, float(shift.std()))
    snapped = motion.ratio >= snap.LEAST_RATIO and np.isfinite(motion.onset)
    if not snapped and override is None and motion.ratio > UNDECIDED:
        raise MeasurementError(
            "video",
            f"a strip that moves at most {motion.ratio:.1f} times as fast as it followed its gripper",
            f"{snap.LEAST_RATIO:g} times or more where it snaps, {UNDECIDED:g} times or less where it does not",
            "move the gripper more slowly, or give override.yaml",
        )
    moment = motion.onset if snapped else float(tracks.grip_time[-1])
    if override is not None:
        moment, snapped = override.event_time, True
    if not tracks.grip_time[0] <= moment <= tracks.grip_time[-1]:
        raise MeasurementError("override.yaml", f"an event at {moment:g} s", "a time within the film")
    flags += _of_snap(motion, tracks, moment) if snapped else []
    sign, flat_end = gripper["direction"], gripper["flat_end"]
    x, v, gripper_sd = _way(tracks, moment)
    by_video, by_log = sign * (x - flat_end), float("nan")
    parts = {
        "shape": 0.0,
        "level": 0.0,
        "frames": 0.0,
        "mapping": float(shift.std()),
        "gripper": gripper_sd,
        "clock": 0.0,
    }
    if snapped and override is None:
        spread = onset_spread(recording, tracks, random)
        if spread > UNTOLD:
            raise MeasurementError(
                "video",
                f"a strip whose motion lets the onset lie anywhere within {4.0 * spread:.2f} s",
                f"within {4.0 * UNTOLD:.1f} s",
                "light the strip better, move more slowly, or give override.yaml",
            )
        gap = tracks.timing.spacing(moment)
        parts["shape"] = abs(v) * spread
        parts["level"] = abs(v) * motion.slack(LEVEL)
        parts["frames"] = abs(v) * _between_frames(gap, tracks.timing.period)
    elif override is not None:
        parts["shape"] = abs(v) * override.sd
    event = by_video
    if synchronised is not None and log is not None:
        by_log = sign * (float(np.interp(synchronised.to_log(moment), log.time, log.x)) - flat_end)
        difference = by_log - by_video
        allowed = PLACES_DIFFER * hypot(parts["mapping"], abs(v) * synchronised.sd, gripper_sd)
        if abs(difference) > allowed:
            flags.append(f"log and video differ by {difference * 1e3:.2f} mm at the event")
        event = by_log
        # The log's place needs no mapping, but the clocks were brought together with it.
        parts |= {"mapping": 0.0, "gripper": 0.0, "clock": abs(v) * synchronised.sd}
    if abs(abs(v) / gripper["speed"] - 1.0) > SPEED_OFF:
        flags.append(f"the gripper moves at {abs(v) * 1e3:.2f} mm/s, described are {gripper['speed'] * 1e3:.2f}")
    if not snapped:
        flags.append("no snap: lambda_c lies beyond the farthest place of the gripper")
    return Measurement(
        recording,
        calibration,
        tracks,
        motion,
        synchronised,
        bool(snapped),
        float(moment),
        float(event),
        float(np.sqrt(sum(part**2 for part in parts.values()))),
        {name: float(part) for name, part in parts.items()},
        float(by_video),
        by_log,
        _static(recording, tracks, motion) if snapped else None,
        abs(v),
        tuple(flags),
        "" if override is None else override.reason,
    )


def onset_spread(recording: Recording, tracks: Tracks, random: np.random.Generator) -> float:
    """Standard deviation of the onset's time from the noise of the strip's points, s: a wild bootstrap by frames."""
    t, points = _raised(recording, tracks)
    smooth = _smoothed(points)
    # Of the frames before the snap, where three neighbours are on a line: they leave 2/3 of the variance.
    before = np.flatnonzero(t < max(snap.speed(t, points).onset - snap.WINDOW, t[FEWEST_FRAMES - 1]))
    noise = (points - smooth)[before] * np.sqrt(1.5)
    onsets = []
    for _ in range(DRAWS // 4):
        signs = random.choice([-1.0, 1.0], len(t))[:, None, None]
        onset = snap.speed(t, smooth + signs * noise[random.integers(0, len(noise), len(t))]).onset
        if np.isfinite(onset):
            onsets.append(onset)
    return float(np.std(onsets)) if len(onsets) > 2 else float(np.ptp(t))


def _smoothed(points: Array) -> Array:
    """Mean of each frame and its two neighbours; the first and last as they are."""
    smooth = points.copy()
    smooth[1:-1] = (points[:-2] + points[1:-1] + points[2:]) / 3.0
    return smooth


def _between_frames(gap: float, period: float) -> float:
    """Standard deviation of a moment between two frames, s: little where they are as near as usual."""
    usual = BETWEEN * min(gap, period)
    return hypot(usual, max(gap - period, 0.0) / np.sqrt(12.0))


def _raised(recording: Recording, tracks: Tracks) -> tuple[Array, Array]:
    """Times, shape (n,), and points, shape (n, k, 2), of the part that is raised at first, while the gripper moves."""
    start, stop = snap.underway(tracks.grip_time, tracks.place[:, 0])
    seen = tracks.seen & (tracks.strip_time >= start) & (tracks.strip_time <= stop)
    points = tracks.points[seen]
    if len(points) < FEWEST_FRAMES:
        raise MeasurementError(
            "video", f"the strip in {len(points)} frames", f"at least {FEWEST_FRAMES}", "film longer"
        )
    chosen = snap.raised(points, tracks.stations, recording.entries["gripper"]["height"])
    if chosen.sum() < FEWEST_STATIONS:
        raise MeasurementError(
            "video",
            f"a strip of which {tracks.stations[int(chosen.sum())] * 1e3:.0f} mm are raised in the first frames",
            "a loop over the lying part",
            "film from before the snap on, from the side",
        )
    return tracks.strip_time[seen], points[:, chosen]


def _way(tracks: Tracks, moment: float) -> tuple[float, float, float]:
    """x of the gripped end at a moment, m, its speed, m/s, and the standard deviation of x."""
    near = np.abs(tracks.grip_time - moment) <= AROUND
    near &= tracks.gripper.tracked
    if near.sum() < 4:
        near = np.argsort(np.abs(tracks.grip_time - moment)) < 6
    t, x = tracks.grip_time[near] - moment, tracks.place[near, 0]
    (v, at), residuals, *_ = np.polyfit(t, x, 1, full=True)
    n = int(near.sum())
    noise = float(np.sqrt(residuals[0] / max(n - 2, 1))) if len(residuals) else 0.0
    return float(at), float(v), noise / np.sqrt(n)


def _shift_of(calibration: Calibration, tracks: Tracks, random: np.random.Generator) -> Array:
    """x of the middle of the gripper's way by draws of the mapping, minus the best estimate; shape (draws,), m."""
    middle = tracks.gripper.centre[len(tracks.gripper.centre) // 2][None]
    best = calibration.mapping.to_robot(middle)[0, 0]
    return np.array([calibration.resample(random).to_robot(middle)[0, 0] - best for _ in range(DRAWS)])


def _static(recording: Recording, tracks: Tracks, motion: Speed) -> StaticFit | None:
    gripper = recording.entries["gripper"]
    limit = motion.following + snap.FIT_BELOW * (motion.u[motion.peak] - motion.following)
    slow = np.flatnonzero(motion.u[: motion.peak] < limit)
    if not len(slow):
        return None
    before = tracks.seen & (tracks.strip_time < motion.t[slow[-1]])
    lam = gripper["direction"] * (tracks.place[:, 0] - gripper["flat_end"])
    return snap.static_fit(lam[before], tracks.points[before])


def _log(recording: Recording) -> RobotLog | None:
    path = recording.file("robot_log")
    return None if path is None else clock.read_log(path)


def _check_height(recording: Recording, tracks: Tracks, flags: list[str]) -> None:
    height = recording.entries["gripper"]["height"]
    z = tracks.place[tracks.gripper.tracked, 1]
    middle, drift = float(np.median(z)), float(np.ptp(np.percentile(z, [2.0, 98.0])))
    if abs(middle - height) > Z_OFF * height:
        raise MeasurementError(
            "recording.yaml",
            f"gripper.height = {height:g} m, the video shows {middle:.4f} m",
            f"a height within {Z_OFF:.0%} of the description",
            "is z of the robot 0 on the table, and gripper.marker.offset right?",
        )
    if drift > Z_DRIFT:
        flags.append(f"the gripper's height drifts by {drift * 1e3:.1f} mm")


def _of_length(recording: Recording, tracks: Tracks) -> list[str]:
    length, seen = recording.entries["strip"]["length"], float(np.nanmedian(tracks.visible))
    if tracks.whole and seen < (TRACKED_SHARE - LENGTH_OFF) * length:
        return [f"{seen * 1e3:.1f} mm of the strip are seen, its length is {length * 1e3:.1f} mm"]
    return []


def _of_snap(motion: Speed, tracks: Tracks, moment: float) -> list[str]:
    flags = []
    if tracks.timing.spacing(moment) > MISSING * tracks.timing.period:
        flags.append("frames are missing at the event: its interval is wider for it")
    if motion.several:
        flags.append("there are several bursts of speed: the first is taken for the snap")
    if motion.ratio < 2.0 * snap.CLEAR_RATIO:
        flags.append(
            f"too fast: the strip snaps only {motion.ratio:.1f} times as fast as it followed its gripper; move slower"
        )
    if motion.t[motion.peak] > motion.t[-1] - snap.WINDOW:
        flags.append("the film ends within the snap")
    lost = ~tracks.seen & (np.abs(tracks.timing.time - moment) < snap.WINDOW)
    if lost.any():
        flags.append("the strip is lost in frames at the event")
    return flags

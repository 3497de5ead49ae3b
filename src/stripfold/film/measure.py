"""lambda_c from a recording at the onset of the snap, with its uncertainty.

lambda is the gripper's advance past the place where its end of the strip lay flat.  It is read from the robot's log at
the time of the event, or from the video where there is no log.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import hypot, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold.base.arguments import checked, file_name
from stripfold.base.arrays import Array
from stripfold.base.errors import MISSING, InvalidInputError, MeasurementError
from stripfold.files import schema, store
from stripfold.files.reporting import Progress, Result, Rows
from stripfold.film import eta_motion, fitted, snap, video
from stripfold.film import recording as recordings
from stripfold.film.calibration import calibrate_folder
from stripfold.film.camera_motion import FIRST, Shift
from stripfold.film.clock import Clock, read_log, synchronise
from stripfold.film.eta_motion import ModelValue, MotionEtaB, model_value
from stripfold.film.pictures import one_thread
from stripfold.film.recording import DEVIATIONS, SD_95, ManualOnset, Recording, compare, half_width
from stripfold.film.snap import Speed
from stripfold.film.tracking import MIN_FRAMES, TRACKED_SHARE, Mapped, Tracks, track

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

PARTS = ("level", "frames", "mapping", "camera", "gripper", "clock", "flat_end", "offset", "manual")
"""Causes of uncertainty: peak and rise of the strip's speed, time between frames, calibration, motion of the camera
since then, noise of the marker, synchronisation of the clocks, described flat end and offset, onset set by hand."""
WARNING, NOTE = "warning", "note"
"""Severities of a flag: the value or its interval is affected; for information."""
DRAWS = 200
"""Samples of the mapping."""
SEED = 20180601
MAX_NO_SNAP_RATIO = 1.3
"""Peak of the speed over that of following from which a snap cannot be ruled out."""
MIN_STATIONS = 5
FIT_WINDOW = 0.3
"""Half the time over which the gripper's motion is fitted, s."""
MAX_HEIGHT_DRIFT, MAX_SPEED_ERROR, MAX_LENGTH_ERROR = 0.002, 0.1, 0.02
"""Limits of the quality flags: drift of the gripper's height, m; speed and length off the description, as a share."""
MAX_LOG_ERROR = 0.005
"""Difference of lambda by the log and by the video, m, from which on they do not belong together."""
CLEAR_SNAP = 2.0
"""Least peak of the speed over that of following, below which lambda depends much on the peak."""


class Flag(NamedTuple):
    """What a user should know about a result."""

    severity: str
    text: str

    def __str__(self) -> str:
        return f"{self.severity}: {self.text}"


class Trial(NamedTuple):
    """One advance of the gripper in a film of several: when it begins, s; as in :class:`RecordingMeasurement`, and why
    nothing was measured, empty where it was.
    """

    begin: float
    snapped: bool = False
    event: float = nan
    sd: float = nan
    event_time: float = nan
    reason: str = ""

    def __str__(self) -> str:
        if self.reason:
            return f"from {self.begin:.2f} s on: not measured, {self.reason}"
        value = f"λ = {1e3 * self.event:.2f} mm, SD {1e3 * self.sd:.2f} mm, at {self.event_time:.2f} s"
        return f"from {self.begin:.2f} s on: {value if self.snapped else f'no snap up to {1e3 * self.event:.2f} mm'}"


@dataclass(frozen=True, eq=False, repr=False)
class RecordingMeasurement(Result):
    """lambda at the onset of the snap in a recording, with its uncertainty; lengths in m, times in s of the video.

    Source: docs/measuring.md.

    Attributes
    ----------
    recording, calibration, tracks
        What was measured, the mapping from its pixels, the motion in its film.
    motion, clock
        Speed of the strip; the robot's clock against the video's, None without a log.
    snapped, event_time, event
        Whether there was a snap, its onset, and lambda then; without a snap ``event`` is a lower bound: the farthest
        advance of the gripper.
    parts
        Standard deviations of ``event`` by cause, see :data:`PARTS`.
    by_video, by_log
        lambda at the event from the video alone and from the log; nan without a log.
    speed
        Of the gripper around the event, m/s.
    model, eta_b
        lambda_c of the model for the described strip; eta_b of the strip by its motion, or why there is none.
    flags, manual
        Warnings, where the value or its interval is affected, then notes, empty where all is well; why the onset was
        set by hand, empty where it was not.
    trials
        What each advance of the gripper gives where there are several; the result is the first one with a snap.
    """

    recording: Recording
    calibration: Mapped
    tracks: Tracks
    motion: Speed
    clock: Clock | None
    snapped: bool
    event_time: float
    event: float
    parts: dict[str, float]
    by_video: float
    by_log: float
    speed: float
    model: ModelValue
    eta_b: MotionEtaB | MeasurementError
    flags: tuple[Flag, ...]
    manual: str
    trials: tuple[Trial, ...]
    shown = ("snap", "lambda_event", "interval")

    @classmethod
    @one_thread()
    def of(cls, folder: str | os.PathLike[str], progress: Progress | None = None) -> RecordingMeasurement:
        """Measure the recording in a folder; see :func:`measure`."""
        asked, say = recordings.read(folder), progress or (lambda _: None)
        say("calibrating")
        calibration = calibrate_folder(asked.folder, asked.entries, video.shown(asked.video, asked.timestamps))
        tracks = track(asked, calibration, say)
        say("measuring")
        return evaluate(asked, calibration, tracks, asked.manual_onset())

    @property
    def snap(self) -> bool:
        """Whether there was a snap; without one ``lambda_event`` is the largest lambda, a lower bound."""
        return self.snapped

    @property
    def lambda_event(self) -> float:
        """lambda at the onset of the snap, m."""
        return self.event

    @property
    def sd(self) -> float:
        """Standard deviation of ``lambda_event``, m."""
        return hypot(*self.parts.values())

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of ``lambda_event``, m."""
        half = half_width(0.95) * self.sd
        return self.event - half, self.event + half

    def numbers(self) -> dict[str, float]:
        """The numbers of the result by their names in files; lengths in m, times in s."""
        low, high = self.interval
        return {
            "lambda_event": self.event,
            "lambda_low": low,
            "lambda_high": high,
            "event_time": self.event_time,
            "lambda_video": self.by_video,
            "lambda_log": self.by_log,
            "lambda_model": self.model.without_friction,
            "lambda_model_low": self.model.low,
            "lambda_model_high": self.model.high,
            "lambda_model_friction": self.model.with_friction,
            **eta_motion.numbers(self.eta_b),
        }

    def rows(self) -> Rows:
        from stripfold.film import report

        trials = [(f"advance {i}", str(trial)) for i, trial in enumerate(self.trials, 1)]
        return [("result", report.result(self)), *trials, *report.rows(self), *self.flags]

    def __str__(self) -> str:
        return "\n".join(f"{name:<36} {text}" for name, text in self.rows())

    def to_dict(self) -> dict[str, Any]:
        return {
            "snap": self.snapped,
            **self.numbers(),
            "speed": self.speed,
            "flags": [flag._asdict() for flag in self.flags],
            "manual_onset": self.manual,
            "trials": [trial._asdict() for trial in self.trials],
            "synthetic": self.recording.entries.synthetic,
        }

    def to_dataset(self) -> xr.Dataset:
        """Over ``t`` (frames), ``moment`` (of the speed), ``station`` (along the strip); scalars for the result."""
        entries, tracks, motion = self.recording.entries, self.tracks, self.motion
        scalars = {
            **self.numbers(),
            "lambda_sd": self.sd,
            **{f"sd_{name}": sd for name, sd in self.parts.items()},
            "snapped": int(self.snapped),
            "gripper_speed": self.speed,
            "speed_ratio": motion.ratio,
            "following": motion.following,
            "clock_offset": self.clock.offset if self.clock else nan,
            "gripper_height": entries.gripper.height,
            "eta_b": entries.strip.eta_b,
            "length": entries.strip.length,
        }
        values: schema.Values = {name: ((), value) for name, value in scalars.items()} | {
            "t": ("t", tracks.timing.time),
            "x": ("t", tracks.gripped_end[:, 0]),
            "z": ("t", tracks.gripped_end[:, 1]),
            "gripper_seen": ("t", tracks.gripper.tracked.astype("int8")),
            "gripper_score": ("t", tracks.gripper.score),
            "strip_score": ("t", tracks.score),
            "moment": ("moment", motion.t),
            "speed": ("moment", motion.u),
            "station": ("station", tracks.stations),
            "axis": ("axis", ["x", "z"]),
            "strip": (("t", "station", "axis"), tracks.points.astype("float32")),
        }
        attrs = {
            "title": f"measured: {entries.title}",
            "recording": entries.title,
            "synthetic": int(entries.synthetic),
            "flags": "; ".join(map(str, self.flags)),
            "manual_onset": self.manual,
            **{f"calibration_{name}": value for name, value in self.calibration.quality.items()},
        }
        ends = {axis: schema.Variable("m", f"{axis} of the gripped end by the video") for axis in ("x", "z")}
        return schema.dataset(values, attrs, table=schema.variables() | ends)

    def plot(self) -> Figure:
        """Gripper, speed of the strip and confidence over time."""
        from stripfold.film import report

        return report.figure_of(self)

    def to_netcdf(self, file: str | os.PathLike[str]) -> None:
        entries = self.recording.entries
        config = entries.model_dump(mode="json", exclude_none=True)
        store.write(self.to_dataset(), file, title=f"measured: {entries.title}", config=config)

    def report(self, file: str | os.PathLike[str]) -> None:
        """Write one HTML page with film, curves and numbers."""
        from stripfold.film import report

        store.write_text(report.html(self), file)


@checked
def measure(
    recording: str | os.PathLike[str],
    *,
    length: float | None = None,
    eta_b: float | None = None,
    width: float | None = None,
    camera: str | os.PathLike[str] | None = None,
    plate_width: float | None = None,
    progress: Progress | None = None,
) -> RecordingMeasurement:
    """Measure lambda at the onset of the snap in a recording, with its uncertainty (docs/measuring.md).

    Parameters
    ----------
    recording
        A folder with recording.yaml, the film and the calibration, or a film with the plate in view.
    length, eta_b, width
        Of the strip in a film with the plate, m, m^-4 s^2 and m: its length, and, if known, its eta_b, for the model's
        lambda_c, which else is that of the eta_b by the motion, and its width.
    camera
        File of that film's camera, as `stripfold calibrate` writes it; without it the lens is a part of the
        uncertainty.
    plate_width
        Width of the ten squares of that film's plate by a ruler, m: 0.24, but for the printer.
    progress
        Called with a line on what is being done.

    Raises
    ------
    InvalidInputError
        A file that cannot be read, or an entry that cannot be used.
    MeasurementError
        The files can be read but not measured.
    """
    path = file_name("recording", recording)
    given = {"length": length, "eta_b": eta_b, "width": width, "camera": camera, "plate_width": plate_width}
    if not os.path.exists(path):
        allowed = "a film with the plate in view, or a folder with recording.yaml"
        raise InvalidInputError("recording", str(recording), allowed, "there is no such file or folder")
    if not Path(path).is_file():
        for key, value in given.items():
            if value is not None:
                raise InvalidInputError(
                    key, value, "this only together with a film with the plate", "in recording.yaml"
                )
        return RecordingMeasurement.of(path, progress)
    from stripfold.film import phone

    if length is None:
        raise InvalidInputError("length", MISSING, "the length of the strip in a film with the plate, m")
    return phone.of_film(path, length, eta_b, width, camera, plate_width, progress)


def evaluate(
    recording: Recording, calibration: Mapped, tracks: Tracks, manual: ManualOnset | None = None
) -> RecordingMeasurement:
    """The result of a recording whose film has been tracked; see :func:`measure`.

    Of several advances of the gripper the first one with a snap, or else the farthest; the returns do not count.
    """
    parts, time = snap.advances(recording.entries.gripper.direction * tracks.gripped_end[:, 0]), tracks.grip_time
    if manual is not None:
        parts = [part for part in parts if time[part.start] <= manual.event_time <= time[part.stop - 1]]

    def advance(part: slice) -> RecordingMeasurement:
        with tracks.camera.blamed():
            return _evaluate(recording, calibration, tracks, tracks.during(part), manual)

    return of_trials(time, parts or [slice(0, len(time))], advance)


def of_trials(
    time: Array, parts: Sequence[slice], measured: Callable[[slice], RecordingMeasurement]
) -> RecordingMeasurement:
    """The first of the trials with a snap, or else the farthest, with what each gives.

    ``parts``: frames of each, at these times, s.  Raises MeasurementError: none can be measured.
    """
    trials, found, failed = [], [], None
    for part in parts:
        begin = float(time[part.start])
        try:
            one = measured(part)
        except MeasurementError as error:
            failed = failed or error
            trials.append(Trial(begin, reason=error.found))
        else:
            found.append(one)
            trials.append(Trial(begin, one.snapped, one.event, one.sd, one.event_time))
    if failed is not None and not found:
        raise failed
    best = next((one for one in found if one.snapped), max(found, key=lambda one: one.event))
    return replace(best, trials=tuple(trials) if len(trials) > 1 else ())


def _evaluate(
    recording: Recording, calibration: Mapped, whole: Tracks, tracks: Tracks, manual: ManualOnset | None
) -> RecordingMeasurement:
    """The result of one advance, from its ``tracks``; the clocks are those of the ``whole`` film."""
    compare(recording.entries, tracks)
    gripper, pixel = recording.entries.gripper, calibration.quality["resolution"]
    sign, flat_end = gripper.direction, gripper.flat_end
    flat_end_sd, offset_sd = SD_95 * gripper.flat_end_uncertainty, SD_95 * gripper.holder.offset_uncertainty
    flags = [Flag(NOTE, text) for text in (*tracks.report.problems, *tracks.timing.problems)]
    flags += _compared_with_description(recording, tracks)
    t, points = _raised_part(recording, tracks)
    landed = snap.landed(points, gripper.height)
    if tracks.lost is not None and not landed[-1]:
        raise tracks.lost
    motion = snap.speed(t, points)
    mapping_sd = _mapping_sd(calibration, tracks, np.random.default_rng(SEED))
    snapped, time = _event(motion, tracks, manual, landed)
    time_sd = {} if manual is None else {"manual": manual.sd}
    if snapped and manual is None:
        later, time_sd, own = _delay(motion, tracks)
        time, flags = time + later, flags + own
    x, velocity, gripper_sd = _gripper_at(tracks, time)
    camera = _camera_at(calibration, whole, time)
    shown = camera if camera.moved and not whole.camera.moved else whole.camera
    if shown.problem:
        flags.append(Flag(WARNING if shown.moved else NOTE, shown.problem))
    camera_sd = pixel * float(np.nan_to_num(np.hypot(camera.x, camera.y)))
    speed = abs(velocity)
    by_video, by_log = sign * (x - flat_end), nan
    parts = dict.fromkeys(PARTS, 0.0) | {name: speed * sd for name, sd in time_sd.items()}
    noise = float(np.median(tracks.gripper.sd[:, 0])) * pixel
    clock, path = None, recording.robot_log
    if path is None:
        if gripper.template is not None:
            # The noise of the first frame, from which the template is, is the same in all.
            gripper_sd = hypot(gripper_sd, noise)
        parts |= {"mapping": mapping_sd, "camera": camera_sd, "gripper": gripper_sd}
        parts["offset"] = 0.0 if calibration.relative else offset_sd
    else:
        clock, place = _by_log(path, recording, calibration, whole, time, noise, (mapping_sd, offset_sd))
        by_log = sign * (place - flat_end)
        # The log's place needs no mapping, but the clocks were synchronised with it.
        parts["clock"] = speed * clock.sd
        if abs(by_log - by_video) > MAX_LOG_ERROR:
            raise MeasurementError(
                path.name,
                f"lambda by the log is {(by_log - by_video) * 1e3:+.1f} mm from that by the video",
                f"a difference of at most {MAX_LOG_ERROR * 1e3:g} mm",
                "does the log give x of the gripped end, in the coordinates of the robot grid?",
            )
        if abs(by_log - by_video) > half_width(0.95) * hypot(mapping_sd, gripper_sd, offset_sd, *parts.values()):
            flags.append(Flag(WARNING, f"log and video differ by {(by_log - by_video) * 1e3:.2f} mm at the event"))
    parts["flat_end"] = flat_end_sd
    if not snapped:
        flags.append(Flag(NOTE, "no snap: lambda_c lies beyond the farthest place of the gripper"))
    elif abs(speed / gripper.speed - 1.0) > MAX_SPEED_ERROR:
        text = f"the gripper moves at {speed * 1e3:.2f} mm/s, described are {gripper.speed * 1e3:.2f}"
        flags.append(Flag(NOTE, text))
    event = by_video if clock is None else by_log
    place_sd = flat_end_sd, offset_sd, mapping_sd
    mapping, aside = calibration.mapping, calibration.relative
    eta_b = eta_motion.measure(recording, mapping, tracks, event, by_video, snapped, place_sd, aside)
    flags += _flags_of_shapes(recording, eta_b)
    return RecordingMeasurement(
        recording=recording,
        calibration=calibration,
        tracks=whole,
        motion=motion,
        clock=clock,
        snapped=snapped,
        event_time=time,
        event=event,
        parts=parts,
        by_video=by_video,
        by_log=by_log,
        speed=speed,
        model=model_value(recording.entries),
        eta_b=eta_b,
        flags=tuple(sorted(flags, key=lambda flag: flag.severity != WARNING)),
        manual="" if manual is None else manual.reason,
        trials=(),
    )


def _delay(motion: Speed, tracks: Tracks) -> tuple[float, dict[str, float], list[Flag]]:
    """By how much the onset is later than its burst of speed says, s, the standard deviations of that, and flags."""
    period, excess = tracks.timing.period, _missing(tracks, motion)
    gap = fitted.GAP_SHIFT * excess
    sd = {
        "level": hypot(_level_sd(motion), fitted.WINDOW_SD * motion.delay),
        "frames": hypot(fitted.FRAME_SD * period, fitted.GAP_SD * excess),
    }
    later = fitted.FRAME_SHIFT * period + gap - fitted.WINDOW_SHIFT * motion.delay
    return later, sd, _event_flags(motion, excess, gap > hypot(*sd.values()))


def _by_log(
    path: Path,
    recording: Recording,
    calibration: Mapped,
    whole: Tracks,
    time: float,
    noise: float,
    sds: tuple[float, float],
) -> tuple[Clock, float]:
    """The robot's clock, and x of the gripped end by its log at a time of the film, m.

    ``noise``: of the gripper's place in a frame, m.  ``sds``: standard deviations of the mapping and the offset, m.
    """
    mapping_sd, offset_sd = sds
    log = read_log(path, recording.entries.robot_log_columns)
    # A frame that repeats the one before shows the gripper where it was then.
    own = whole.gripper.tracked & ~whole.timing.doubled
    moments, places = whole.grip_time[own], whole.gripped_end[own, 0]
    pixel, predicted = calibration.quality["resolution"], whole.report.predicted
    clock = synchronise(moments, places, noise, log, mapping_sd, pixel, predicted, path.name, offset_sd)
    return clock, float(np.interp(clock.to_log(time), log.time, log.x))


def _flags_of_shapes(recording: Recording, eta_b: MotionEtaB | MeasurementError) -> list[Flag]:
    """What the strip's shapes say of its description."""
    flags, pulls = list[Flag](), eta_b.pulls if isinstance(eta_b, MotionEtaB) else ()
    if text := eta_motion.doubted(eta_b):
        flags.append(Flag(WARNING, text))
    if isinstance(eta_b, MotionEtaB) and (text := eta_b.contradicts(recording.entries.strip)):
        flags.append(Flag(NOTE, text))
    flags += [
        Flag(NOTE, f"{pull}: did the strip slip, or lie in waves?")
        for pull in pulls
        if abs(pull.deviations) > DEVIATIONS
    ]
    if not pulls:
        flags.append(Flag(NOTE, "whether flat_end and offset are right is not known from the strip's shapes"))
    return flags


def _compared_with_description(recording: Recording, tracks: Tracks) -> list[Flag]:
    """Flags where the film differs from its description; see also :func:`.recording.compare`."""
    flags = []
    length = recording.entries.strip.length
    z = tracks.gripped_end[tracks.gripper.tracked, 1]
    drift = float(np.ptp(np.percentile(z, [2.0, 98.0])))
    if drift > MAX_HEIGHT_DRIFT:
        flags.append(Flag(WARNING, f"the gripper's height drifts by {drift * 1e3:.1f} mm"))
    seen = float(np.nanmedian(tracks.visible_length))
    if tracks.complete and seen < (TRACKED_SHARE - MAX_LENGTH_ERROR) * length:
        text = f"{seen * 1e3:.1f} mm of the strip are seen, its length is {length * 1e3:.1f} mm"
        flags.append(Flag(WARNING, text))
    return flags


def _raised_part(recording: Recording, tracks: Tracks) -> tuple[Array, Array]:
    """Times, shape (n,), and points, shape (n, k, 2), of the initially raised part while the gripper advances."""
    advance = recording.entries.gripper.direction * tracks.gripped_end[:, 0]
    start, stop = snap.steady_advance(tracks.grip_time, advance)
    used = tracks.seen & (tracks.strip_time >= start) & (tracks.strip_time <= stop)
    points = tracks.points[used]
    if len(points) < MIN_FRAMES:
        raise MeasurementError("video", f"the strip in {len(points)} frames", f"at least {MIN_FRAMES}", "film longer")
    raised = snap.raised(points, recording.entries.gripper.height)
    if raised.sum() < MIN_STATIONS:
        raise MeasurementError(
            "video",
            f"a strip of which {tracks.stations[int(raised.sum())] * 1e3:.0f} mm are raised in the first frames",
            "a loop over the lying part",
            "film from before the snap on, from the side",
        )
    return tracks.strip_time[used], points[:, raised]


def _event(motion: Speed, tracks: Tracks, manual: ManualOnset | None, landed: tuple[bool, bool]) -> tuple[bool, float]:
    """Whether there was a snap, and the time of its onset; without a snap the end of the film, s.

    Without a burst of speed, a strip that has ``landed``, first or last, lost its stability before the film, or in it.
    """
    if manual is not None:
        if not tracks.grip_time[0] <= manual.event_time <= tracks.grip_time[-1]:
            found = f"an event at {manual.event_time:g} s"
            raise MeasurementError(ManualOnset.file_name, found, "a time within the film")
        return True, manual.event_time
    if motion.ratio >= snap.MIN_RATIO and np.isfinite(motion.onset):
        return True, motion.onset
    if landed[0]:
        raise MeasurementError(
            "video",
            "no snap, and a strip whose upper layer lies on the table in the first frames",
            "a film that begins before the snap",
            "film from about L* before the snap on",
        )
    if motion.ratio > MAX_NO_SNAP_RATIO or landed[-1]:
        raise MeasurementError(
            "video",
            f"too fast: a strip that moves at most {motion.ratio:.1f} times as fast as it followed its gripper",
            f"{snap.MIN_RATIO:g} times or more where it snaps, {MAX_NO_SNAP_RATIO:g} times or less where it does not",
            f"move the gripper more slowly, or give {ManualOnset.file_name}",
        )
    return False, float(tracks.grip_time[-1])


def _level_sd(motion: Speed) -> float:
    """Standard deviation of the onset from its level, s."""
    sd = motion.onset_shift(hypot(fitted.LEVEL_SD, motion.fall, motion.drift))
    if np.isfinite(sd):
        return sd
    raise MeasurementError(
        "video",
        "a strip that is already snapping in the first frames",
        "one that first follows its gripper",
        f"film from before the snap on, or give {ManualOnset.file_name}",
    )


def _missing(tracks: Tracks, motion: Speed) -> float:
    """By how much the longest time between pictures of the strip from the onset to the peak exceeds the usual, s."""
    seen = tracks.strip_time[tracks.seen]
    first = max(int(np.searchsorted(seen, motion.onset, side="right")), 1)
    last = int(np.searchsorted(seen, motion.t[motion.peak])) + 1
    return max(float(np.diff(seen[first - 1 : last]).max(initial=0.0)) - tracks.timing.period, 0.0)


def _gripper_at(tracks: Tracks, time: float) -> tuple[float, float, float]:
    """x of the gripped end, m, its velocity, m/s, and the standard deviation of x."""
    near = (np.abs(tracks.grip_time - time) <= FIT_WINDOW) & tracks.gripper.tracked
    if near.sum() < 4:
        near = np.argsort(np.argsort(np.abs(tracks.grip_time - time))) < 6
    (velocity, x), residuals, *_ = np.polyfit(tracks.grip_time[near] - time, tracks.gripped_end[near, 0], 1, full=True)
    n = int(near.sum())
    noise = float(np.sqrt(residuals[0] / max(n - 2, 1))) if len(residuals) else 0.0
    return float(x), float(velocity), noise / float(np.sqrt(n))


def _camera_at(calibration: Mapped, tracks: Tracks, time: float) -> Shift:
    """Shift of the picture at the gripper since the robot's stops, at some time, s."""
    frame = int(np.searchsorted(tracks.timing.time, time))
    small = tracks.thumbnails
    first = int(np.clip(frame // small.every - FIRST // 2, 0, max(len(small.pictures) - FIRST, 0)))
    place = tracks.gripper.centre[min(frame, len(tracks.gripper.centre) - 1)]
    return calibration.shift(small, slice(first, first + FIRST), place)


def _mapping_sd(calibration: Mapped, tracks: Tracks, random: np.random.Generator) -> float:
    """Standard deviation of x in the middle of the gripper's motion from the calibration, m."""
    middle = tracks.gripper.centre[len(tracks.gripper.centre) // 2][None]
    return float(np.std([calibration.resample(random).to_robot(middle)[0, 0] for _ in range(DRAWS)]))


def _event_flags(motion: Speed, missing: float, matters: bool) -> list[Flag]:
    found = {
        f"the strip is not seen for {missing:.2f} s at the snap": matters,
        "there are several bursts of speed: the first is taken for the snap": motion.several,
        f"fast: the strip snaps only {motion.ratio:.1f} times as fast as it followed its gripper": (
            motion.ratio < CLEAR_SNAP
        ),
        "the film ends within the snap": motion.t[motion.peak] > motion.t[-1] - 0.5 * snap.WINDOW,
    }
    return [Flag(WARNING, text) for text, holds in found.items() if holds]

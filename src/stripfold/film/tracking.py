"""A film as positions: the gripper and material points of the strip in each frame, in metres of the robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import MeasurementError, TrackingError
from stripfold.base.percent import Percent
from stripfold.film import camera_motion, video
from stripfold.film.calibration import Calibration, holder
from stripfold.film.camera import Mapping
from stripfold.film.camera_motion import Shift
from stripfold.film.decoding import CHANNELS
from stripfold.film.gripper import Grip, GripperTracker, Track, interpolate_gaps, repeated
from stripfold.film.line import Centreline
from stripfold.film.line_kernels import arc_length
from stripfold.film.recording import Recording
from stripfold.film.strip_tracker import StripTracker
from stripfold.film.video import Frame, Thumbnails, Timing, VideoReport

MIN_FRAMES = 10
"""Least number of frames of a film, and of those with the strip in it."""
STATIONS = 40
"""Number of material points."""
MAX_LOST = 0.3
"""Share of the frames in which the strip may be lost."""
VISIBLE_WEIGHT = 0.05
"""Share of an error of length attributed to a clearly seen section, relative to a hidden one."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """The measured motion in a film of n frames; what belongs to the strip is nan where it was lost.

    Attributes
    ----------
    timing, report, gripper
        Times of the frames, irregularities of the video, and the marker, pixels.
    grip_time, gripped_end
        When the marker's row was exposed, shape (n,), s; the strip's gripped end, x and z, shape (n, 2), m.
    strip_time, points
        When the strip's rows were exposed, shape (n,), s; its material points, x and z, shape (n, stations, 2), m.
    stations
        Arc lengths of the material points from the gripped end, shape (stations,), m.
    score, visible_length
        Of the strip, shape (n,): mean score, 0 where it was lost, and length, m.
    complete
        Whether both ends of the strip are in the picture.
    size, thumbnails
        Width and height of the frames, and small copies of some.
    camera
        How far the picture is shifted from those of the robot's stops, pixels.
    lost
        The error with which the strip was lost for the rest of the film; None where it was not.
    """

    timing: Timing
    report: VideoReport
    gripper: Track
    grip_time: Array
    gripped_end: Array
    strip_time: Array
    points: Array
    stations: Array
    score: Array
    visible_length: Array
    complete: bool
    size: tuple[int, int]
    thumbnails: Thumbnails
    camera: Shift
    lost: TrackingError | None

    @property
    def seen(self) -> Mask:
        """Shape (n,): frames in which the strip was measured and that do not repeat the one before."""
        return np.asarray(np.isfinite(self.strip_time) & ~self.timing.doubled)


def track(recording: Recording, calibration: Calibration, progress: Callable[[str], None] | None = None) -> Tracks:
    """Follow the gripper and the strip through a recording's film.

    Raises
    ------
    InvalidInputError
        The film cannot be read.
    MeasurementError
        Frames of another size than the calibration's pictures, few of them, a truncated video, or a camera that was
        knocked.
    TrackingError
        The gripper was lost, or the strip was not found.
    """
    path = recording.video
    mapping = calibration.mapping
    offset = np.array(recording.entries.gripper.holder.offset)
    follow_gripper = GripperTracker(holder(recording.folder, recording.entries), path.name)
    follow_strip = StripTracker(mapping, recording.entries.strip.length, path.name)
    grips: list[Grip] = []
    lines: list[Centreline | None] = []
    lost: TrackingError | None = None
    doubled: list[bool] = []
    size = mapping.camera.size
    thumbnails = Thumbnails(size)
    tracked = Percent(progress, "tracking")
    with ExitStack() as stack:
        shown = frames = stack.enter_context(video.read(path, recording.timestamps))
        for frame in frames:
            if frame.image.shape[::-1] != size:
                raise MeasurementError(
                    path.name,
                    "frames of {1} x {0} pixels".format(*frame.image.shape),
                    f"{size[0]} x {size[1]}, as the pictures of the calibration",
                    "calibrate with the very settings of the film",
                )
            thumbnails.add(frame)
            try:
                grip = follow_gripper(frame)
            except TrackingError:
                # Nor is the marker found again where the camera was knocked while it was hidden.
                with camera_motion.since_stops(calibration.stops.small, thumbnails, slice(-1, None)).blamed():
                    raise
            grips.append(grip)
            end = mapping.to_pixels(mapping.to_robot(grip.centre[None]) + offset)[0]
            if frame.index == 0 and frames.report.coloured:
                channel = _clearest_channel(recording, follow_strip, frame, end, grip)
                # Luma is decoded already.
                shown = stack.enter_context(video.read(path, recording.timestamps, channel)) if channel else frames
            lines.append(None)
            if lost is None:
                try:
                    lines[-1] = follow_strip(frame if shown is frames else next(shown), end, grip.corners)
                except TrackingError as error:
                    if not any(lines):
                        raise
                    lost = error
            doubled.append(frame.doubled)
            if frames.report.duration:
                tracked(min(frame.time / frames.report.duration, 1.0))
        report = frames.report
    if len(grips) < MIN_FRAMES:
        advice = "record the whole motion of the gripper"
        raise MeasurementError(path.name, f"{len(grips)} frames", f"at least {MIN_FRAMES}", advice)
    gripper = interpolate_gaps(grips, path.name)
    if (knock := camera_motion.knock(gripper, thumbnails)) is not None:
        time, moved = knock
        raise MeasurementError(
            path.name,
            f"{camera_motion.MOVED_BY} {np.hypot(*moved):.1f} px ({moved[0]:+.1f}, {moved[1]:+.1f}) at {time:.2f} s",
            "a camera that stands still",
            "film again, or cut the film there if that was before the gripper started or after the snap",
        )
    camera = camera_motion.since_stops(calibration.stops.small, thumbnails)
    if lost is not None and lines.count(None) > MAX_LOST * len(lines):
        with camera.blamed():
            raise lost
    if report.truncated:
        raise MeasurementError(
            path.name,
            f"the last frame is at {report.end:.2f} s, its header says {report.duration:.2f} s",
            "a video to its end",
            "it was cut off: copy it again, or export the part that is there into a new file",
        )
    rows = np.array([np.nan if line is None else line.points[:, 1].mean() for line in lines])
    shutter = recording.entries.camera.rolling_shutter
    stations, points, visible_length = material_points(lines, mapping)
    return Tracks(
        timing=Timing.of(gripper.time, np.array(doubled) | repeated(gripper)),
        report=report,
        gripper=gripper,
        grip_time=row_time(gripper.time, gripper.centre[:, 1], size[1], shutter),
        gripped_end=np.asarray(mapping.to_robot(gripper.centre) + offset),
        strip_time=row_time(gripper.time, rows, size[1], shutter),
        points=points,
        stations=stations,
        score=np.array([0.0 if line is None else float(line.score.mean()) for line in lines]),
        visible_length=visible_length,
        complete=not any(any(line.open_ends) for line in lines if line is not None),
        size=size,
        thumbnails=thumbnails,
        camera=camera,
        lost=lost,
    )


def _clearest_channel(recording: Recording, follow_strip: StripTracker, first: Frame, end: Array, grip: Grip) -> int:
    """In which channel of the film's first frame the strip is seen best."""
    clarity = [follow_strip.clarity(first.image, end, grip.corners)]
    for channel in range(1, len(CHANNELS)):
        with video.read(recording.video, recording.timestamps, channel) as frames:
            clarity.append(follow_strip.clarity(next(frames).image, end, grip.corners))
    return int(np.argmax(clarity))


def material_points(lines: Sequence[Centreline | None], mapping: Mapping) -> tuple[Array, Array, Array]:
    """Stations along the strip, the points there in each frame, and its visible length; m, as in :class:`Tracks`."""
    found = {
        i: (arc_length(curve), curve, line.score)
        for i, line in enumerate(lines)
        if line is not None
        for curve in [mapping.to_robot(line.points)]
    }
    lost = 1.0 - len(found) / len(lines)
    if lost > MAX_LOST:
        raise TrackingError(
            "video",
            f"the strip is lost in {lost:.0%} of the frames",
            f"at most {MAX_LOST:.0%}",
            "light it evenly, before a background much darker or brighter",
        )
    visible_length = np.full(len(lines), np.nan)
    for i, (arc, _, _) in found.items():
        visible_length[i] = arc[-1]
    stations = np.linspace(0.0, float(np.nanpercentile(visible_length, 5)), STATIONS)
    points = np.full((len(lines), STATIONS, 2), np.nan)
    for i, (arc, curve, score) in found.items():
        arc = corrected_arc(arc, score, float(np.nanmedian(visible_length)))
        points[i] = np.stack([np.interp(stations, arc, curve[:, k]) for k in range(2)], axis=1)
    return stations, points, visible_length


def corrected_arc(arc: Array, score: Array, length: float) -> Array:
    """Arc lengths along a line of known ``length``: what it lacks is missing where it is hidden, a bend cut short."""
    uncertain = 1.0 - np.clip(score, 0.0, 1.0) + VISIBLE_WEIGHT
    share = np.concatenate([[0.0], np.cumsum(0.5 * (uncertain[1:] + uncertain[:-1]) * np.diff(arc))])
    return np.asarray(arc + (length - arc[-1]) * share / share[-1])


def row_time(time: float | Array, row: float | Array, height: int, rolling_shutter: float) -> Array:
    """Compute the time, s, at which a row, 0 to ``height - 1``, of a frame was exposed.

    ``time`` is that of the frame and of its first row; ``rolling_shutter`` is the time from the exposure of the first
    row to that of the last.
    """
    return np.asarray(time + np.asarray(row) / (height - 1) * rolling_shutter, dtype=np.float64)

"""A film turned into numbers: where the gripper and the strip are in each frame, in metres of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import MeasurementError, TrackingError
from stripfold.vision import video
from stripfold.vision.calibration import Calibration
from stripfold.vision.centreline import Centreline
from stripfold.vision.gripper import Grip, GripperTracker, Track, interpolate_gaps
from stripfold.vision.recording import Recording
from stripfold.vision.strip_tracker import StripTracker
from stripfold.vision.timing import Timing, row_time, timing
from stripfold.vision.video import VideoReport

STATIONS = 40
"""Points fixed in the material whose motion is judged."""
MOST_LOST = 0.3
"""Share of the frames in which the strip may be lost."""
SURE = 0.05
"""Share of an error of length that is sought where the strip is seen as well as can be, in that where it is hidden."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """What was measured in a film.

    Attributes
    ----------
    timing, report
        Times of the frames and what was met while decoding.
    gripper
        The marker, pixels.
    grip_time
        Shape (n,): when its row was exposed, s.
    place
        Shape (n, 2): the strip's gripped end, x and z of the robot, m.
    strip_time
        Shape (n,): when the strip's rows were exposed, s; nan where the strip was lost.
    points
        Shape (n, stations, 2): points at equal lengths along the strip from its gripped end, x and z, m; nan where it
        was lost.
    stations
        Shape (stations,): these lengths, m.
    score
        Shape (n,): mean over the strip, 0 where it was lost.
    visible
        Shape (n,): visible length of the strip, m.
    whole
        Whether both ends of the strip are in the picture.
    size
        Width and height of the frames.
    """

    timing: Timing
    report: VideoReport
    gripper: Track
    grip_time: Array
    place: Array
    strip_time: Array
    points: Array
    stations: Array
    score: Array
    visible: Array
    whole: bool
    size: tuple[int, int]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Shape (n,): frames in which the strip was measured and that are pictures of their own time."""
        return np.asarray(np.isfinite(self.strip_time) & ~self.timing.doubled)


def track(recording: Recording, calibration: Calibration, progress: Callable[[str], None] | None = None) -> Tracks:
    """Follow the gripper and the strip through a recording's film.

    Raises
    ------
    InvalidInputError
        The film cannot be read, or has another size than the calibration's pictures.
    TrackingError
        The gripper or the strip was lost.
    """
    say = progress or (lambda _: None)
    path = recording.file("video")
    assert path is not None
    marker = recording.entries["gripper"]["marker"]
    follow_gripper = GripperTracker(marker["dictionary"], marker["id"], path.name)
    follow_strip = StripTracker(calibration.mapping, recording.entries["strip"]["length"], path.name)
    offset = np.array(marker["offset"])
    grips: list[Grip] = []
    lines: list[Centreline | None] = []
    doubled: list[bool] = []
    size = (0, 0)
    with video.read(path, recording.file("timestamps")) as frames:
        for frame in frames:
            size = (frame.image.shape[1], frame.image.shape[0])
            _check_size(size, calibration, path.name)
            grip = follow_gripper(frame)
            grips.append(grip)
            end = calibration.mapping.to_pixels(place_of(calibration, grip.centre[None], offset))[0]
            lines.append(follow_strip(frame, end, grip.corners))
            doubled.append(frame.doubled)
            if frame.index % 30 == 0:
                say(f"frame {frame.index}, {frame.time:.2f} s")
        report = frames.report
    track_ = interpolate_gaps(grips, path.name)
    times = timing(track_.time, np.array(doubled))
    shutter = recording.entries["camera"]["rolling_shutter"]
    strip_time = np.array(
        [
            np.nan if line is None else float(row_time(t, line.points[:, 1].mean(), size[1], shutter))
            for t, line in zip(track_.time, lines, strict=True)
        ]
    )
    stations, points, visible = _stations(lines, calibration)
    return Tracks(
        times,
        report,
        track_,
        row_time(track_.time, track_.centre[:, 1], size[1], shutter),
        place_of(calibration, track_.centre, offset),
        strip_time,
        points,
        stations,
        np.array([0.0 if line is None else float(line.score.mean()) for line in lines]),
        visible,
        not any(any(line.open_ends) for line in lines if line is not None),
        size,
    )


def place_of(calibration: Calibration, centres: Array, offset: Array) -> Array:
    """Where the strip's gripped end is, shape (n, 2), x and z of the robot, m, from the marker's centres, pixels."""
    return np.asarray(calibration.mapping.to_robot(centres) + offset)


def _check_size(size: tuple[int, int], calibration: Calibration, name: str) -> None:
    camera = calibration.mapping.camera
    if size != camera.size:
        raise MeasurementError(
            name,
            f"frames of {size[0]} x {size[1]} pixels",
            f"{camera.size[0]} x {camera.size[1]}, as the pictures of the calibration",
            "calibrate with the very settings of the film",
        )


def _stations(lines: list[Centreline | None], calibration: Calibration) -> tuple[Array, Array, Array]:
    """Lengths along the strip, the points there in each frame, and its visible length; m."""
    curves = [None if line is None else calibration.mapping.to_robot(line.points) for line in lines]
    arcs = [
        None if c is None else np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(c, axis=0), axis=1))])
        for c in curves
    ]
    visible = np.array([np.nan if arc is None else arc[-1] for arc in arcs])
    if np.mean(np.isnan(visible)) > MOST_LOST:
        raise TrackingError(
            "video",
            f"the strip is lost in {np.mean(np.isnan(visible)):.0%} of the frames",
            f"at most {MOST_LOST:.0%}",
            "light it evenly, before a background much darker or brighter",
        )
    stations = np.linspace(0.0, float(np.nanpercentile(visible, 5)), STATIONS)
    points = np.full((len(lines), STATIONS, 2), np.nan)
    usual = float(np.nanmedian(visible))
    for i, (line, curve, arc) in enumerate(zip(lines, curves, arcs, strict=True)):
        if line is not None and curve is not None and arc is not None:
            arc = _of_length(arc, line.score, usual)
            points[i] = np.stack([np.interp(stations, arc, curve[:, k]) for k in range(2)], axis=1)
    return stations, points, visible


def _of_length(arc: Array, score: Array, length: float) -> Array:
    """Arc lengths of a line if it had a length: what it lacks is missing where it is hidden, a bend cut short."""
    unsure = 1.0 - np.clip(score, 0.0, 1.0) + SURE
    share = np.concatenate([[0.0], np.cumsum(0.5 * (unsure[1:] + unsure[:-1]) * np.diff(arc))])
    return np.asarray(arc + (length - arc[-1]) * share / share[-1])

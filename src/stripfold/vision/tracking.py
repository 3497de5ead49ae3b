"""A film turned into numbers: where the gripper and the strip are in each frame, in metres of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.errors import MeasurementError, TrackingError

from . import video
from .calibrated import Calibration
from .centreline import Centreline, find
from .following import Followed, Look, between, first_look, follow
from .gripper import Grip, GripperTracker, Track, joined
from .mapping import Mapping
from .measuring import GOOD
from .recording import Recording
from .sections import interpolated
from .timing import Timing, row_time, timing
from .video import Frame, VideoReport

Array = NDArray[np.float64]

POINTS = 80
"""Points measured along the strip."""
STATIONS = 40
"""Points fixed in the material whose motion is judged."""
MOST_LOST = 0.3
"""Share of the frames in which the strip may be lost."""
LONGEST_LOSS = 0.5
"""For how long at a time, s."""
HELD = 0.98
"""Share of the strip's length up to which it is followed: its held end is hidden."""
FASTER = 2.0
"""How many times faster than in the last frame the strip may be in the next."""
FASTEST = 5.0
"""Speed of its fastest point that is not searched beyond, visible lengths per second."""
PLAIN = 0.85
"""Share of the strip that is seen from which it is not searched for farther away."""
LONGER = 0.012
"""How much longer than at first a line may seem, as a share: one that goes astray makes a detour."""
DETOUR, DETOUR_RATE = 0.003, 0.03
"""How much longer than in the frame before, as a share, and how much more of it per second."""
REMEMBERED = 1.0
"""How far back the usual length is looked for, s."""
SURE = 0.05
"""Share of an error of length that is sought where the strip is seen as well as can be, in that where it is hidden."""
CUT_SHORT = 0.85
"""Length, as a share of the strip's, below which a line with both ends in view has left some of the strip out."""
ASTRAY = 0.5
"""How far a line may begin from where the gripper holds the strip, in widths of it."""
SHORTER = 0.02
"""How much shorter: of a tight bend the inner side is seen, the more of it the lower the camera."""
RIM = 1.6
"""Size of the marker with its rim, in the marker's own."""
DROPPED = 0.03
"""Distance of the strip from where the gripper should hold it, as a share of its length, that means it does not."""


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
    track_ = joined(grips, path.name)
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


class StripTracker:
    """Follows the strip from frame to frame: call it with each in turn and the pixel of its gripped end."""

    def __init__(self, mapping: Mapping, length: float, source: str) -> None:
        self._mapping, self._longest, self._source = mapping, HELD * length, source
        self._last: Centreline | None = None
        self._look: Look | None = None
        self._aside = np.zeros(2)  # of the line's first point from the gripped end, pixels
        self._laid = np.zeros(2)  # its last point, which does not move
        self._length = 0.0  # of the first line, m
        self._lengths: list[tuple[float, float]] = []  # times and lengths of the lines of late, s and m
        self._since = 0.0
        self._motion = np.zeros((POINTS, 2))  # of each point, pixels per second
        self._first = np.nan

    def __call__(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """The strip in the next frame, or None where it is lost for a moment; ``marker`` are its corners, (4, 2).

        Raises
        ------
        TrackingError
            It is not in the first frames, is lost for long, or is not where the gripper holds it.
        """
        if self._last is None:
            return self._begun(frame, end, marker)
        found = self._followed(frame, end)
        if found is not None:
            self._accept(frame.time, found)
            return found.line
        if frame.time - self._since > LONGEST_LOSS:
            raise TrackingError(
                self._source,
                f"the strip is lost at {frame.time:.3f} s",
                f"the strip in view, but for gaps of up to {LONGEST_LOSS:g} s",
                "light it evenly, before a background much darker or brighter, and film from the side",
            )
        return None

    def _begun(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """The strip of the first frame in which all of it is seen."""
        if np.isnan(self._first):
            self._first = frame.time
        try:
            line = find(without(frame.image, marker), end, points=POINTS, source=self._source)
            line = self._complete(self._held(line, end))
        except TrackingError:
            if frame.time - self._first > LONGEST_LOSS:
                raise
            return None
        line = self._without_rest(_joined_to(line, end))
        self._length = self._metres(line)
        self._lengths = [(frame.time, self._length)]
        self._aside, self._laid = line.points[0] - end, line.points[-1]
        self._last, self._look, self._since = line, first_look(frame.image, line), frame.time
        return line

    def _followed(self, frame: Frame, end: Array) -> Followed | None:
        last, look = self._last, self._look
        assert last is not None
        assert look is not None
        passed = frame.time - self._since
        moved = replace(last, points=last.points + passed * self._motion)
        ends = np.stack([end + self._aside, self._laid])
        usual = float(np.median(look.width))
        near = 0.25 * usual + 1.5 + FASTER * float(np.quantile(np.hypot(*self._motion.T), 0.9)) * passed
        far = min(4.0 * near + usual, 4.0 * usual + 16.0)
        best: Followed | None = None
        # What passes in front may have taken the line along: then the strip is where it was, not where that went.
        for guess, reach in ((moved, near), (moved, far), (last, far)):
            found = follow(frame.image, guess, look, ends, reach)
            if found is None or not self._of_length(self._metres(found.line), passed):
                continue
            if np.hypot(*(found.line.points[0] - ends[0])) > ASTRAY * usual + 1.0:
                continue
            if best is None or found.share > best.share:
                best = found
            if best.sound and best.share > PLAIN:
                break
        return best if best is not None and best.sound else None

    def _accept(self, time: float, found: Followed) -> None:
        assert self._last is not None
        motion = (found.line.points - self._last.points) / (time - self._since)
        fastest = FASTEST * found.line.length
        motion *= np.minimum(1.0, fastest / np.maximum(np.hypot(*motion.T), 1e-9))[:, None]
        # What was hidden only seems to have moved.
        motion[found.line.score < GOOD] = 0.0
        self._motion = 0.5 * (self._motion + motion)
        self._last, self._look, self._since = found.line, found.look, time
        late = [(t, length) for t, length in self._lengths if time - t < REMEMBERED]
        self._lengths = [*late, (time, self._metres(found.line))]

    def _of_length(self, length: float, passed: float) -> bool:
        """Whether a line may be that long, m, as much time after the last one, s."""
        known = -SHORTER < length / self._length - 1.0 < LONGER
        last, usual = self._lengths[-1][1], float(np.median([of for _, of in self._lengths]))
        # A bend that something in front cut short may be what it was before, at once.
        return known and (length < (1.0 + DETOUR + DETOUR_RATE * passed) * last or abs(length / usual - 1.0) < DETOUR)

    def _metres(self, line: Centreline) -> float:
        curve = self._mapping.to_robot(line.points)
        return float(np.linalg.norm(np.diff(curve, axis=0), axis=1).sum())

    def _without_rest(self, line: Centreline) -> Centreline:
        """The line up to the held end: what goes on behind it is no strip."""
        curve = self._mapping.to_robot(line.points)
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
        if arc[-1] <= self._longest:
            return line
        s = np.linspace(0.0, float(np.interp(self._longest, arc, line.arc)), len(line.points))
        values = {name: np.interp(s, line.arc, getattr(line, name)) for name in ("sd", "width", "score")}
        return replace(line, points=interpolated(line.points, line.arc, s), **values)

    def _complete(self, line: Centreline) -> Centreline:
        length, known = self._metres(line), self._longest / HELD
        if not any(line.open_ends) and length < CUT_SHORT * known:
            raise TrackingError(
                self._source,
                f"{length * 1e3:.0f} mm of the strip are seen, its length is {known * 1e3:.0f} mm",
                f"all of it, or at least {CUT_SHORT:.0%}, in the first frames",
                "is strip.length right? keep things that hide it out of the first frames",
            )
        return line

    def _held(self, line: Centreline, end: Array) -> Centreline:
        away = float(np.hypot(*(line.points[0] - end)))
        if away > DROPPED * line.length + 2.0 * float(np.median(line.width)):
            raise TrackingError(
                self._source,
                f"the strip is {away:.0f} px from where the gripper should hold it",
                "a strip held by its end",
                "did it slip? compare gripper.marker.offset with the gripper",
            )
        return line


def _joined_to(line: Centreline, end: Array) -> Centreline:
    """The line made longer, straight, up to where it is held: the gripper hides its end."""
    points, places = between(line.points, np.stack([end, line.points[-1]]), len(line.points))
    values = {name: np.interp(places, line.arc, getattr(line, name)) for name in ("sd", "width", "score")}
    return replace(line, points=points, **values)


def away_from(line: Array, points: Array) -> Array:
    """Distance of points, shape (n, 2), from a polygon, shape (m, 2); shape (n,)."""
    start, along = line[:-1], np.diff(line, axis=0)
    share = np.einsum("nmk,mk->nm", points[:, None] - start, along) / np.maximum(np.sum(along**2, axis=1), 1e-12)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1))


def without(image: NDArray[np.uint8], marker: Array) -> NDArray[np.uint8]:
    """A copy of a picture in which the marker and its rim have the grey that is around them: they are no strip."""
    centre = marker.mean(axis=0)
    covered = np.zeros(image.shape, np.uint8)
    around = np.zeros(image.shape, np.uint8)
    for canvas, grown in ((covered, RIM), (around, 1.3 * RIM)):
        cv2.fillConvexPoly(canvas, np.rint(centre + grown * (marker - centre)).astype(np.int32), (1,))
    ring = (around > 0) & (covered == 0)
    cleared = image.copy()
    if ring.any():
        cleared[covered > 0] = int(np.median(image[ring]))
    return cleared


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

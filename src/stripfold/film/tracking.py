"""A film as positions: the gripper and material points of the strip in each frame, in metres of the robot.

The strip is followed from frame to frame: each line guides the next search, and implausible lines are rejected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from typing import Any, Protocol

import cv2
import numpy as np

from stripfold.base.arrays import Array, Mask, Picture
from stripfold.base.errors import MeasurementError, TrackingError
from stripfold.base.progress import Percent
from stripfold.film import camera_motion, video
from stripfold.film.camera import Mapping
from stripfold.film.camera_motion import Shift
from stripfold.film.decoding import CHANNELS
from stripfold.film.gripper import Grip, GripperTracker, Track, interpolate_gaps, repeated
from stripfold.film.holder import holder_of
from stripfold.film.line import Centreline, Followed, between_ends, find, follow, with_appearance
from stripfold.film.line_kernels import GOOD, arc_length
from stripfold.film.recording import Recording
from stripfold.film.video import Frame, Reader, Thumbnails, Timing, VideoReport

MIN_FRAMES = 10
"""Least number of frames of a film, and of those with the strip in it."""
STATIONS = 40
"""Number of material points."""
MAX_LOST = 0.3
"""Share of the frames in which the strip may be lost."""
VISIBLE_WEIGHT = 0.05
"""Share of an error of length attributed to a clearly seen section, relative to a hidden one."""
POINTS = 80
"""Points measured along the strip."""
MAX_LOSS = 0.5
"""For how long the strip may be lost at a time, s."""
TRACKED_SHARE = 0.98
"""Share of the strip's length that is followed: its held end is hidden."""
SPEED_MARGIN = 2.0
"""Search range in the next frame, relative to the motion between the last two."""
MAX_SPEED = 5.0
"""Fastest motion of a point that is extrapolated, visible lengths per second."""
CLEARLY_SEEN = 0.85
"""Measured share of the strip from which it is not searched for farther away."""
MAX_LENGTHENING, MAX_SHORTENING = 0.012, 0.02
"""How much the line's length may differ from the first, as a share: a detour, or the inner side of a tight bend."""
BEND_SHORTENING = 0.5
"""How much more it may be shorter where the strip is wide, in widths."""
STEP_LENGTHENING, LENGTHENING_RATE = 0.003, 0.03
"""How much longer than in the last frame a line may be, as a share, and how much more per second."""
LENGTH_MEMORY = 1.0
"""Time over which the usual length is taken, s."""
MIN_COMPLETE = 0.88
"""Share of the strip's length below which a first line with both ends in view has left out some of the strip."""
MAX_EXCESS, SAME_WIDTH, MIN_ALIKE = 0.05, 0.25, 0.7
"""Share of the described length by which a first line may be longer unless what is beyond looks like the strip: within
this logarithm of its width, in this share of the points."""
MAX_REFINEMENTS, SETTLED = 12, 1.0
"""How often the first line is measured again at most, until it moves by less than this, pixels: off a wrong layer it
comes a few points at a time."""
MAX_END_ERROR = 0.5
"""How far a line may begin from where the gripper holds the strip, in widths."""
MARKER_RIM = 1.6
"""Size of the marker with its rim, relative to the marker."""
MAX_GRIP_DISTANCE = 0.03
"""Distance of the strip from where the gripper should hold it, as a share of its length, that means it does not."""


IN_FRAMES = ("grip_time", "gripped_end", "strip_time", "points", "score", "visible_length")
"""Fields of :class:`Tracks` with a row for each frame."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """The measured motion in a film of n frames; what belongs to the strip is nan where it was lost.

    ``gripper`` is the marker, pixels; ``grip_time``, shape (n,), s, when its row was exposed, ``gripped_end``, shape
    (n, 2), m, x and z of the strip's end.  ``strip_time``, shape (n,), s, is when the strip's rows were exposed,
    ``points``, shape (n, stations, 2), m, its material points, ``stations`` their arc lengths from the gripped end, m,
    ``score`` and ``visible_length``, shape (n,), its mean score, 0 where it was lost, and its length, m; ``complete``
    says whether both of its ends are in the picture.  ``size`` is that of the frames, ``thumbnails`` are small copies,
    ``camera`` is the shift from the pictures of the robot's stops, pixels, ``lost`` the error of a strip lost for good.
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

    def during(self, frames: slice) -> Tracks:
        """The motion in some of the frames; a strip lost for good is an error of the last ones only."""
        timing, last = self.timing, frames.stop == len(self.grip_time)
        return replace(
            self,
            timing=Timing.of(timing.time[frames], timing.doubled[frames]),
            gripper=Track(**{name: values[frames] for name, values in vars(self.gripper).items()}),
            lost=self.lost if last else None,
            **{name: getattr(self, name)[frames] for name in IN_FRAMES},
        )


class Mapped(Protocol):
    """A calibration: by boards and stops of a robot, or by the plate."""

    @property
    def mapping(self) -> Mapping: ...

    @property
    def quality(self) -> dict[str, Any]: ...

    @property
    def relative(self) -> bool: ...

    def resample(self, random: np.random.Generator) -> Mapping: ...

    def shift(self, film: Thumbnails, frames: slice = ..., place: Array | None = ...) -> Shift: ...


def track(
    recording: Recording,
    calibration: Mapped,
    progress: Callable[[str], None] | None = None,
    steady: Callable[[Frame], Frame] | None = None,
    between: tuple[float, float] = (-inf, inf),
) -> Tracks:
    """Follow the gripper and the strip through a recording's film.

    ``steady``: makes of a frame one of a camera that stands still.  ``between``: first and last time, s.

    Raises InvalidInputError: the film cannot be read; MeasurementError: frames of another size than the calibration's
    pictures, few of them, a truncated video, or a knocked camera; TrackingError: gripper or strip lost.
    """
    path = recording.video
    mapping = calibration.mapping
    offset = np.array(recording.entries.gripper.holder.offset)
    follow_gripper = GripperTracker(holder_of(recording.folder, recording.entries), path.name)
    follow_strip = StripTracker(mapping, recording.entries.strip.length, path.name)
    grips: list[Grip] = []
    lines: list[Centreline | None] = []
    lost: TrackingError | None = None
    doubled: list[bool] = []
    size = mapping.camera.size
    thumbnails = Thumbnails(size)
    tracked = Percent(progress, "tracking")
    with ExitStack() as stack:

        def opened(channel: int = 0) -> tuple[Reader, Iterator[Frame]]:
            reader = stack.enter_context(video.read(path, recording.timestamps, channel))
            return reader, _some(reader, steady, between)

        reader, frames = opened()
        shown = frames
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
                with calibration.shift(thumbnails, slice(-1, None)).blamed():
                    raise
            grips.append(grip)
            end = mapping.to_pixels(mapping.to_robot(grip.centre[None]) + offset)[0]
            if frame.index == 0 and reader.report.coloured:
                channel = _clearest_channel(opened, follow_strip, frame, end, grip)
                # Luma is decoded already.
                shown = opened(channel)[1] if channel else frames
            lines.append(None)
            if lost is None:
                try:
                    lines[-1] = follow_strip(frame if shown is frames else next(shown), end, grip.corners)
                except TrackingError as error:
                    if not any(lines):
                        raise
                    lost = error
            doubled.append(frame.doubled)
            if reader.report.duration:
                tracked(min(frame.time / reader.report.duration, 1.0))
        report = reader.report
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
    camera = calibration.shift(thumbnails)
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
    middles = np.array([np.full(2, np.nan) if line is None else line.points.mean(axis=0) for line in lines])
    exposed = partial(exposure, size=size, turns=report.turns, shutter=recording.entries.camera.rolling_shutter)
    stations, points, visible_length = material_points(lines, mapping)
    return Tracks(
        timing=Timing.of(gripper.time, np.array(doubled) | repeated(gripper)),
        report=report,
        gripper=gripper,
        grip_time=exposed(gripper.time, gripper.centre),
        gripped_end=np.asarray(mapping.to_robot(gripper.centre) + offset),
        strip_time=exposed(gripper.time, middles),
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


def _some(reader: Reader, steady: Callable[[Frame], Frame] | None, between: tuple[float, float]) -> Iterator[Frame]:
    """The frames between two times, steady ones if asked for, with indices from 0 on."""
    first: int | None = None
    for frame in reader:
        if between[0] <= frame.time <= between[1]:
            first = frame.index if first is None else first
            yield replace(frame if steady is None else steady(frame), index=frame.index - first)


def _clearest_channel(
    opened: Callable[[int], tuple[Reader, Iterator[Frame]]],
    follow_strip: StripTracker,
    first: Frame,
    end: Array,
    grip: Grip,
) -> int:
    """In which channel of the film's first frame the strip is seen best."""
    clarity = [follow_strip.clarity(first.image, end, grip.corners)]
    for channel in range(1, len(CHANNELS)):
        reader, frames = opened(channel)
        clarity.append(follow_strip.clarity(next(frames).image, end, grip.corners))
        reader.close()
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


def exposure(time: Array, pixels: Array, size: tuple[int, int], turns: int, shutter: float) -> Array:
    """Compute when pixels, shape (n, 2), of frames of these times, shape (n,), were exposed, s.

    ``size``: width and height of the frames, shown after quarter turns to the left, ``turns``.  ``shutter``: from the
    exposure of the sensor's first row, which is at the time of the frame, to that of its last one.
    """
    places = pixels / (np.array(size) - 1.0)
    # The sensor's rows from its first to its last are the frame's rows downwards, or its columns to the right, or back.
    share = [places[:, 1], places[:, 0], 1.0 - places[:, 1], 1.0 - places[:, 0]][turns]
    return np.asarray(time + share * shutter, dtype=np.float64)


class StripTracker:
    """Follows a strip of ``length``, m; to be called with each frame in turn and the pixel of its gripped end."""

    def __init__(self, mapping: Mapping, length: float, source: str) -> None:
        self._mapping, self._strip_length, self._source = mapping, length, source
        self._last: Centreline | None = None
        self._end_offset = np.zeros(2)  # of the line's first point from the gripped end, pixels
        self._lying_end = np.zeros(2)  # its last point, which does not move
        self._lengths: list[tuple[float, float]] = []  # times and lengths of the recent lines, s and m
        self._first_length, self._first_time, self._last_time = 0.0, np.nan, 0.0  # m, s, s
        self._max_shortening = MAX_SHORTENING
        self._motion = np.zeros((POINTS, 2))  # of each point, pixels per second

    def __call__(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """Find the strip in the next frame, or None where it is briefly lost; ``marker`` are its corners, (4, 2).

        Raises TrackingError: not in the first frames, lost for long, or not where the gripper holds it.
        """
        if self._last is None:
            return self._start(frame, end, marker)
        found, length = self._search(frame, self._last, end)
        if found is not None:
            self._accept(frame.time, found, length, self._last)
            return found.line
        if frame.time - self._last_time > MAX_LOSS:
            raise TrackingError(
                self._source,
                f"the strip is lost at {frame.time:.3f} s",
                f"the strip in view, but for gaps of up to {MAX_LOSS:g} s",
                "light it evenly, before a background much darker or brighter, and film from the side",
            )
        return None

    def clarity(self, image: Picture, end: Array, marker: Array) -> float:
        """How well the strip is seen in a first picture: its contrast times its score, 0 where it is not found."""
        try:
            line = find(without_marker(image, marker), end, points=POINTS, source=self._source)
            self._check_first(line, end)
        except TrackingError:
            return 0.0
        return float(line.contrast[0] * line.score.mean())

    def _start(self, frame: Frame, end: Array, marker: Array) -> Centreline | None:
        """The strip in the first frame that shows all of it."""
        if np.isnan(self._first_time):
            self._first_time = frame.time
        try:
            line = find(without_marker(frame.image, marker), end, points=POINTS, source=self._source)
            line = _up_to(end, line, frame.image)
            self._check_first(line, end)
        except TrackingError:
            if frame.time - self._first_time > MAX_LOSS:
                raise
            return None
        # The gripper hides the held end: extended to it.  What goes on beyond the strip's length is something else.
        _, s = between_ends(line.points, np.stack([end, line.points[-1]]), POINTS)
        line = line.between(s[0], s[-1])
        arc = arc_length(self._mapping.to_robot(line.points))
        excess = arc[-1] - TRACKED_SHARE * self._strip_length
        if excess > 0.0:
            self._check_excess(line, arc)
            line = line.between(0.0, float(np.interp(arc[-1] - excess, arc, line.arc)))
        # Measured as in the frames to come, whose lines are compared with it.
        for _ in range(MAX_REFINEMENTS):
            before = with_appearance(frame.image, line)
            found = follow(frame.image, before, before.points[[0, -1]], float(np.median(before.width)))
            line = before if found is None else found.line
            if np.hypot(*(line.points - before.points).T).max() < SETTLED:
                break
        self._first_length = self._metric_length(line)
        self._max_shortening += BEND_SHORTENING * float(np.median(line.width)) / line.length
        self._lengths = [(frame.time, self._first_length)]
        self._end_offset, self._lying_end = line.points[0] - end, line.points[-1]
        self._last, self._last_time = line, frame.time
        return line

    def _check_excess(self, line: Centreline, arc: Array) -> None:
        """Refuse a strip that goes on, as wide and as clear, beyond its described length; ``arc`` is in m."""
        within, beyond = arc <= self._strip_length, arc > self._strip_length
        usual = float(np.median(line.width[within][-POINTS // 10 :]))
        alike = (line.score[beyond] >= GOOD) & (np.abs(np.log(line.width[beyond] / usual)) < SAME_WIDTH)
        if arc[-1] > (1.0 + MAX_EXCESS) * self._strip_length and alike.mean() > MIN_ALIKE:
            raise TrackingError(
                self._source,
                f"{arc[-1] * 1e3:.0f} mm of the strip are seen, strip.length = {self._strip_length * 1e3:.0f} mm",
                f"a strip that is at most {MAX_EXCESS:.0%} longer than described",
                "is strip.length right? hold the far end down with something that does not look like the strip",
            )

    def _check_first(self, line: Centreline, end: Array) -> None:
        away = float(np.hypot(*(line.points[0] - end)))
        if away > MAX_GRIP_DISTANCE * line.length + 2.0 * float(np.median(line.width)):
            raise TrackingError(
                self._source,
                f"the strip is {away:.0f} px from where the gripper should hold it",
                "a strip held by its end",
                "did it slip? compare the offset of gripper.marker or template with the gripper",
            )
        length = self._metric_length(line)
        if not any(line.open_ends) and length < MIN_COMPLETE * self._strip_length:
            raise TrackingError(
                self._source,
                f"{length * 1e3:.0f} mm of the strip are seen, its length is {self._strip_length * 1e3:.0f} mm",
                f"all of it, or at least {MIN_COMPLETE:.0%}, in the first frames",
                "is strip.length right? keep things that hide it out of the first frames",
            )

    def _search(self, frame: Frame, last: Centreline, end: Array) -> tuple[Followed | None, float]:
        """The strip near where it is expected, and its length, m."""
        elapsed = frame.time - self._last_time
        moved = replace(last, points=last.points + elapsed * self._motion)
        ends = np.stack([end + self._end_offset, self._lying_end])
        width = float(np.median(last.width))
        fast = float(np.quantile(np.hypot(*self._motion.T), 0.9))
        near = 0.25 * width + 1.5 + SPEED_MARGIN * fast * elapsed
        far = min(4.0 * near + width, 4.0 * width + 16.0)
        best, best_length = None, 0.0
        for guess, reach in ((moved, near), (moved, far), (last, far)):
            # An object that passes in front may have taken the line along: then the strip is where it was before.
            if guess is last and best is not None and best.sound:
                break
            found = follow(frame.image, guess, ends, reach)
            length = 0.0 if found is None else self._metric_length(found.line)
            if found is None or not self._plausible(length, elapsed):
                continue
            if np.hypot(*(found.line.points[0] - ends[0])) > MAX_END_ERROR * width + 1.0:
                continue
            if best is None or found.share > best.share:
                best, best_length = found, length
            if best.sound and best.share > CLEARLY_SEEN:
                break
        return best if best is not None and best.sound else None, best_length

    def _accept(self, time: float, found: Followed, length: float, last: Centreline) -> None:
        motion = (found.line.points - last.points) / (time - self._last_time)
        limit = MAX_SPEED * found.line.length
        motion *= np.minimum(1.0, limit / np.maximum(np.hypot(*motion.T), 1e-9))[:, None]
        # Hidden points only seem to have moved.
        motion[found.line.score < GOOD] = 0.0
        self._motion = 0.5 * (self._motion + motion)
        self._last, self._last_time = found.line, time
        recent = [old for old in self._lengths if time - old[0] < LENGTH_MEMORY]
        self._lengths = [*recent, (time, length)]

    def _plausible(self, length: float, elapsed: float) -> bool:
        """Whether a line may have this length, m, so long after the last one, s."""
        if not -self._max_shortening < length / self._first_length - 1.0 < MAX_LENGTHENING:
            return False
        last, usual = self._lengths[-1][1], float(np.median([old for _, old in self._lengths]))
        # A bend that something in front cut short may at once be as long as before.
        growth = 1.0 + STEP_LENGTHENING + LENGTHENING_RATE * elapsed
        return length < growth * last or abs(length / usual - 1.0) < STEP_LENGTHENING

    def _metric_length(self, line: Centreline) -> float:
        return float(arc_length(self._mapping.to_robot(line.points))[-1])


def _up_to(end: Array, line: Centreline, image: Picture) -> Centreline:
    """A line that was just found, up to the gripped end where a dimmer part of the strip, seen edge-on, leads there."""
    arc, away = line.arc, float(np.hypot(*(line.points[0] - end)))
    if away < 2.0 * np.median(line.width):
        return line
    s = np.linspace(-away, arc[-1], POINTS)
    x, y = (np.interp(s, [-away, *arc], [end[i], *line.points[:, i]]) for i in range(2))
    width, contrast = np.interp(s, arc, line.width), np.interp(s, arc, line.contrast)
    longer = replace(line, points=np.column_stack([x, y]), width=width, contrast=contrast)
    ends = np.stack([end, line.points[-1]])
    found = follow(image, with_appearance(image, longer), ends, 2.0 * float(np.median(line.width)))
    if found is None or not found.sound or np.mean(found.line.score[s < 0.0] >= GOOD) < MIN_ALIKE:
        return line
    return found.line


def without_marker(image: Picture, marker: Array) -> Picture:
    """A copy of a picture in which the marker and its rim have the grey level around them: they are no strip."""
    centre = marker.mean(axis=0)
    masks = np.zeros((2, *image.shape), np.uint8)
    for mask, size in zip(masks, (MARKER_RIM, 1.3 * MARKER_RIM), strict=True):
        cv2.fillConvexPoly(mask, np.rint(centre + size * (marker - centre)).astype(np.int32), (1,))
    covered, around = masks[0] > 0, (masks[1] > 0) & (masks[0] == 0)
    cleared = image.copy()
    if around.any():
        cleared[covered] = int(np.median(image[around]))
    return cleared

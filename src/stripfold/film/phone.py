"""lambda from one film with the plate in view: no calibration, no description (docs/measuring.md).

The film is read twice.  First the plate and the gripper's marker are followed: they say where the camera pointed in
each frame, where the strip's end lay while the strip was flat, how high it was lifted, and when it was pulled.  Then
the strip is followed while it is pulled, in frames that are shifted back to where the first ones were, and measured as
in any other recording.  Places count from the flat strip with the same marker: neither its offset nor where the plate
stands matters.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from itertools import pairwise
from math import hypot, nan
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import least_squares

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError, MeasurementError, TrackingError
from stripfold.base.material import GRAVITY
from stripfold.base.progress import Percent
from stripfold.base.validation import value_meant
from stripfold.files.reporting import Progress
from stripfold.film import plate, snap, video
from stripfold.film.boards import Refinement, refine, spacing
from stripfold.film.camera import Camera, Mapping, fit_homography, fit_similarity, read_camera, rms, transform
from stripfold.film.camera_motion import FIRST, Shift
from stripfold.film.eta_motion import ModelValue, MotionEtaB, model_value
from stripfold.film.gripper import Grip, GripperTracker, interpolate_gaps
from stripfold.film.holder import Marker
from stripfold.film.measure import RecordingMeasurement, evaluate, of_trials
from stripfold.film.pictures import Shown, one_thread
from stripfold.film.plate import Seen
from stripfold.film.recording import Entries, Recording
from stripfold.film.tracking import track
from stripfold.film.video import Frame, Thumbnails

SHAKEN = 0.3
"""Shift of a corner of the picture, pixels, from which frames are shifted back."""
MAX_OFF = 2.0
"""Distance of the plate's corners from where they were, shifted, pixels, from which they are hidden."""
FOCAL, FOCAL_SD, AXIS_SD, LENS_SD = 0.95, 0.3, 0.01, 0.04
"""Focal length of a film over the longer side of its pictures, of which phones cut off some; standard deviations of its
logarithm, of the place of the optical axis over that side, and of the distortion k_1, which not all cameras correct."""
KNOWN_LENS_SD = 2e-3
"""All of these for a lens that is given."""
MARKERS, SIDE_NOISE, LEAST_NOISE = 60, 0.1, 0.05
"""Frames in which the marker's sides count, evenly along its way; their standard deviation as if neighbours did not err
alike, and least that of the plate's corners, pixels."""
READ_SD = 0.5
"""Standard deviation of the time in which a picture is read, row by row or column by column, over that between two."""
AROUND = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
"""Corners of a square, from the upper left one on."""
NEARER_SD, MOST_LARGER = 0.01, 0.05
"""Standard deviation of how much nearer to the camera the marker is than the plate, and by how much larger it may be
seen for that, as shares."""
TURNED_SD, LEANS_SD = 0.06, 0.03
"""Standard deviations of the angles by which the marker faces aside, and leans, rad."""
WIDTH, MOST_OFF = plate.LONG.columns * plate.LONG.square, 0.02
"""Width of the long plate's squares, m, and how far another print may be off, as a share."""
RULER_SD, MARKER_SD = 1e-4, 5e-4
"""Standard deviations of that width by a ruler, m, and of the marker's size in all frames, as a share."""
LIFTED, AT_REST = 0.004, 0.0015
"""Height above the flat strip, m, from which the gripper lifts it; motion of one at rest, m."""
HIGH = 0.97
"""Share of the final height from which the strip is lifted."""
CRAWLING, PULLING, FAST = 2e-4, 0.15, 2.0
"""Speed above which the gripper advances, m/s; quantile of such speeds that is the pull's, as all else is faster; and
speed over that, above which it still approaches."""
SETTLING = 0.4
"""For how long after it the strip may swing, s."""
FLAT_SD, OFFSET_SD = 2e-4, 4e-3
"""Standard deviations, m: of where the flat strip's end is seen, and of the marker from above it, along x."""
USUAL_HEIGHT, UNKNOWN = 3.5, 10.0
"""Height of the gripper, L*, by which eta_b is guessed before it is measured; factor within which it then is."""
ADVICE = "start with the strip flat on the table in the gripper, then lift it, then pull it steadily"


class _Scan(NamedTuple):
    """The plate and the marker in all n frames: times, s, similarities from the first frames, shape (n, 3, 3), the
    marker's centres, shifted back, shape (n, 2), pixels; which marker; the plate's corners, shifted back, and the
    mapping.
    """

    time: Array
    moved: Array
    centres: Array
    marker: int
    seen: Seen
    mapped: _Mapped


class _View(NamedTuple):
    """How the plate and the gripper's marker, which are of one print, are seen.

    ``camera``; ``rotation``, a Rodrigues vector, and ``shift``, m, of the plate's frame (x along the table, y up) in
    front of it; of the marker the share of the camera's distance by which it is ``nearer`` than the plate, and the
    angles by which it is ``turned`` aside and ``leans``, rad.
    """

    camera: Camera
    rotation: Array
    shift: Array
    nearer: float = 0.0
    turned: float = 0.0
    leans: float = 0.0

    def changed(self, values: Array) -> _View:
        """Another one: logarithm of the focal length, optical axis over the picture's longer side, x and y, k_1;
        rotation, x, y and logarithm of the distance; and the marker's three.  More values are not used.
        """
        focal, size = np.exp(values[0]), self.camera.size
        matrix = self.camera.matrix * np.array([[focal, 1.0, 1.0], [1.0, focal, 1.0], [1.0, 1.0, 1.0]])
        matrix[:2, 2] += max(size) * values[1:3]
        camera = Camera(matrix, self.camera.distortion + values[3] * np.eye(5)[0], size)
        # What is near these values is seen at about the same place, whatever the focal length is.
        away = self.shift[2] * focal * np.exp(values[9])
        aside = (self.shift[:2] / self.shift[2] + values[7:9]) / focal
        return _View(camera, self.rotation + values[4:7], away * np.append(aside, 1.0), *values[10:13].tolist())

    def _axes_and_camera(self) -> tuple[Array, Array]:
        """Axes of the plate's frame, the columns of a matrix, and the camera's place in that frame, m."""
        axes = cv2.Rodrigues(self.rotation)[0]
        return axes, -axes.T @ self.shift

    @property
    def mapping(self) -> Mapping:
        """To places in the marker's plane."""
        axes, (_, _, away) = self._axes_and_camera()
        return Mapping.of_pose(self.camera, self.rotation, self.shift + self.nearer * away * axes[:, 2])

    def corners(self, places: Array) -> Array:
        """Pixels of places on the plate, both of shape (n, 2)."""
        return self.camera.project(np.column_stack([places, np.zeros(len(places))]), self.rotation, self.shift)

    def sides(self, places: Array) -> Array:
        """Sides of the marker as they appear in its plane, shape (n, 4), m: upper, right, lower and left one.

        ``places``: of its middle, shape (n, 2), m.
        """
        _, (x, y, away) = self._axes_and_camera()
        camera, half = np.array([x, y]), 0.5 * plate.SIDE * AROUND
        angles = np.array([self.turned, self.leans])
        off = places[:, None] + half * np.cos(angles) - camera
        nearer = (half @ np.sin(angles) / (away * (1.0 - self.nearer)))[:, None]
        return _sides(off / (1.0 - nearer))


def _sides(corners: Array) -> Array:
    """Distances of corners, shape (n, 4, 2), from the next ones, shape (n, 4)."""
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2))


@dataclass(frozen=True, eq=False)
class _Mapped:
    """A mapping by the plate's corners and the gripper's marker all along its way: ``values`` that are added to
    ``start`` (:meth:`_View.changed`), their ``covariance``, the ``scale`` of the print and its standard deviation.
    """

    start: _View
    values: Array
    covariance: Array
    scale: float
    scale_sd: float

    @property
    def mapping(self) -> Mapping:
        """To places in the marker's plane."""
        return _scaled(self.start.changed(self.values).mapping, self.scale)

    @property
    def larger(self) -> float:
        """By how much larger than in the plate's plane the marker is seen, as a share."""
        return float(1.0 / (1.0 - self.values[10]) - 1.0)

    def draw(self, random: np.random.Generator) -> Mapping:
        """Draw a mapping by the covariance, and the scale."""
        values = random.multivariate_normal(self.values, self.covariance)
        return _scaled(self.start.changed(values).mapping, self.scale * np.exp(random.normal(0.0, self.scale_sd)))


def _scaled(mapping: Mapping, factor: float) -> Mapping:
    """The same with places that many times as far from the origin."""
    return replace(mapping, homography=np.diag([factor, factor, 1.0]) @ mapping.homography)


def fit_mapping(seen: Seen, corners: Array, lens: bool, plate_width: float | None = None) -> _Mapped:
    """Fit the mapping to the plate and to the corners of the marker in n frames, shape (n, 4, 2), pixels.

    ``lens``: whether that is fitted, too; ``plate_width``: see :func:`.measure`.
    """
    camera, places = seen.mapping.camera, plate.places(seen.board, seen.corners)
    centres = corners.mean(axis=1)
    order = np.argsort(centres[:, 0])
    x = centres[order, 0]
    frames = order[np.unique(np.searchsorted(x, np.linspace(x[0], x[-1], MARKERS)))]
    chosen, moved = corners[frames], np.gradient(centres, axis=0)[frames] / max(camera.size)
    noise = max(seen.rms / np.sqrt(2.0), LEAST_NOISE)
    of_lens = [FOCAL_SD, AXIS_SD, AXIS_SD, LENS_SD] if lens else [KNOWN_LENS_SD] * 4
    sd = np.array([*of_lens, *np.full(6, np.inf), NEARER_SD, TURNED_SD, LEANS_SD, READ_SD, READ_SD])
    start = _View(camera, *plate.pose(camera, seen.corners.pixels, places))
    # A marker may be glued on in any way.
    four = start.mapping.to_robot(chosen.reshape(-1, 2)).reshape(-1, 4, 2)
    chosen = chosen[:, np.argmax(AROUND @ (four - four.mean(axis=1, keepdims=True)).mean(axis=0).T, axis=1)]
    side_sd = SIDE_NOISE / _sides(chosen).mean()

    def rows(values: Array) -> Array:
        view = start.changed(values)
        off = view.corners(places) - seen.corners.pixels
        four = view.mapping.to_robot(chosen.reshape(-1, 2)).reshape(-1, 4, 2)
        # What moves while a picture is read seems longer or shorter.
        read = np.tile(1.0 + values[13:] * moved, 2)
        longer = (_sides(four) - read * view.sides(four.mean(axis=1))) / plate.SIDE
        return np.concatenate([off.ravel() / noise, longer.ravel() / side_sd, values / sd])

    found = least_squares(rows, np.zeros(15), loss="soft_l1", x_scale=np.minimum(sd, 1e-3), max_nfev=100)
    scale, scale_sd = (1.0, plate.PRINT_SD) if plate_width is None else (plate_width / WIDTH, RULER_SD / plate_width)
    return _Mapped(start, found.x, np.linalg.inv(found.jac.T @ found.jac), scale, hypot(scale_sd, MARKER_SD))


@dataclass(frozen=True, eq=False)
class PlateCalibration:
    """A mapping by the plate with its ``quality`` for reports; ``flat``, shape (2,): pixel of the marker on the flat
    strip, from which places count.
    """

    mapping: Mapping
    mapped: _Mapped
    flat: Array
    quality: dict[str, Any]
    relative = True

    def resample(self, random: np.random.Generator) -> Mapping:
        """Draw a mapping; the marker on the flat strip stays where it is."""
        drawn = self.mapped.draw(random)
        back = np.eye(3)
        back[:2, 2] = (self.mapping.to_robot(self.flat[None]) - drawn.to_robot(self.flat[None]))[0]
        return Mapping(drawn.camera, back @ drawn.homography)

    def shift(self, film: Thumbnails, frames: slice = slice(FIRST), place: Array | None = None) -> Shift:
        """None: the frames are shifted back."""
        return Shift(0.0, 0.0, False)


@one_thread()
def of_film(
    file: str | os.PathLike[str],
    length: float,
    eta_b: float | None = None,
    width: float | None = None,
    camera: str | os.PathLike[str] | None = None,
    plate_width: float | None = None,
    progress: Progress | None = None,
) -> RecordingMeasurement:
    """Measure lambda at the onset of the snap in a film with the plate; see :func:`.measure`."""
    path = Path(file)
    if plate_width is not None and not abs(plate_width / WIDTH - 1.0) <= MOST_OFF:
        allowed = f"{WIDTH * (1.0 - MOST_OFF):g} to {WIDTH * (1.0 + MOST_OFF):g} m"
        advice = value_meant(plate_width, "m", WIDTH * (1.0 - MOST_OFF), WIDTH * (1.0 + MOST_OFF))
        raise InvalidInputError("plate_width", plate_width, allowed, advice or "print the sheet at 100 %")
    scan = _scan(path, None if camera is None else read_camera(Path(camera)), plate_width, progress)
    return of_trials(scan.time, _trials(scan), lambda part: _of_trial(path, scan, part, length, eta_b, width, progress))


def _of_trial(
    path: Path,
    whole: _Scan,
    part: slice,
    length: float,
    eta_b: float | None,
    width: float | None,
    progress: Progress | None,
) -> RecordingMeasurement:
    """Measure one trial of a film, some of its frames: from the flat strip on."""
    say, mapping = progress or (lambda _: None), whole.mapped.mapping
    scan = whole._replace(time=whole.time[part], moved=whole.moved[part], centres=whole.centres[part])
    flat, lift = _flat(path.name, scan)
    places = mapping.to_robot(scan.centres)
    x, z = places[:, 0] - flat[0], places[:, 1] - flat[1]
    direction = 1 if abs(x.max()) >= abs(x.min()) else -1
    advance = direction * x
    height = float(np.median(z[z > HIGH * z.max()]))
    begin, end, speed = _pulled(path.name, scan.time, advance, z, height, lift)
    entries = _entries(path, length, eta_b, width, scan.marker, flat, height, direction, speed)
    flat_pixel = scan.centres[: np.searchsorted(scan.time, lift)].mean(axis=0)
    resolution = mapping.resolution(scan.centres[np.searchsorted(scan.time, begin)])
    quality = {"camera_from": "plate", "resolution": resolution, "plate_rms": scan.seen.rms}
    calibration = PlateCalibration(mapping, scan.mapped, flat_pixel, quality)
    recording = Recording(path.parent, entries)
    tracks = track(recording, calibration, say, _Steady(whole), (begin, end))
    say("measuring")
    found = evaluate(recording, calibration, tracks)
    if isinstance(found.eta_b, MotionEtaB):
        interval = found.eta_b.low, found.eta_b.high
        known = {"eta_b": found.eta_b.eta_b, "eta_b_interval": interval} if eta_b is None else {"eta_b": eta_b}
        strip = entries.strip.model_copy(update=known)
        entries = entries.model_copy(update={"strip": strip})
        return replace(found, recording=Recording(path.parent, entries), model=model_value(entries))
    # Without an eta_b the model has no lambda_c: the guess was only to measure with.
    return found if eta_b is not None else replace(found, model=ModelValue(nan, nan, nan, nan))


def _entries(
    path: Path,
    length: float,
    eta_b: float | None,
    width: float | None,
    marker: int,
    flat: Array,
    height: float,
    direction: int,
    speed: float,
) -> Entries:
    """What a recording's description would say; an unknown eta_b may be anything, until it is measured."""
    strip: dict[str, Any] = {"length": length, "eta_b": eta_b}
    if eta_b is None:
        guess = 1.0 / (GRAVITY * (height / USUAL_HEIGHT) ** 3)
        strip |= {"eta_b": guess, "eta_b_interval": (guess / UNKNOWN, guess * UNKNOWN)}
    if width is not None:
        strip["width"] = width
    board = plate.LONG.model_dump()
    holder: dict[str, Any] = {"dictionary": plate.LONG.dictionary, "id": marker, "size": plate.SIDE}
    holder |= {"offset": [0.0, -float(flat[1])], "offset_uncertainty": 1.96 * OFFSET_SD}
    return Entries.of(
        {
            "title": path.stem,
            "strip": strip,
            "gripper": {
                "height": height,
                "speed": speed,
                "flat_end": float(flat[0]),
                "flat_end_uncertainty": 1.96 * FLAT_SD,
                "direction": direction,
                "marker": holder,
            },
            "video": path.name,
            "camera": {"intrinsics": path.name},
            "plane": {"image": path.name, "board": board},
            "robot": {"grid": path.name},
        }
    )


class _Steady:
    """Shifts frames back to where the first ones were, by the plate."""

    def __init__(self, scan: _Scan) -> None:
        width, height = scan.seen.mapping.camera.size
        corners = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
        away = [np.abs(transform(moved, corners) - corners).max() for moved in scan.moved]
        self._moved = scan.moved if max(away) > SHAKEN else None

    def __call__(self, frame: Frame) -> Frame:
        if self._moved is None:
            return frame
        matrix, size = self._moved[frame.index][:2], frame.image.shape[::-1]
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        image = cv2.warpAffine(frame.image, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
        return replace(frame, image=np.asarray(image, np.uint8))


def _scan(path: Path, camera: Camera | None, plate_width: float | None, progress: Progress | None) -> _Scan:
    """Follow the plate and the gripper's marker through the film.

    Raises InvalidInputError: it cannot be read; TrackingError: plate or marker are not in view.
    """
    tracked, moved, grips, whole = Percent(progress, "reading the plate"), list[Array](), list[Grip](), list[Array]()
    with video.read(path) as frames:
        first = next(frames)
        seen = plate.find(first.image, path.name, boards=(plate.LONG,)).with_focal(FOCAL, FOCAL_SD)
        marker = _marker(first.image, path.name)
        follow = GripperTracker(Marker(str(plate.LONG.dictionary), marker), path.name)
        known = seen.corners.pixels
        half = max(3, int(seen.board.window * spacing(known)))
        here = np.eye(3)
        frame: Frame | None = first
        while frame is not None:
            corners = refine(frame.image, transform(here, known), Refinement(half))
            fitted = fit_similarity(known, corners)
            off = np.linalg.norm(transform(fitted, known) - corners, axis=1)
            if np.median(off) < MAX_OFF:
                clear = off < MAX_OFF
                here = fit_similarity(known[clear], corners[clear])
                if clear.all():
                    whole.append(transform(np.linalg.inv(here), corners))
            moved.append(here)
            grips.append(follow(frame))
            if frames.report.duration:
                tracked(min(frame.time / frames.report.duration, 1.0))
            frame = next(frames, None)
    # The mean over all frames has hardly any noise left.
    mean = np.mean(whole, axis=0) if whole else known
    known_lens = camera and camera.of_film(Shown(seen.mapping.camera.size, frames.report.turns))
    lens, places = known_lens or seen.mapping.camera, plate.places(seen.board, seen.corners)
    mapping = Mapping(lens, fit_homography(lens.undistort(mean), places))
    seen = Seen(seen.board, seen.corners._replace(pixels=mean), mapping, rms(mapping.to_pixels(places) - mean))
    gripper = interpolate_gaps(grips, path.name)
    back = np.linalg.inv(moved)
    centres = [transform(one, centre[None])[0] for one, centre in zip(back, gripper.centre, strict=True)]
    corners = np.array([transform(one, four) for one, four in zip(back, gripper.corners, strict=True)])
    mapped = fit_mapping(seen, corners[gripper.tracked], camera is None, plate_width)
    if abs(larger := mapped.larger) > MOST_LARGER:
        found = (
            f"a marker on the gripper that is {abs(larger):.0%} {'larger' if larger > 0.0 else 'smaller'} than printed"
        )
        advice = "print marker and plate at the same scale, and have both as far from the phone"
        raise MeasurementError(path.name, found, f"at most {MOST_LARGER:.0%}, measured by the plate", advice)
    return _Scan(gripper.time, np.array(moved), np.array(centres), marker, seen, mapped)


def _marker(image: Picture, source: str) -> int:
    """Which of the gripper's markers is in view."""
    for number in plate.GRIPPERS:
        if Marker(str(plate.LONG.dictionary), number).corners(image) is not None:
            return number
    needed = f"marker {' or '.join(map(str, plate.GRIPPERS))} of the plate's sheet on the gripper"
    raise TrackingError(source, "no marker of the gripper in the first frame", needed)


def _trials(scan: _Scan) -> list[slice]:
    """The frames of each trial: from the strip laid flat to before it is laid flat again."""
    z = median_filter(scan.mapped.mapping.to_robot(scan.centres)[:, 1], 5, mode="nearest")
    up = z > z[0] + LIFTED
    ends = [0, *(np.flatnonzero(up[:-1] & ~up[1:]) + 1).tolist(), len(z)]
    high = z[0] + 0.5 * (z.max() - z[0])
    lifted = [end for begin, end in pairwise(ends) if z[begin:end].max() > high]
    return [slice(begin, end) for begin, end in pairwise([0, *lifted])] if len(lifted) > 1 else [slice(0, len(z))]


def _flat(source: str, scan: _Scan) -> tuple[Array, float]:
    """Place of the marker while the strip lay flat, x and z, m, and the time at which it was lifted, s."""
    places = scan.mapped.mapping.to_robot(scan.centres)
    z = median_filter(places[:, 1], 5, mode="nearest")
    lowest = int(np.argmin(z[: int(np.argmax(z)) + 1]))
    lifted = lowest + np.flatnonzero(z[lowest:] > z[lowest] + LIFTED)
    found = ""
    if not len(lifted):
        found = "a gripper that is never lifted"
    elif lifted[0] < 3:
        found = "a film that begins with the gripper on its way up"
    elif z.min() < z[lowest] - LIFTED:
        found = f"a gripper that is {1e3 * (z[lowest] - z.min()):.0f} mm lower later than in the first frames"
    if found:
        raise MeasurementError(source, found, "the strip flat on the table in the first frames", ADVICE)
    # At rest: where it stands still for the last time before it is lifted, up to where it moves.
    start = places[: lifted[0]]
    few = min(5, len(start) - 1)
    still = np.linalg.norm(start[few:] - start[:-few], axis=1) < AT_REST
    begins = np.flatnonzero(still & ~np.append(False, still[:-1]))
    first = int(begins[-1]) if len(begins) else 0
    rest = np.linalg.norm(start[first:] - start[first], axis=1) < AT_REST
    count = first + int(np.argmin(np.append(rest, False)))
    return np.median(start[first:count], axis=0), float(scan.time[max(count - 1, 1)])


def _pulled(
    source: str, time: Array, advance: Array, z: Array, height: float, lift: float
) -> tuple[float, float, float]:
    """Times from which on and up to which the strip is pulled steadily, s, and the speed, m/s."""
    up = np.flatnonzero((z > HIGH * height) & (time > lift))
    parts = [part for part in snap.advances(advance) if part.stop > up[0]]
    if not parts:
        raise MeasurementError(source, "a gripper that does not advance", "one that pulls the lifted strip", ADVICE)
    part = slice(max(parts[0].start, int(up[0])), parts[0].stop)
    t, x = time[part], advance[part]
    if len(t) < 10:
        raise MeasurementError(source, f"{len(t)} frames of the pull", "10 or more", ADVICE)
    speed = np.gradient(median_filter(x, 5, mode="nearest"), t)
    # The rate at either end, of two frames, is the noisiest: it counts once.
    smooth = np.convolve(np.pad(speed, 4, mode="reflect"), np.full(9, 1.0 / 9.0), "valid")
    moving = smooth[smooth > CRAWLING]
    usual = float(np.quantile(moving, PULLING)) if len(moving) else 0.0
    if usual <= 0.0:
        raise MeasurementError(source, "a gripper that does not advance", "one that pulls the lifted strip", ADVICE)
    fast = np.flatnonzero(smooth > FAST * usual)
    begin = float(t[fast[-1]] + SETTLING) if len(fast) else float(t[0])
    if begin >= t[-1]:
        found = f"a gripper that is {FAST:g} times as fast as usual up to {t[-1] - t[fast[-1]]:.1f} s before its end"
        raise MeasurementError(source, found, "one that pulls the lifted strip steadily", ADVICE)
    return begin, float(t[-1]), usual

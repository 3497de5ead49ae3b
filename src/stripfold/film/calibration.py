"""The calibration of a recording, its camera, folding plane and robot: a mapping, its quality and its uncertainty.

Of a camera the reprojection error alone says little: few views, or views that are all alike, fit well and predict
badly.  A calibration must therefore also cover the picture, contain no outlying view, and determine the focal length.
The robot grid, pictures of the gripper's marker at known places, fits the folding plane to the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.files.tables import read_table
from stripfold.film.boards import Board, Corners, Refinement, detect
from stripfold.film.camera import Camera, Mapping, fit_homography, fit_similarity, read_camera, rms, scale, transform
from stripfold.film.camera_motion import FIRST, Shift, since_stops
from stripfold.film.holder import Holder, holder_of
from stripfold.film.pictures import Shown, one_thread, picture_files, read_calibration_picture
from stripfold.film.recording import Entries, inside
from stripfold.film.video import Thumbnails

PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
MIN_VIEWS, MAX_VIEWS = 6, 100
OUTLIER = 3.0
"""Reprojection error of a view over the median of all views from which it is refused."""
MEDIAN_FLOOR = 0.05
"""Least median for that comparison, pixels: differences between nearly perfect views do not matter."""
MAX_RMS = 0.5
"""Reprojection error of all views, pixels."""
MIN_COVERAGE = 0.3
"""Share of the picture's area that the boards of all views cover."""
MAX_FOCAL_SD = 0.02
"""Relative standard deviation of the focal length."""
_SOURCE = "calibration pictures"
_ADVICE = "show the board tilted, near and far, and in every part of the picture"
MIN_STOPS, MAX_STOPS = 6, 100
"""Stops of the robot: a similarity has four unknowns, and its residuals must reveal a mistake."""
MAX_STOP_ERROR = 0.002
"""Distance, m, of a stop from where the other stops predict it."""
MAX_AWAY = 10.0
"""Largest distance of a stop from the middle of all, relative to the usual distance."""
MIN_SPREAD = 0.1
"""Extent of the stops across their principal direction over that along it."""
MAX_PLANE_RMS = 0.35
"""Residual of the folding plane's homography, pixels."""
MAX_SCALE_ERROR = 0.03
"""Relative difference between the robot's metre and that of the board."""
MAX_SIDE_ERROR, SIDE_BLUR = 0.05, 0.5
"""Relative error of the marker's measured side; pixels added to it: blur shrinks a black square."""
MAX_ROTATION = np.deg2rad(45.0)
"""Angle of the robot's z from upwards in the picture."""


class View(NamedTuple):
    """A picture of a board: file name and corners."""

    name: str
    corners: Corners


class CameraFit(NamedTuple):
    """A camera fitted to views: camera, the views' poses, shape (n, 6), their RMS errors, shape (n,), and total RMS."""

    camera: Camera
    poses: Array
    view_rms: Array
    rms: float


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera with the quality of its calibration.

    ``view_rms``, ``rms``: reprojection error (RMS) of each of n views and of all, pixels.  ``covariance``, shape (9,
    9), of :data:`PARAMETERS`, as if residuals were independent; ``inflation``: what the jackknife's standard deviations
    are of those, at least 1.  ``coverage``: share of the picture's area under the boards.
    """

    camera: Camera
    view_rms: Array
    rms: float
    covariance: Array
    coverage: float
    split_half: float
    inflation: float

    def draw(self, random: np.random.Generator) -> Camera:
        """A camera drawn from the uncertainty of the calibration."""
        # Scaled, because the variances span ten orders of magnitude.
        sd = np.sqrt(np.diag(self.covariance))
        root = np.linalg.cholesky(self.covariance / np.outer(sd, sd))
        change = self.inflation * sd * (root @ random.standard_normal(len(sd)))
        fx, fy, cx, cy, *distortion = parameters(self.camera) + change
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        return Camera(matrix, np.array(distortion), self.camera.size)


def parameters(camera: Camera) -> Array:
    """Shape (9,): :data:`PARAMETERS` of a camera."""
    k = camera.matrix
    return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *camera.distortion])


def find_views(
    folder: Path, board: Board, refinement: Refinement | None = None, shown: Shown | None = None
) -> tuple[list[View], tuple[int, int]]:
    """Find the views of a folder that show the board, and the pictures' width and height.

    ``shown``: how the film is shown, for pictures as its frames; by default those are the sensor's rows.

    Raises InvalidInputError: no folder, or an unreadable picture; CalibrationError: pictures of different sizes.
    """
    paths = picture_files(folder, MAX_VIEWS)
    height, width = read_calibration_picture(paths[0], shown=shown).shape
    found = [
        (path.name, detect(read_calibration_picture(path, (width, height), shown), board, refinement)) for path in paths
    ]
    return [View(name, corners) for name, corners in found if corners is not None], (width, height)


@one_thread()
def fit_camera(views: Sequence[View], size: tuple[int, int], start: Camera | None = None) -> CameraFit:
    """Fit a camera to views by OpenCV's bundle adjustment, starting from ``start`` if given."""
    points = [view.corners.object_points.astype(np.float32) for view in views]
    pixels = [view.corners.pixels.astype(np.float32) for view in views]
    flags = 0 if start is None else cv2.CALIB_USE_INTRINSIC_GUESS
    matrix = np.eye(3) if start is None else start.matrix.copy()
    distortion = np.zeros(5) if start is None else start.distortion.copy()
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-10)
    try:
        total, matrix, distortion, rotations, translations, *_, view_rms = cv2.calibrateCameraExtended(
            points, pixels, size, matrix, distortion, flags=flags, criteria=stop
        )
    except cv2.error as error:
        raise CalibrationError(
            _SOURCE, "views that no camera fits", "views of one flat board", "is the board as described?"
        ) from error
    poses = np.column_stack([np.reshape(rotations, (-1, 3)), np.reshape(translations, (-1, 3))])
    camera = Camera(np.asarray(matrix), np.asarray(distortion).ravel()[:5], size)
    return CameraFit(camera, poses, np.asarray(view_rms).ravel(), float(total))


def split_half(views: Sequence[View], whole: CameraFit) -> float:
    """RMS difference of the undistorted pixels of two cameras, fitted to the even and to the odd views; pixels.

    The best homography between them is removed, as the picture of the folding plane would do.
    """
    pixels = np.concatenate([view.corners.pixels for view in views])
    even, odd = (fit_camera(views[k::2], whole.camera.size, whole.camera).camera.undistort(pixels) for k in (0, 1))
    return rms(transform(fit_homography(even, odd), even) - odd)


def calibrate_camera(views: Sequence[View], size: tuple[int, int]) -> Intrinsics:
    """Fit a camera to views of one board, in pictures of width and height ``size``, and check the result.

    Raises CalibrationError: too few views, too small a coverage, an outlier, a large error, or views too similar.
    """
    require(
        len(views) >= MIN_VIEWS,
        _SOURCE,
        f"the board was found in {len(views)} pictures",
        f"{MIN_VIEWS} pictures or more that show the board",
        "compare its columns and rows with the description; a chessboard must be entirely visible, and in focus",
    )
    covered = coverage(views, size)
    found = f"the boards cover {covered:.1%} of the picture"
    require(covered >= MIN_COVERAGE, _SOURCE, found, f"{MIN_COVERAGE:.0%} or more", _ADVICE)
    whole = fit_camera(views, size)
    _refuse_bad_views(views, whole)
    spread, inflation = _uncertainty(views, whole)
    focal_sd = inflation * np.sqrt(np.diag(spread)[:2].max()) / whole.camera.matrix[0, 0]
    require(
        focal_sd < MAX_FOCAL_SD,
        _SOURCE,
        f"the focal length is uncertain by {focal_sd:.1%}",
        f"{MAX_FOCAL_SD:.0%} or better",
        f"the views are too similar: {_ADVICE}",
    )
    half = split_half(views, whole)
    return Intrinsics(whole.camera, whole.view_rms, whole.rms, spread, covered, half, inflation)


def _uncertainty(views: Sequence[View], whole: CameraFit) -> tuple[Array, float]:
    """Covariance of :data:`PARAMETERS` and the inflation of their standard deviations; see :class:`Intrinsics`."""
    n, size = len(views), whole.camera.size
    others = [fit_camera([*views[:i], *views[i + 1 :]], size, whole.camera) for i in range(n)]
    jackknife = (n - 1) * np.var([parameters(other.camera) for other in others], axis=0)
    try:
        with np.errstate(invalid="raise", divide="raise"):
            spread = covariance(views, whole)
            sd = np.sqrt(np.diag(spread))
            np.linalg.cholesky(spread / np.outer(sd, sd))  # raises unless positive definite
            inflation = float(np.sqrt(np.mean(jackknife / sd**2)))
    except (np.linalg.LinAlgError, FloatingPointError):
        inflation = float("nan")
    require(np.isfinite(inflation), _SOURCE, "views that do not determine a camera", "views that differ", _ADVICE)
    return spread, max(1.0, inflation)


def _refuse_bad_views(views: Sequence[View], whole: CameraFit) -> None:
    median = float(np.median(whole.view_rms))
    limit = OUTLIER * max(median, MEDIAN_FLOOR)
    bad = [(view.name, error) for view, error in zip(views, whole.view_rms, strict=True) if not error <= limit]
    require(
        not bad,
        ", ".join(f"{name} ({error:.2f} px)" for name, error in bad),
        f"a reprojection error more than {OUTLIER:g} times the median of {median:.2f} px",
        "views that agree with each other",
        "remove it if it is blurred, from another camera or zoom, or the board was bent or covered; calibrate again",
    )
    found = f"a reprojection error of {whole.rms:.2f} px"
    advice = "is the board flat, in focus, and the lens no fisheye?"
    require(whole.rms <= MAX_RMS, _SOURCE, found, f"{MAX_RMS:g} px or less", advice)


def require(condition: bool | np.bool_, *message: str) -> None:
    """Raise :class:`CalibrationError` with ``message`` unless the condition holds."""
    if not condition:
        raise CalibrationError(*message)


def coverage(views: Sequence[View], size: tuple[int, int]) -> float:
    """Share of the picture's area inside the convex hull of the corners of at least one view."""
    scale = min(1.0, 1000.0 / max(size))
    mask = np.zeros((round(size[1] * scale), round(size[0] * scale)), dtype=np.uint8)
    for view in views:
        hull = cv2.convexHull((view.corners.pixels * scale).astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
    return float(mask.mean())


def covariance(views: Sequence[View], whole: CameraFit) -> Array:
    """Shape (9, 9): covariance of :data:`PARAMETERS`, the poses being unknown too; residuals taken as independent."""
    n = len(PARAMETERS)
    normal = np.zeros((n, n))
    squares, freedom = 0.0, -n
    camera = whole.camera
    for view, pose in zip(views, whole.poses, strict=True):
        points = view.corners.object_points
        pixels, jacobian = cv2.projectPoints(points, pose[:3], pose[3:], camera.matrix, camera.distortion)
        of_pose, of_camera = jacobian[:, :6], jacobian[:, 6 : 6 + n]
        cross = of_pose.T @ of_camera
        # Schur complement of the normal matrix with respect to the pose.
        normal += of_camera.T @ of_camera - cross.T @ np.linalg.solve(of_pose.T @ of_pose, cross)
        squares += float(np.sum((np.asarray(pixels).reshape(-1, 2) - view.corners.pixels) ** 2))
        freedom += len(jacobian) - 6
    scale = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2.0 * (squares / freedom))


class Stops(NamedTuple):
    """The robot's stops: the pictures' ``names``, and their ``small`` copies, shape (n, h, w).

    ``corners``, shape (n, 4, 2), of the marker in pixels; ``places``, shape (n, 2), m, of its centre by the robot.
    """

    names: Sequence[str]
    corners: Array
    places: Array
    small: NDArray[np.uint8]

    def centres(self, camera: Camera, plane: Array) -> Array:
        """Shape (n, 2): the marker's centres in the folding plane, m, by the homography ``plane``."""
        corners = camera.undistort(self.corners.reshape(-1, 2))
        return np.asarray(transform(plane, corners).reshape(-1, 4, 2).mean(axis=1))


def find_stops(folder: Path, table: str, marker: Holder, size: tuple[int, int], shown: Shown | None = None) -> Stops:
    """Read the stops in a ``table`` image,x,z of the ``folder``, and find the marker in pictures of this ``size``.

    ``shown``: as in :func:`find_views`.

    Raises InvalidInputError: the table or a picture cannot be read, a picture is listed twice or lies outside the
    folder; CalibrationError: a picture of another size, or without the marker.
    """
    path = folder / table
    listed = read_table("robot grid", path, "image,x,z", (0, MAX_STOPS))
    places = listed.numbers(slice(1, None))
    names = [row[0].strip() for _, row in listed.rows]
    if len(set(names)) < len(names):
        raise InvalidInputError("robot grid", str(path), "a table in which each picture has one row")
    found, copies, small = [], [], Thumbnails(size).small
    for name in names:
        picture = inside(folder, Path(table).parent / name, "robot grid")
        seen = read_calibration_picture(picture, size, shown)
        corners = marker.corners(seen)
        if corners is None:
            raise CalibrationError(
                name,
                f"{marker.name} was not found",
                "the gripper's marker, or its template, in every picture of the robot grid",
                "take the picture again, in focus and without glare, or remove its row from the table",
            )
        found.append(corners)
        copies.append(small(seen))
    return Stops(names, np.array(found).reshape(-1, 4, 2), places, np.array(copies))


def fit_robot(centres: Array, stops: Stops) -> tuple[Array, float]:
    """Fit the similarity, shape (3, 3), from the markers' centres in the folding plane, shape (n, 2), m, to the robot.

    Returns it and the RMS distance, m, of each stop from where the others predict it.  Raises CalibrationError: a stop
    far away, stops on a line, an outlier, or stops that no similarity fits.
    """
    places, n = stops.places, len(stops.places)
    away = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    far = int(np.argmax(away))
    require(
        away[far] <= MAX_AWAY * np.median(away),
        stops.names[far],
        "a stop at x = {:g} and z = {:g} m, far from all others".format(*places[far]),
        f"at most {MAX_AWAY:g} times as far from their middle as the others",
        "is a decimal point missing in its row?",
    )
    for points in (places, centres):
        along, across = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        require(across > MIN_SPREAD * along, "robot grid", "stops on a line", "stops spread over x and z")
    whole = fit_similarity(centres, places)
    left_out = np.empty_like(places)
    for i in range(n):
        others = np.arange(n) != i
        left_out[i] = transform(fit_similarity(centres[others], places[others]), centres[[i]])[0] - places[i]
    # In the plane's metres: a table in millimetres is recognised by its scale, not by its residuals.
    left_out /= scale(whole)
    errors = np.linalg.norm(left_out, axis=1)
    worst = int(np.argmax(errors))
    require(
        errors[worst] <= MAX_STOP_ERROR,
        stops.names[worst] if errors[worst] > OUTLIER * np.median(errors) else "robot grid",
        f"a stop {errors[worst] * 1e3:.1f} mm from where the others predict it",
        f"{MAX_STOP_ERROR * 1e3:g} mm or less",
        "is each row right and its picture's, does the marker move in the folding plane, did the camera stay in place?",
    )
    return whole, rms(left_out)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A mapping from pixels to the robot with the data that it was fitted to, and its ``quality`` for reports.

    ``intrinsics`` is None if the camera was read from a file and is taken as exact; ``board``: in the folding plane.
    """

    mapping: Mapping
    intrinsics: Intrinsics | None
    board: Corners
    stops: Stops
    quality: dict[str, Any]
    relative = False
    """Whether places count from where the same marker was on the flat strip, so that its offset does not matter."""

    def shift(self, film: Thumbnails, frames: slice = slice(FIRST), place: Array | None = None) -> Shift:
        """Estimate how far some small frames of a film are shifted since the robot's stops: :func:`.since_stops`."""
        return since_stops(self.stops.small, film, frames, place)

    def resample(self, random: np.random.Generator) -> Mapping:
        """Draw a mapping: the camera by its covariance, plane and robot with noise of the size of their residuals.

        The size itself is drawn too, because few residuals determine it poorly.
        """
        camera = self.mapping.camera if self.intrinsics is None else self.intrinsics.draw(random)
        noise = _noise(self.quality["plane_rms"], len(self.board.pixels), 8, random)
        plane = fit_homography(camera.undistort(self.board.pixels + noise), self.board.object_points[:, :2])
        centres = self.stops.centres(camera, plane)
        noise = _noise(self.quality["robot_rms"], len(centres), 4, random)
        return Mapping(camera, fit_similarity(centres, self.stops.places + noise) @ plane)


def _noise(residual_rms: float, n: int, unknowns: int, random: np.random.Generator) -> Array:
    """Noise, shape (n, 2), that agrees with the RMS of the residuals after a fit of some unknowns."""
    # The sum of squared residuals is sd^2 times a chi-square variable with 2 n - unknowns degrees of freedom.
    sd = residual_rms * np.sqrt(n / random.chisquare(2 * n - unknowns))
    return np.asarray(random.normal(0.0, 1.0, (n, 2)) * sd)


def calibrate_folder(folder: Path, entries: Entries, shown: Shown | None = None) -> Calibration:
    """Calibrate a recording, given its entries: for its frames as they are shown, however the camera was held.

    ``shown``: how its film is shown; by default as the sensor's rows.

    Raises InvalidInputError: a missing or unreadable file; CalibrationError: not good enough to measure with.
    """
    described = entries.camera
    source: Intrinsics | Camera
    if described.intrinsics is not None:
        camera = read_camera(folder / described.intrinsics)
        source = camera = camera.of_film(shown) if shown else camera
    else:
        assert described.images is not None
        assert described.board is not None
        source = calibrate_camera(*find_views(folder / described.images, described.board, shown=shown))
        camera = source.camera
    path = folder / entries.plane.image
    board = detect(read_calibration_picture(path, camera.size, shown), entries.plane.board)
    if board is None:
        raise CalibrationError(
            path.name,
            "the board was not found",
            "a picture of the board in the folding plane",
            "compare its columns and rows with the description; it must be in focus, a chessboard entirely visible",
        )
    stops = find_stops(folder, entries.robot.grid, holder_of(folder, entries), camera.size, shown)
    side = None if entries.gripper.marker is None else entries.gripper.marker.size
    return assemble(source, board, stops, side, path.name)


def assemble(
    source: Intrinsics | Camera, board: Corners, stops: Stops, side: float | None, name: str = "plane"
) -> Calibration:
    """Make the calibration from the detected corners; ``quality`` has RMS of camera and plane in pixels, lengths in m.

    ``source``: the camera's calibration, or a camera that is taken as exact.  ``board``: in the folding plane, in the
    picture ``name``.  ``side`` of the gripper's marker, m.  Raises CalibrationError: not good enough to measure with.
    """
    camera, known = (source, None) if isinstance(source, Camera) else (source.camera, source)
    require(
        len(stops.places) >= MIN_STOPS,
        "robot grid",
        f"{len(stops.places)} stops",
        f"{MIN_STOPS} stops or more, better 8 to 12",
    )
    points = board.object_points[:, :2]
    plane = fit_homography(camera.undistort(board.pixels), points)
    plane_rms = rms(camera.distort(transform(np.linalg.inv(plane), points)) - board.pixels)
    require(
        plane_rms <= MAX_PLANE_RMS,
        name,
        f"corners {plane_rms:.2f} px off a plane",
        f"{MAX_PLANE_RMS:g} px or less",
        "is the board flat, and is this the camera, with the same zoom and focus?",
    )
    centres = stops.centres(camera, plane)
    robot, left_out_rms = fit_robot(centres, stops)
    mapping = Mapping(camera, robot @ plane)
    resolution = mapping.resolution(board.pixels.mean(axis=0))
    quality: dict[str, Any] = {
        "camera_from": "file" if known is None else "pictures",
        "camera_uncertainty": "taken as zero" if known is None else "from the views",
        "resolution": resolution,
        "robot_rms": rms(transform(robot, centres) - stops.places),
        "robot_scale": scale(robot),
        "stops": len(stops.places),
    }
    if side is not None:
        corners = mapping.to_robot(stops.corners.reshape(-1, 2)).reshape(-1, 4, 2)
        quality["marker_side"] = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()) / side
    if known is not None:
        quality |= {
            "camera_rms": known.rms,
            "camera_worst_view_rms": float(known.view_rms.max()),
            "camera_views": len(known.view_rms),
            "camera_coverage": known.coverage,
            "camera_split_half": known.split_half * resolution,
            "camera_inflation": known.inflation,
        }
    quality |= {"plane_rms": plane_rms, "robot_left_out_rms": left_out_rms}
    _check(mapping, board, quality, side)
    return Calibration(mapping, known, board, stops, quality)


def _check(mapping: Mapping, board: Corners, quality: dict[str, Any], side: float | None) -> None:
    """Raise :class:`CalibrationError` unless scale, marker size and orientation are plausible."""
    magnified = quality["robot_scale"]
    require(
        abs(magnified - 1.0) <= MAX_SCALE_ERROR,
        "robot grid",
        f"one metre of the board is {magnified:.3g} m of the robot",
        f"within {MAX_SCALE_ERROR:.0%} of 1 m",
        "are x and z in m, is the board's square as described, was the board held in the folding plane?",
    )
    if side is not None:
        allowed = MAX_SIDE_ERROR + SIDE_BLUR * quality["resolution"] / side
        require(
            abs(quality["marker_side"] - 1.0) <= allowed,
            "robot grid",
            f"markers with sides {quality['marker_side']:.3g} times as long as described",
            f"within {allowed:.0%}",
            "measure the marker's black square; is it in the folding plane?",
        )
    middle = board.pixels.mean(axis=0)
    x, z = np.diff(mapping.to_robot(np.array([middle, middle - [0.0, 1.0]])), axis=0)[0]
    angle = abs(np.arctan2(x, z))
    require(
        angle <= MAX_ROTATION,
        "robot grid",
        f"the robot's z is rotated by {np.rad2deg(angle):.0f} degrees from upwards in the pictures",
        f"{np.rad2deg(MAX_ROTATION):.0f} degrees or less",
        "are the columns x and z swapped, or a sign wrong, or the camera turned on its side?",
    )

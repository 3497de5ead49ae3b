"""Camera intrinsics from pictures of a board: fit, uncertainty, and criteria for acceptance.

The reprojection error alone says little: few views, or views that are all alike, fit well and predict badly.  A
calibration must therefore also cover the picture, contain no outlying view, and determine the focal length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError
from stripfold.film.boards import Board, Corners, Refinement, detect
from stripfold.film.camera import Camera
from stripfold.film.mapping import fit_homography, rms, transform
from stripfold.film.pictures import picture_files, read_calibration_picture
from stripfold.film.threads import one_thread

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


class View(NamedTuple):
    """A picture of a board: file name and corners."""

    name: str
    corners: Corners


class Fit(NamedTuple):
    """A camera fitted to views: camera, the views' poses, shape (n, 6), their RMS errors, shape (n,), and total RMS."""

    camera: Camera
    poses: Array
    view_rms: Array
    rms: float


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera with the quality of its calibration.

    ``view_rms``, ``rms``: reprojection error (RMS) of each of n views and of all, pixels.  ``covariance``: shape (9,
    9): of :data:`PARAMETERS`, as if the residuals were independent.  ``coverage``: share of the picture's area that the
    boards cover.  ``split_half``: see :func:`split_half`, pixels.  ``inflation``: jackknife standard deviation over
    that from ``covariance``, RMS over the parameters, at least 1: residuals within a view are correlated.
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


def find_views(folder: Path, board: Board, refinement: Refinement | None = None) -> tuple[list[View], tuple[int, int]]:
    """The views of a folder that show the board, and the pictures' width and height.

    Raises InvalidInputError: no such folder, or a picture that cannot be read; CalibrationError: pictures of different
    sizes.
    """
    paths = picture_files(folder, MAX_VIEWS)
    height, width = read_calibration_picture(paths[0]).shape
    found = [(path.name, detect(read_calibration_picture(path, (width, height)), board, refinement)) for path in paths]
    return [View(name, corners) for name, corners in found if corners is not None], (width, height)


@one_thread()
def fit(views: Sequence[View], size: tuple[int, int], start: Camera | None = None) -> Fit:
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
    return Fit(camera, poses, np.asarray(view_rms).ravel(), float(total))


def fit_without_each(views: Sequence[View], whole: Fit) -> list[Fit]:
    """The fits that leave out one view each, starting from the fit to all of them."""
    size, start = whole.camera.size, whole.camera
    return [fit([*views[:i], *views[i + 1 :]], size, start) for i in range(len(views))]


def split_half(views: Sequence[View], whole: Fit) -> float:
    """RMS difference of the undistorted pixels of two cameras, fitted to the even and to the odd views; pixels.

    The best homography between them is removed, as the picture of the folding plane would do.
    """
    pixels = np.concatenate([view.corners.pixels for view in views])
    even, odd = (fit(views[k::2], whole.camera.size, whole.camera).camera.undistort(pixels) for k in (0, 1))
    return rms(transform(fit_homography(even, odd), even) - odd)


def calibrate(views: Sequence[View], size: tuple[int, int]) -> Intrinsics:
    """Fit a camera to views of one board, in pictures of width and height ``size``, and check the result.

    Raises CalibrationError: too few views, views that leave too much of the picture uncovered, an outlying view, too
    large a reprojection error, or views too similar to determine the focal length.
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
    whole = fit(views, size)
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


def _uncertainty(views: Sequence[View], whole: Fit) -> tuple[Array, float]:
    """Covariance of :data:`PARAMETERS` and the inflation of their standard deviations; see :class:`Intrinsics`."""
    n = len(views)
    left_out = np.array([parameters(other.camera) for other in fit_without_each(views, whole)])
    jackknife = (n - 1) * left_out.var(axis=0)
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


def _refuse_bad_views(views: Sequence[View], whole: Fit) -> None:
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
    require(whole.rms <= MAX_RMS, _SOURCE, found, f"{MAX_RMS:g} px or less", "is the board flat, and in focus?")


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


def covariance(views: Sequence[View], whole: Fit) -> Array:
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

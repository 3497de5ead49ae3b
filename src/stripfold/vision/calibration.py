"""Intrinsics of a camera from pictures of a board: the fit, what it is worth, and when it is refused.

The root mean square of the reprojection says little: few pictures, or pictures that are all alike, fit well and predict
badly.  So a calibration must also cover the picture, hold no picture that stands out, and know its focal length; how
far it moves when a picture is left out, and how far its halves disagree, is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from stripfold.arrays import Array
from stripfold.errors import CalibrationError
from stripfold.vision import pictures
from stripfold.vision.boards import Board, Corners, Refinement, detect
from stripfold.vision.camera import Camera
from stripfold.vision.mapping import homography, rms, through

PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
FEWEST_VIEWS, MOST_VIEWS = 6, 100
STANDS_OUT = 3.0
"""A view whose RMS is more than this many times the median is refused."""
FLOOR = 0.05
"""A median RMS below this, pixels, counts as this: nearly perfect views differ by more than they matter."""
LARGEST_RMS = 0.5
"""Pixels."""
LEAST_COVERAGE = 0.3
"""Share of the picture's area that the boards must have been in, all views together."""
LARGEST_FOCAL_SD = 0.02
"""Standard deviation of the focal length, as a share of it: above, the views are too alike."""

ADVICE = "show the board tilted, near and far, and in every part of the picture"


class View(NamedTuple):
    """A picture of a board: its file's name and the corners in it."""

    name: str
    corners: Corners


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """A camera and what its calibration is worth.

    Attributes
    ----------
    camera
        The camera.
    names
        The views' file names.
    view_rms, rms
        Root mean square of the reprojection: shape (n,), of each view, and of all, pixels.
    covariance
        Shape (9, 9): of :data:`PARAMETERS`, from the residuals as if they were independent.
    coverage
        Share of the picture's area that the boards were in.
    left_out
        Shape (n, 9): the parameters without each view.
    left_out_rms
        Shape (n,): RMS of the fit without each view, pixels.
    split_half
        How far the cameras of every second view and of the others disagree where the views have corners, RMS, pixels;
        without what a homography takes away, because the folding plane's picture will.
    inflation
        By how much the parameters vary more between the views than the covariance says; at least 1.
    """

    camera: Camera
    names: tuple[str, ...]
    view_rms: Array
    rms: float
    covariance: Array
    coverage: float
    left_out: Array
    left_out_rms: Array
    split_half: float
    inflation: float

    @property
    def sd(self) -> Array:
        """Shape (9,): standard deviations of :data:`PARAMETERS`, from the residuals as if they were independent."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def draw(self, random: np.random.Generator) -> Camera:
        """A camera from the calibration's uncertainty."""
        # Scaled: the parameters' variances span ten orders of magnitude.
        sd = self.sd
        root = np.linalg.cholesky(self.covariance / np.outer(sd, sd))
        moved = parameters(self.camera) + self.inflation * sd * (root @ random.standard_normal(len(sd)))
        return camera_of(moved, self.camera.size)


class Fit(NamedTuple):
    """One fit of a camera to views: the camera, the views' poses, shape (n, 6), their RMS, shape (n,), and the RMS."""

    camera: Camera
    poses: Array
    view_rms: Array
    rms: float


def parameters(camera: Camera) -> Array:
    """Shape (9,): :data:`PARAMETERS` of a camera."""
    k = camera.matrix
    return np.array([k[0, 0], k[1, 1], k[0, 2], k[1, 2], *camera.distortion])


def camera_of(values: Array, size: tuple[int, int]) -> Camera:
    """The camera with :data:`PARAMETERS` ``values``."""
    fx, fy, cx, cy = values[:4]
    return Camera(np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), np.array(values[4:]), size)


def views_in(folder: Path, board: Board, refinement: Refinement | None = None) -> tuple[list[View], tuple[int, int]]:
    """The views of a folder that show the board, and the pictures' width and height.

    Raises
    ------
    InvalidInputError
        No such folder, or a picture that cannot be read.
    CalibrationError
        Pictures of different sizes.
    """
    views: list[View] = []
    paths = pictures.listed(folder, MOST_VIEWS)
    height, width = pictures.read(paths[0]).shape
    for path in paths:
        corners = detect(pictures.of_size(path, (width, height)), board, refinement)
        if corners is not None:
            views.append(View(path.name, corners))
    return views, (width, height)


def fit(views: Sequence[View], size: tuple[int, int], start: Camera | None = None) -> Fit:
    """Fit a camera to views, from ``start`` where there is one, with OpenCV's bundle adjustment."""
    points = [view.corners.object_points.astype(np.float32) for view in views]
    seen = [view.corners.pixels.astype(np.float32) for view in views]
    flags = 0 if start is None else cv2.CALIB_USE_INTRINSIC_GUESS
    matrix = np.eye(3) if start is None else start.matrix.copy()
    distortion = np.zeros(5) if start is None else start.distortion.copy()
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-10)
    try:
        total, matrix, distortion, turns, shifts, *_, each = cv2.calibrateCameraExtended(
            points, seen, size, matrix, distortion, flags=flags, criteria=stop
        )
    except cv2.error as error:
        raise CalibrationError(
            "calibration pictures", "views that no camera fits", "views of one flat board", "is the board as described?"
        ) from error
    poses = np.column_stack([np.reshape(turns, (-1, 3)), np.reshape(shifts, (-1, 3))])
    camera = Camera(np.asarray(matrix), np.asarray(distortion).ravel()[:5], size)
    return Fit(camera, poses, np.asarray(each).ravel(), float(total))


def calibrate(views: Sequence[View], size: tuple[int, int]) -> Intrinsics:
    """Fit a camera to views of a board and see whether it is good enough.

    Parameters
    ----------
    views
        Of one board, by one camera.
    size
        The pictures' width and height.

    Raises
    ------
    CalibrationError
        Too few views, views that leave too much of the picture empty, a view that stands out, too large residuals, or
        views too alike to know the focal length.
    """
    if len(views) < FEWEST_VIEWS:
        raise CalibrationError(
            "calibration pictures",
            f"the board in {len(views)} of them",
            f"{FEWEST_VIEWS} pictures or more that show the board",
            "compare its columns and rows with the description; the whole chessboard must be seen, sharp",
        )
    covered = coverage(views, size)
    if covered < LEAST_COVERAGE:
        raise CalibrationError(
            "calibration pictures", f"boards in {covered:.0%} of the picture", f"{LEAST_COVERAGE:.0%} or more", ADVICE
        )
    whole = fit(views, size)
    _refuse_bad_views(views, whole)
    others = [fit([*views[:i], *views[i + 1 :]], size, whole.camera) for i in range(len(views))]
    left_out = np.array([parameters(other.camera) for other in others])
    spread, sd, inflation = _spread(views, whole, left_out)
    focal_sd = inflation * sd[:2].max() / whole.camera.matrix[0, 0]
    if not focal_sd < LARGEST_FOCAL_SD:
        raise CalibrationError(
            "calibration pictures",
            f"a focal length known to {focal_sd:.1%}",
            f"{LARGEST_FOCAL_SD:.0%} or better",
            f"the views are too alike: {ADVICE}",
        )
    halves = [fit(views[k::2], size, whole.camera).camera for k in (0, 1)]
    everywhere = np.concatenate([view.corners.pixels for view in views])
    return Intrinsics(
        camera=whole.camera,
        names=tuple(view.name for view in views),
        view_rms=whole.view_rms,
        rms=whole.rms,
        covariance=spread,
        coverage=covered,
        left_out=left_out,
        left_out_rms=np.array([other.rms for other in others]),
        split_half=disagreement(halves[0], halves[1], everywhere),
        inflation=inflation,
    )


def _spread(views: Sequence[View], whole: Fit, left_out: Array) -> tuple[Array, Array, float]:
    """Covariance and standard deviations of :data:`PARAMETERS`, and by how much the views' differences exceed them."""
    try:
        with np.errstate(invalid="raise", divide="raise"):
            spread = covariance(views, whole)
            sd = np.sqrt(np.diag(spread))
            np.linalg.cholesky(spread / np.outer(sd, sd))
            ratios = jackknife_sd(left_out) / sd
    except (np.linalg.LinAlgError, FloatingPointError):
        ratios = np.array([np.nan])
    if not np.all(np.isfinite(ratios)):
        raise CalibrationError("calibration pictures", "views that no one camera fits", "views that differ", ADVICE)
    return spread, sd, max(1.0, float(np.sqrt(np.mean(ratios**2))))


def _refuse_bad_views(views: Sequence[View], whole: Fit) -> None:
    typical = max(float(np.median(whole.view_rms)), FLOOR)
    bad = [(view.name, off) for view, off in zip(views, whole.view_rms, strict=True) if not off <= STANDS_OUT * typical]
    if bad:
        told = ", ".join(f"{name} ({off:.2f} px)" for name, off in bad)
        raise CalibrationError(
            told,
            f"more than {STANDS_OUT:g} times the median of {np.median(whole.view_rms):.2f} px off",
            "views that agree with each other",
            "take it out if it is blurred or the board was bent or covered, and calibrate anew",
        )
    if not whole.rms <= LARGEST_RMS:
        raise CalibrationError(
            "calibration pictures",
            f"a reprojection error of {whole.rms:.2f} px",
            f"{LARGEST_RMS:g} px or less",
            "is the board flat, and are the pictures sharp?",
        )


def coverage(views: Sequence[View], size: tuple[int, int]) -> float:
    """Share of the picture's area that lies between the corners of a view or more."""
    scale = min(1.0, 1000.0 / max(size))
    mask = np.zeros((round(size[1] * scale), round(size[0] * scale)), dtype=np.uint8)
    for view in views:
        hull = cv2.convexHull((view.corners.pixels * scale).astype(np.float32))
        cv2.fillConvexPoly(mask, np.round(hull).astype(np.int32), 1)
    return float(mask.mean())


def covariance(views: Sequence[View], whole: Fit) -> Array:
    """Shape (9, 9): covariance of :data:`PARAMETERS`, the views' poses being fitted too."""
    n = len(PARAMETERS)
    normal = np.zeros((n, n))
    squares, freedom = 0.0, -n
    k, d = whole.camera.matrix, whole.camera.distortion
    for view, pose in zip(views, whole.poses, strict=True):
        seen, slopes = cv2.projectPoints(view.corners.object_points, pose[:3], pose[3:], k, d)
        own, shared = slopes[:, :6], slopes[:, 6 : 6 + n]
        cross = own.T @ shared
        # Schur's complement: what is left of the normal matrix when the pose is free.
        normal += shared.T @ shared - cross.T @ np.linalg.solve(own.T @ own, cross)
        squares += float(np.sum((np.asarray(seen).reshape(-1, 2) - view.corners.pixels) ** 2))
        freedom += slopes.shape[0] - 6
    scale = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2.0 * (squares / freedom))


def jackknife_sd(left_out: Array) -> Array:
    """Standard deviation of each column that its change when one row's view is left out tells."""
    n = len(left_out)
    return np.asarray(np.sqrt((n - 1) / n * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0)))


def disagreement(first: Camera, second: Camera, pixels: Array) -> float:
    """How far two cameras disagree at pixels, shape (n, 2): RMS, pixels, after the best homography."""
    one, other = first.undistort(pixels), second.undistort(pixels)
    return rms(through(homography(one, other), one) - other)


def reprojection(camera: Camera, corners: Corners) -> float:
    """RMS of the reprojection of one view with a known camera, its pose being fitted, pixels."""
    _, turn, shift = cv2.solvePnP(corners.object_points, corners.pixels, camera.matrix, camera.distortion)
    off = camera.project(corners.object_points, turn, shift) - corners.pixels
    return rms(off)

"""Calibration on public pictures of a chessboard and of a ChArUco board, and the published values explained.

Corners are refined in a window.  The published calibration used a half-window of 11 pixels and stopped early: in the
view whose corners are only 22 pixels apart the window reaches the next corner, and that view alone fits badly.  Here
the window grows with the corners' distance.  Pixels, m.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr

from stripfold.arrays import Array
from stripfold.errors import CalibrationError
from stripfold.vision import intrinsics
from stripfold.vision.boards import Board, Corners, Refinement, detect, spacing
from stripfold.vision.camera import read_camera, read_opencv_yaml
from stripfold.vision.intrinsics import PARAMETERS, View
from stripfold.vision.pictures import read_calibration_picture

CHESSBOARD = Board(type="chessboard", columns=9, rows=6, square=0.025)
CHARUCO = Board(type="charuco", columns=5, rows=7, square=0.04, marker=0.02, dictionary="6x6_250")
CHESSBOARD_FOLDER, CHARUCO_FOLDER = "opencv_calib", "opencv_charuco"
PUBLISHED, PUBLISHED_CHARUCO = "left_intrinsics.yml", "tutorial_camera_charuco.yml"
CHARUCO_PICTURE = "choriginal.jpg"
SCALED, FIXED, EARLY, SECTORS = "scaled", "fixed", "published", "sectors"
WAYS: dict[str, Refinement | None] = {
    SCALED: None,
    FIXED: Refinement(11),
    EARLY: Refinement(11, iterations=30, change=0.1),
}
"""How corners are refined; :data:`SECTORS` is OpenCV's other detector, findChessboardCornersSB."""
DISTANCE = 1.5
"""Of a folding plane from its camera, m, for which a disagreement is told in m."""


def run(images: str | Path, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Calibrations over ``way`` and ``view``.

    Parameters
    ----------
    images
        The folder with the folders :data:`CHESSBOARD_FOLDER` and :data:`CHARUCO_FOLDER`.

    Raises
    ------
    InvalidInputError
        A picture or file is missing or cannot be read.
    CalibrationError
        Our own way does not pass the checks, or another does not find every board.
    """
    images = Path(images)
    folder = images / CHESSBOARD_FOLDER
    views, size = intrinsics.find_views(folder, CHESSBOARD)
    ours = intrinsics.calibrate(views, size)
    names = [view.name for view in views]
    found: dict[str, list[Any]] = {
        key: [] for key in ("view_rms", "rms", "value", "sd", "left_out_focal", "left_out_rms", "split_half")
    }
    ways = [*WAYS, SECTORS]
    for way in ways:
        own = by_sectors(folder, names) if way == SECTORS else intrinsics.find_views(folder, CHESSBOARD, WAYS[way])[0]
        if [view.name for view in own] != names:
            raise CalibrationError(str(folder), f"{len(own)} boards ({way})", f"{len(names)} boards")
        fitted = intrinsics.fit(own, size)
        without = intrinsics.fit_without_each(own, fitted)
        found["view_rms"].append(fitted.view_rms)
        found["rms"].append(fitted.rms)
        found["value"].append(intrinsics.parameters(fitted.camera))
        found["sd"].append(np.sqrt(np.diag(intrinsics.covariance(own, fitted))))
        focal = np.array([intrinsics.parameters(other.camera)[0] for other in without])
        found["left_out_focal"].append(focal - fitted.camera.matrix[0, 0])
        found["left_out_rms"].append([other.rms for other in without])
        found["split_half"].append(intrinsics.split_half(own, fitted))
        if progress:
            progress(f"{way}: {fitted.rms:.4f} px, focal length {fitted.camera.matrix[0, 0]:.2f} px")
    published = read_opencv_yaml(folder / PUBLISHED)
    charuco = detect(read_calibration_picture(images / CHARUCO_FOLDER / CHARUCO_PICTURE), CHARUCO)
    if charuco is None:
        raise CalibrationError(CHARUCO_PICTURE, "no board", "the ChArUco board")
    camera = read_camera(images / CHARUCO_FOLDER / PUBLISHED_CHARUCO)
    table = {
        "view_rms": (("way", "view"), found["view_rms"], "pixel", "reprojection error of a view, RMS"),
        "rms": (("way",), found["rms"], "pixel", "reprojection error, RMS"),
        "value": (("way", "parameter"), found["value"], "1", "intrinsics; the first four in pixels"),
        "sd": (("way", "parameter"), found["sd"], "1", "their standard deviations if residuals were independent"),
        "left_out_focal": (("way", "view"), found["left_out_focal"], "pixel", "change of fx without a view"),
        "left_out_rms": (("way", "view"), found["left_out_rms"], "pixel", "RMS without a view"),
        "split_half": (("way",), found["split_half"], "pixel", "how far the halves' cameras disagree, RMS"),
        "split_half_length": (
            ("way",),
            np.array(found["split_half"]) * DISTANCE / np.array(found["value"])[:, 0],
            "m",
            f"the same, in a plane {DISTANCE:g} m away",
        ),
        "jackknife_sd": (("parameter",), intrinsics.jackknife_sd(ours.left_out), "1", "sd by leaving views out"),
        "inflation": ((), ours.inflation, "1", "jackknife's sd over sd, root mean square over the parameters"),
        "coverage": ((), ours.coverage, "1", "share of the picture's area that boards were in"),
        "spacing": (("view",), [spacing(view.corners.pixels) for view in views], "pixel", "smallest corner distance"),
        "half_window": (
            ("view",),
            [max(2, int(CHESSBOARD.window * spacing(view.corners.pixels))) for view in views],
            "pixel",
            "half-window of the refinement that grows with the corners' distance",
        ),
        "pixels": (
            ("view", "corner", "axis"),
            [view.corners.pixels for view in views],
            "pixel",
            "corners in the pictures",
        ),
        "size": (("axis",), np.array(size, dtype=np.float64), "pixel", "width and height of the pictures"),
        "published_rms": ((), float(published["avg_reprojection_error"]), "pixel", "published RMS"),
        "published_view_rms": (
            ("view",),
            [float(value) for value in published["per_view_reprojection_errors"]["data"]],
            "pixel",
            "published RMS of a view",
        ),
        "published_value": (
            ("parameter",),
            intrinsics.parameters(read_camera(folder / PUBLISHED)),
            "1",
            "published intrinsics; the first four in pixels",
        ),
        "charuco_rms": ((), intrinsics.reprojection_error(camera, charuco), "pixel", "ChArUco, published camera: RMS"),
        "charuco_corners": ((), float(len(charuco.ids)), "1", "corners found on the ChArUco board"),
    }
    coords = {
        "way": ("way", ways, {"units": "1", "long_name": "how corners were found"}),
        "view": ("view", names, {"units": "1", "long_name": "picture"}),
        "parameter": ("parameter", list(PARAMETERS), {"units": "1", "long_name": "intrinsic parameter"}),
        "axis": ("axis", ["x", "y"], {"units": "1", "long_name": "axis of the pictures"}),
    }
    data = {
        name: (dims, np.asarray(values, dtype=np.float64), {"units": unit, "long_name": text})
        for name, (dims, values, unit, text) in table.items()
    }
    return xr.Dataset(data, coords=coords)


def by_sectors(folder: Path, names: list[str]) -> list[View]:
    """Views of the chessboard by OpenCV's detector that needs no refinement; those it does not find are left out."""
    points = CHESSBOARD.points
    views = []
    for name in names:
        image = read_calibration_picture(folder / name)
        found, corners = cv2.findChessboardCornersSB(
            image, (CHESSBOARD.columns, CHESSBOARD.rows), flags=cv2.CALIB_CB_ACCURACY
        )
        if found:
            pixels: Array = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
            views.append(View(name, Corners(np.arange(len(points)), points, pixels)))
    return views

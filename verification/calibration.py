"""Calibration on public pictures of a chessboard and of a ChArUco board, against the published values.

Corners are refined in a window.  The published calibration used a half-window of 11 pixels and stopped early: in the
view whose corners are only 22 pixels apart the window reaches the next corner, and only that view fits badly.  The
window used here is proportional to the distance between corners.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from plots.pieces import note
from stripfold.base.errors import CalibrationError
from stripfold.draw.colours import BLACK, BLUE, GREY, SHADE, VERMILLION
from stripfold.draw.style import figure, legend_above, styled
from stripfold.film import calibration as intrinsics
from stripfold.film.boards import Board, Corners, Refinement, detect, spacing
from stripfold.film.camera import Camera, read_camera, read_opencv_yaml
from stripfold.film.camera import rms as rms_of
from stripfold.film.pictures import read_calibration_picture
from verification.common import Progress, dataset
from verification.numbers import Facts, Number

CHESSBOARD = Board(type="chessboard", columns=9, rows=6, square=0.025)
CHARUCO = Board(type="charuco", columns=5, rows=7, square=0.04, marker=0.02, dictionary="6x6_250")
CHESSBOARD_FOLDER, CHARUCO_FOLDER = "opencv_calib", "opencv_charuco"
PUBLISHED, PUBLISHED_CHARUCO = "left_intrinsics.yml", "tutorial_camera_charuco.yml"
CHARUCO_PICTURE = "choriginal.jpg"
SCALED, EARLY = "scaled", "published"
WAYS = {SCALED: None, EARLY: Refinement(11, iterations=30, change=0.1)}
"""How corners are refined: by default, and as for the published calibration."""


def run(images: str | Path = "../shared/data", progress: Progress | None = None) -> xr.Dataset:
    """Calibrations over ``way`` and ``view``, from the two folders of boards in ``images``.

    Raises InvalidInputError: a picture or file is missing or cannot be read; CalibrationError: a board is not found, or
    the default calibration is not accepted.
    """
    images = Path(images)
    folder, other = images / CHESSBOARD_FOLDER, images / CHARUCO_FOLDER
    views, size = intrinsics.find_views(folder, CHESSBOARD)
    names, pixels = [view.name for view in views], [view.corners.pixels for view in views]
    rows = []
    for way, refinement in WAYS.items():
        own, _ = intrinsics.find_views(folder, CHESSBOARD, refinement)
        if [view.name for view in own] != names:
            raise CalibrationError(str(folder), f"{len(own)} boards ({way})", f"{len(names)} boards")
        fitted = intrinsics.fit_camera(own, size)
        without = intrinsics.fit_without_each(own, fitted)
        focal = np.array([fit.camera.matrix[0, 0] for fit in without]) - fitted.camera.matrix[0, 0]
        value = intrinsics.parameters(fitted.camera)
        rows.append((fitted.view_rms, fitted.rms, value, focal, [fit.rms for fit in without]))
        if progress:
            progress(f"{way}: {fitted.rms:.4f} px, focal length {fitted.camera.matrix[0, 0]:.2f} px")
    view_rms, rms, value, left_out_focal, left_out_rms = (np.array(column) for column in zip(*rows, strict=True))
    published = read_opencv_yaml(folder / PUBLISHED)
    published_rms = [float(error) for error in published["per_view_reprojection_errors"]["data"]]
    published_value = intrinsics.parameters(read_camera(folder / PUBLISHED))
    charuco = detect(read_calibration_picture(other / CHARUCO_PICTURE), CHARUCO)
    if charuco is None:
        raise CalibrationError(CHARUCO_PICTURE, "no board", "the ChArUco board")
    charuco_rms = reprojection_error(read_camera(other / PUBLISHED_CHARUCO), charuco)
    data = {
        "view_rms": (("way", "view"), view_rms),
        "rms": ("way", rms),
        "value": (("way", "parameter"), value),
        "left_out_focal": (("way", "view"), left_out_focal),
        "left_out_rms": (("way", "view"), left_out_rms),
        "coverage": ((), intrinsics.calibrate_camera(views, size).coverage),
        "spacing": ("view", [spacing(seen) for seen in pixels]),
        "pixels": (("view", "corner", "axis"), pixels),
        "size": ("axis", np.array(size, dtype=np.float64)),
        "published_rms": ((), float(published["avg_reprojection_error"])),
        "published_view_rms": ("view", published_rms),
        "published_value": ("parameter", published_value),
        "charuco_rms": ((), charuco_rms),
        "charuco_corners": ((), float(len(charuco.ids))),
        "way": ("way", list(WAYS)),
        "view": ("view", names),
        "parameter": ("parameter", intrinsics.PARAMETERS),
        "axis": ("axis", ["x", "y"]),
    }
    return dataset(data)


def reprojection_error(camera: Camera, corners: Corners) -> float:
    """RMS reprojection error of one view, pixels; only its pose is fitted."""
    _, rotation, translation = cv2.solvePnP(corners.object_points, corners.pixels, camera.matrix, camera.distortion)
    return rms_of(camera.project(corners.object_points, rotation, translation) - corners.pixels)


def facts(d: xr.Dataset) -> Facts:
    views = d.view_rms.sel(way="scaled")
    return {"rms": d.rms.sel(way="scaled"), "views": views.size, "worst": views.max() / views.median()}


def facts_calibration(d: xr.Dataset) -> Facts:
    return {"rms": d.charuco_rms, "corners": int(d.charuco_corners)}


# fmt: off
NUMBERS = {
    facts: (
        Number("calibration_rms", "rms", "pixel", "< 0.25 pixel, no view over 3 times the median",
            "reprojection error of the public chessboard set, all {views} views, the worst {worst:.1f} times the "
            "median", lambda f: f.worst <= 3.0),
    ),
    facts_calibration: (
        Number("charuco_rms", "rms", "pixel", "< 0.25 pixel",
            "reprojection error of the public ChArUco picture with its published camera, {corners} corners"),
    ),
}
# fmt: on


TARGET = 0.25
"""RMS error to be reached by the calibration, pixels."""
DRAWN_WAYS = {
    SCALED: ("window that grows with the corners' distance", BLUE, -0.2),
    EARLY: ("half-window of 11 px, stopped at 0.1 px", VERMILLION, 0.2),
}
"""Text, colour and offset of the bars of each way to refine corners."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each view's RMS error, ours, with the fixed window, and as published; below, the places of the corners."""
    fig = figure(4.9)
    above, below = fig.subplots(2, 1, height_ratios=(1.0, 1.35))
    draw_views(above, data)
    draw_coverage(below, data)
    legend_above(fig, ncols=1)
    return fig


def draw_views(ax: Axes, data: xr.Dataset) -> None:
    """Bars of each view's RMS error, with the published values as marks."""
    names = [str(name).removeprefix("left").removesuffix(".jpg") for name in data["view"].values]
    x = np.arange(len(names))
    for way, (text, colour, offset) in DRAWN_WAYS.items():
        one = data.sel(way=way)
        ax.bar(x + offset, one["view_rms"].values, 0.4, color=colour, label=f"{text}: {float(one['rms']):.3f} px")
    label = f"published: {float(data['published_rms']):.3f} px"
    ax.plot(x + 0.2, data["published_view_rms"].values, "_", color=BLACK, ms=7.0, label=label)
    ax.axhline(TARGET, color=GREY, lw=0.8, ls="--", label=f"target for all views: {TARGET:g} px")
    ax.set_xticks(x, names)
    ax.grid(False, axis="x")
    ax.set(xlabel="view", ylabel="RMS error [px]")


def draw_coverage(ax: Axes, data: xr.Dataset) -> None:
    """The picture's outline, the area between the corners of each view, and the corners."""
    width, height = data["size"].values
    pixels = data["pixels"].values
    for i, view in enumerate(pixels):
        hull = view[ConvexHull(view).vertices]
        ax.add_patch(Polygon(hull, closed=True, fc=SHADE, ec="none", zorder=1)).set_label(f"_view-{i}")
    ax.plot(*pixels.reshape(-1, 2).T, ".", color=BLUE, ms=1.5, zorder=2, label="_corners")
    ax.set(aspect="equal", xlim=(0.0, width), ylim=(height, 0.0), xlabel="x [px]", ylabel="y [px]")
    ax.grid(False)
    note(ax, f"{100.0 * float(data['coverage']):.0f} % of the picture covered", "upper right")

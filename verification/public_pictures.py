"""Public pictures: cameras from a chessboard and a ChArUco board, and the centreline of a textile, as published.

Corners are refined in a window.  The published calibration used a half-window of 11 pixels and stopped early: in the
view whose corners are only 22 pixels apart the window reaches the next corner, and only that view fits badly.  The
window used here is proportional to the distance between corners.  The textile hangs out of a clamp; its midline is that
of P. H. Broberg et al., Composites Part B (2023), 110763; github.com/phbroberg/bendstiff (MIT).
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from plots.pieces import note
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.draw.colours import BLACK, BLUE, GREY, SHADE, VERMILLION
from stripfold.draw.style import figure, legend_above, styled
from stripfold.film import calibration, eta
from stripfold.film.boards import Board, Refinement, detect
from stripfold.film.camera import read_camera, read_opencv_yaml, rms
from stripfold.film.cantilever import Cantilever
from stripfold.film.pictures import read_calibration_picture, read_grey
from verification.common import dataset
from verification.numbers import Facts, Number

UNITS = {"m": "centreline_rms centreline_span"}

CHESSBOARD = Board(type="chessboard", columns=9, rows=6, square=0.025)
CHARUCO = Board(type="charuco", columns=5, rows=7, square=0.04, marker=0.02, dictionary="6x6_250")
CHESSBOARD_FOLDER, PUBLISHED = "opencv_calib", "left_intrinsics.yml"
CHARUCO_PICTURE, PUBLISHED_CHARUCO = "opencv_charuco/choriginal.jpg", "opencv_charuco/tutorial_camera_charuco.yml"
TEXTILE, MIDLINE = "bendstiff/test_image.jpg", "bendstiff/test_reference_midline.csv"
SCALE = 1.101e-4
"""Metres per pixel of the textile's picture, from its authors."""
TARGET = 0.25
"""RMS error to be reached by the calibration, pixels."""
WAYS = {
    "scaled": (None, "window that grows with the corners' distance", BLUE, -0.2),
    "published": (
        Refinement(11, iterations=30, change=0.1),
        "half-window of 11 px, stopped at 0.1 px",
        VERMILLION,
        0.2,
    ),
}
"""How corners are refined, by default and as published; text, colour and offset of the bars in the figure."""


def run(images: str | Path = "../shared/data") -> xr.Dataset:
    """Calibrate from both boards and measure the textile; ``images``: the folder of the pictures' folders.

    Raises InvalidInputError: a picture or file is missing; CalibrationError: a board is not found, or the default
    calibration is not accepted; TrackingError: the strip was not found.
    """
    images = Path(images)
    folder = images / CHESSBOARD_FOLDER
    views, size = calibration.find_views(folder, CHESSBOARD)
    names = [view.name for view in views]
    fitted = []
    for way, (refinement, *_) in WAYS.items():
        own, _ = calibration.find_views(folder, CHESSBOARD, refinement)
        if [view.name for view in own] != names:
            raise CalibrationError(str(folder), f"{len(own)} boards ({way})", f"{len(names)} boards")
        fitted.append(calibration.fit_camera(own, size))
    published = read_opencv_yaml(folder / PUBLISHED)
    seen, camera = detect(read_calibration_picture(images / CHARUCO_PICTURE), CHARUCO), images / PUBLISHED_CHARUCO
    if seen is None:
        raise CalibrationError(CHARUCO_PICTURE, "no board", "the ChArUco board")
    known = read_camera(camera)
    _, rotation, translation = cv2.solvePnP(seen.object_points, seen.pixels, known.matrix, known.distortion)
    distance, span = centreline(images)
    return dataset(
        {
            "view_rms": (("way", "view"), [fit.view_rms for fit in fitted]),
            "rms": ("way", [fit.rms for fit in fitted]),
            "coverage": ((), calibration.calibrate_camera(views, size).coverage),
            "pixels": (("view", "corner", "axis"), [view.corners.pixels for view in views]),
            "size": ("axis", np.array(size, dtype=np.float64)),
            "published_rms": ((), float(published["avg_reprojection_error"])),
            "published_view_rms": ("view", [float(e) for e in published["per_view_reprojection_errors"]["data"]]),
            "charuco_rms": ((), rms(known.project(seen.object_points, rotation, translation) - seen.pixels)),
            "charuco_corners": ((), float(len(seen.ids))),
            "centreline_rms": ((), distance),
            "centreline_span": ((), span),
            "way": ("way", list(WAYS)),
            "view": ("view", names),
            "axis": ("axis", ["x", "y"]),
        },
        units=UNITS,
    )


def centreline(images: Path) -> tuple[float, float]:
    """RMS distance of the textile's centreline from its authors' midline, and its horizontal extent, m.

    The height of the midline is relative to its first point, so the mean vertical distance is free.
    """
    shape = eta.from_image(read_grey(images / TEXTILE), SCALE, "cantilever", TEXTILE).fit
    assert isinstance(shape, Cantilever)
    assert shape.line is not None
    try:
        midline = np.loadtxt(images / MIDLINE, delimiter=",", comments="#", ndmin=2) * [1.0, -1.0]
    except (OSError, ValueError) as error:
        raise InvalidInputError("images", MIDLINE, "a table of two columns", str(error)) from error
    points = shape.line.points * SCALE
    x, y = points[np.argsort(points[:, 0])].T
    beside = midline[(midline[:, 0] >= x[0] - 1e-3) & (midline[:, 0] <= x[-1] + 1e-3)]
    away = np.interp(beside[:, 0], x, y) - beside[:, 1]
    slope = np.interp(beside[:, 0], x, np.gradient(y, x))
    return float(np.sqrt(np.mean(((away - away.mean()) / np.hypot(1.0, slope)) ** 2))), float(np.ptp(x))


def facts(d: xr.Dataset) -> Facts:
    views = d.view_rms.sel(way="scaled")
    return {
        "rms": d.rms.sel(way="scaled"),
        "views": views.size,
        "worst": views.max() / views.median(),
        "charuco": d.charuco_rms,
        "corners": int(d.charuco_corners),
        "centreline": 1e3 * d.centreline_rms,
        "span": 1e3 * d.centreline_span,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("calibration_rms", "rms", "pixel", "< 0.25 pixel, no view over 3 times the median",
            "reprojection error of the public chessboard set, all {views} views, the worst {worst:.1f} times the "
            "median", lambda f: f.worst <= 3.0),
        Number("charuco_rms", "charuco", "pixel", "< 0.25 pixel",
            "reprojection error of the public ChArUco picture with its published camera, {corners} corners"),
        Number("centreline_rms", "centreline", "mm", "< 0.25 mm",
            "rms distance of the centreline in the photograph of a textile from its authors' midline"),
        Number("centreline_span", "span", "mm", ">= 222 mm", "horizontal extent of that centreline", digits=4),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each view's RMS error, ours, with the fixed window, and as published; below, the places of the corners."""
    fig = figure(4.9)
    above, below = fig.subplots(2, 1, height_ratios=(1.0, 1.35))
    names = [str(name).removeprefix("left").removesuffix(".jpg") for name in data["view"].values]
    x = np.arange(len(names))
    for way, (_, text, colour, offset) in WAYS.items():
        one = data.sel(way=way)
        above.bar(x + offset, one["view_rms"].values, 0.4, color=colour, label=f"{text}: {float(one['rms']):.3f} px")
    label = f"published: {float(data['published_rms']):.3f} px"
    above.plot(x + 0.2, data["published_view_rms"].values, "_", color=BLACK, ms=7.0, label=label)
    above.axhline(TARGET, color=GREY, lw=0.8, ls="--", label=f"target for all views: {TARGET:g} px")
    above.set_xticks(x, names)
    above.grid(False, axis="x")
    above.set(xlabel="view", ylabel="RMS error [px]")

    pixels, (width, height) = data["pixels"].values, data["size"].values
    for i, view in enumerate(pixels):
        hull = view[ConvexHull(view).vertices]
        below.add_patch(Polygon(hull, closed=True, fc=SHADE, ec="none", zorder=1)).set_label(f"_view-{i}")
    below.plot(*pixels.reshape(-1, 2).T, ".", color=BLUE, ms=1.5, zorder=2, label="_corners")
    below.set(aspect="equal", xlim=(0.0, width), ylim=(height, 0.0), xlabel="x [px]", ylabel="y [px]")
    below.grid(False)
    note(below, f"{100.0 * float(data['coverage']):.0f} % of the picture covered", "upper right")
    legend_above(fig, ncols=1)
    return fig

"""Centrelines and eta_b in photographs of real strips, against what their authors report.

A textile that hangs out of a clamp (P. H. Broberg and others, Composites Part B, 2023, 110763, and their repository
bendstiff): the authors give a midline and a moment-curvature law.  The law is far from linear: the secant stiffness
falls by a factor of ten over the curvatures in the picture, the largest of which are next to the clamp.  One eta_b
cannot describe the strip; a fit of the whole shape is a weighted mean.

Yarn over a ledge (K. Singal and others, their repository stitch-by-stitch): pictures without a scale, cropped to
different sizes, with the free lengths in their names.  The thickness of the yarn that these lengths imply can be
compared between the pictures; it varies with the yarn and with the exposure, and checks lengths to about a tenth.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import xarray as xr

from stripfold.arrays import Array, Picture
from stripfold.errors import InvalidInputError
from stripfold.store import variable
from stripfold.vision import eta
from stripfold.vision.centreline import find
from stripfold.vision.pictures import read_grey

Variables = dict[str, xr.Variable]

TEXTILE = "bendstiff/test_image.jpg"
MIDLINE = "bendstiff/test_reference_midline.csv"
LAW = "bendstiff/test_reference_moment_curvature.csv"
YARN = "yarn_bending/acrylic_{}_1.jpg"
SCALE = 1.101e-4
"""Metres per pixel of the textile's picture, from its authors."""
AREAL_LOAD = 13.6
"""Weight per area of the textile, N m^-2, from its authors."""
GRAVITY = 9.81
YARN_LENGTHS = (0.10, 0.15, 0.20, 0.25)
"""Free lengths of the yarn, m, in the names of its pictures."""
SHARES = np.linspace(0.1, 1.0, 10)
"""Curvatures, relative to the largest, at which the secant of the fitted law is stored."""


def run(images: Path, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Measure all pictures in ``images``.

    Raises
    ------
    InvalidInputError
        A picture or a reference is missing.
    TrackingError
        A strip was not found.
    """
    data = _textile(images) | _yarn(images)
    if progress:
        progress(f"textile: {1e3 * float(data['centreline_rms'].values):.3f} mm from the authors' midline")
    attrs = {
        "textile_source": "P. H. Broberg et al., Composites Part B (2023), 110763; github.com/phbroberg/bendstiff, MIT",
        "yarn_source": "K. Singal et al., github.com/sabetta/stitch-by-stitch, MIT",
    }
    return xr.Dataset(data, attrs=attrs)


def _textile(images: Path) -> Variables:
    found = eta.from_image(read_grey(images / TEXTILE), SCALE, "cantilever", TEXTILE)
    line, power, exponent = found.line, found.power, found.exponent
    assert line is not None
    assert power is not None
    assert exponent is not None
    reference = _table(images / MIDLINE) * [1.0, -1.0]
    law = _table(images / LAW)
    curvature, moment = law[law[:, 0] > 0.0].T
    distance, shift, covered = _distances(line.points * SCALE, reference)
    low, high = found.interval
    secants = [found.secant(float(share)) for share in SHARES]

    rms = float(np.sqrt(np.mean(distance**2)))
    return {
        "centreline_rms": variable((), rms, "m", "RMS distance of the authors' midline from the centreline"),
        "centreline_span": variable((), np.ptp(line.points[:, 0]) * SCALE, "m", "horizontal extent of the centreline"),
        "reference_covered": variable((), covered, "1", "share of the authors' midline with a centreline next to it"),
        "eta_b": variable((), found.eta_b, "m-4 s2", "weight-to-bending-stiffness ratio of the linear fit"),
        "eta_b_lower": variable((), low, "m-4 s2", "lower end of the 95 % interval of eta_b"),
        "eta_b_upper": variable((), high, "m-4 s2", "upper end of the 95 % interval of eta_b"),
        "eta_b_secant": variable((), secants[-1], "m-4 s2", "secant eta_b of M ~ kappa^n at largest_curvature"),
        "fit_rms": variable((), found.residual, "m", "RMS residual of the linear strip"),
        "fit_power_rms": variable((), power.rms * SCALE, "m", "RMS residual with the law M ~ kappa^n"),
        "exponent": variable((), exponent[0], "1", "n of the law M ~ kappa^n"),
        "exponent_lower": variable((), exponent[1], "1", "lower end of the 95 % interval of n"),
        "exponent_upper": variable((), exponent[2], "1", "upper end of the 95 % interval of n"),
        "linear": variable((), float(bool(found.linear)), "1", "1 if the interval of n contains 1"),
        "largest_curvature": variable((), power.curvature / SCALE, "m-1", "largest curvature of that fit"),
        "x": variable("point", line.points[:, 0] * SCALE, "m", "centreline, horizontal"),
        "z": variable("point", -line.points[:, 1] * SCALE, "m", "centreline, upwards from the top of the picture"),
        "sd": variable("point", line.sd * SCALE, "m", "standard deviation of the centreline, normal to it"),
        "reference_x": variable("reference", reference[:, 0], "m", "the authors' midline, horizontal"),
        "reference_z": variable("reference", -reference[:, 1] - shift, "m", "the same, upwards, shifted to the line"),
        "reference_distance": variable("beside", distance, "m", "distance of the authors' midline, normal to the line"),
        "reference_curvature": variable("law", curvature, "m-1", "curvature of the authors' moment-curvature law"),
        "reference_eta_b": variable("law", AREAL_LOAD / GRAVITY * curvature / moment, "m-4 s2", "secant of that law"),
        "share": variable("share", SHARES, "1", "curvature / largest curvature of the fitted law"),
        "secant_eta_b": variable("share", np.array(secants), "m-4 s2", "eta_b of the secant of the law M ~ kappa^n"),
    }


def _yarn(images: Path) -> Variables:
    pictures = [read_grey(images / YARN.format(round(100 * length))) for length in YARN_LENGTHS]
    lines = [find(image, points=eta.POINTS, source=YARN) for image in pictures]
    pixels = np.array([line.length for line in lines])
    thickness = np.array([np.median(line.width) for line in lines]) * YARN_LENGTHS / pixels
    by_rows = [_length_by_rows(image) for image in pictures]
    return {
        "yarn": variable("yarn", YARN_LENGTHS, "m", "free length of the yarn, by its name"),
        "yarn_pixels": variable("yarn", pixels, "1", "yarn: length of the centreline, pixels"),
        "yarn_rows_pixels": variable("yarn", by_rows, "1", "yarn: length by the rows of Otsu's mask, pixels"),
        "yarn_thickness": variable("yarn", thickness, "m", "yarn: median width, if its length is the named one"),
    }


def _length_by_rows(image: Picture) -> float:
    """The yarn's length in pixels by another method: the middle of each row of Otsu's mask, from border to end.

    Right for yarn that hangs; where it leaves the ledge a row contains much of it, and its middle is taken.
    """
    _, mask = cv2.threshold(cv2.GaussianBlur(image, (0, 0), 3.0), 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(np.asarray(mask, dtype=np.uint8))
    part = labels == 1 + int(np.argmax(boxes[1:, 4]))
    part = part[part.any(axis=1)]
    middles = np.array([np.flatnonzero(row).mean() for row in part])
    # Smoothed over a few widths, the length of the twist of its strands.
    size = int(np.median(part.sum(axis=1)))
    middles = np.convolve(np.pad(middles, size, mode="edge"), np.ones(2 * size + 1) / (2 * size + 1), "valid")
    return float(np.hypot(np.diff(middles), 1.0).sum())


def _distances(points: Array, reference: Array) -> tuple[Array, float, float]:
    """Distances of reference points normal to the curve, the vertical shift between the two, and the share covered.

    The height of the reference is relative to its first point, so the mean vertical distance is free.
    """
    order = np.argsort(points[:, 0])
    x, y = points[order].T
    beside = (reference[:, 0] >= x[0] - 1e-3) & (reference[:, 0] <= x[-1] + 1e-3)
    away = np.interp(reference[beside, 0], x, y) - reference[beside, 1]
    slope = np.interp(reference[beside, 0], x, np.gradient(y, x))
    shift = float(np.mean(away))
    return (away - shift) / np.hypot(1.0, slope), shift, float(beside.mean())


def _table(path: Path) -> Array:
    try:
        return np.loadtxt(path, delimiter=",", comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise InvalidInputError("images", str(path), "a table of two columns", str(error)) from error

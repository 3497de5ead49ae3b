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

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr

from stripfold.arrays import Array, Picture
from stripfold.errors import InvalidInputError
from stripfold.material import GRAVITY
from stripfold.vision import eta
from stripfold.vision.centreline import find
from stripfold.vision.pictures import read_grey
from studies.common import Progress, dataset

TEXTILE = "bendstiff/test_image.jpg"
MIDLINE = "bendstiff/test_reference_midline.csv"
LAW = "bendstiff/test_reference_moment_curvature.csv"
YARN = "yarn_bending/acrylic_{}_1.jpg"
SCALE = 1.101e-4
"""Metres per pixel of the textile's picture, from its authors."""
AREAL_LOAD = 13.6
"""Weight per area of the textile, N m^-2, from its authors."""
YARN_LENGTHS = (0.10, 0.15, 0.20, 0.25)
"""Free lengths of the yarn, m, in the names of its pictures."""
SHARES = np.linspace(0.1, 1.0, 10)
"""Curvatures, relative to the largest, at which the secant of the fitted law is stored."""


def run(images: str | Path, progress: Progress | None = None) -> xr.Dataset:
    """Measure all pictures in ``images``.

    Raises
    ------
    InvalidInputError
        A picture or a reference is missing.
    TrackingError
        A strip was not found.
    """
    data = _textile(Path(images)) | _yarn(Path(images))
    if progress:
        progress(f"textile: {1e3 * data['centreline_rms'][1]:.3f} mm from the authors' midline")
    attrs = {
        "textile_source": "P. H. Broberg et al., Composites Part B (2023), 110763; github.com/phbroberg/bendstiff, MIT",
        "yarn_source": "K. Singal et al., github.com/sabetta/stitch-by-stitch, MIT",
    }
    return dataset("centrelines", data, attrs)


def _textile(images: Path) -> dict[str, tuple[Any, Any]]:
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
        "centreline_rms": ((), rms),
        "centreline_span": ((), np.ptp(line.points[:, 0]) * SCALE),
        "reference_covered": ((), covered),
        "eta_b": ((), found.eta_b),
        "eta_b_lower": ((), low),
        "eta_b_upper": ((), high),
        "eta_b_secant": ((), secants[-1]),
        "fit_rms": ((), found.residual),
        "fit_power_rms": ((), power.rms * SCALE),
        "exponent": ((), exponent[0]),
        "exponent_lower": ((), exponent[1]),
        "exponent_upper": ((), exponent[2]),
        "linear": ((), float(bool(found.linear))),
        "largest_curvature": ((), power.curvature / SCALE),
        "x": ("point", line.points[:, 0] * SCALE),
        "z": ("point", -line.points[:, 1] * SCALE),
        "sd": ("point", line.sd * SCALE),
        "reference_x": ("reference", reference[:, 0]),
        "reference_z": ("reference", -reference[:, 1] - shift),
        "reference_distance": ("beside", distance),
        "reference_curvature": ("law", curvature),
        "reference_eta_b": ("law", AREAL_LOAD / GRAVITY * curvature / moment),
        "share": ("share", SHARES),
        "secant_eta_b": ("share", np.array(secants)),
    }


def _yarn(images: Path) -> dict[str, tuple[Any, Any]]:
    pictures = [read_grey(images / YARN.format(round(100 * length))) for length in YARN_LENGTHS]
    lines = [find(image, points=eta.POINTS, source=YARN) for image in pictures]
    pixels = np.array([line.length for line in lines])
    thickness = np.array([np.median(line.width) for line in lines]) * YARN_LENGTHS / pixels
    by_rows = [_length_by_rows(image) for image in pictures]
    return {
        "yarn": ("yarn", YARN_LENGTHS),
        "yarn_pixels": ("yarn", pixels),
        "yarn_rows_pixels": ("yarn", by_rows),
        "yarn_thickness": ("yarn", thickness),
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

"""Centrelines and eta_b in photographs of real strips, against what their authors say of them.

A textile that hangs out of a clamp (P. H. Broberg and others, Composites Part B, 2023, 110763, and their repository
bendstiff): the authors give a midline and a moment-curvature law.  That law is far from linear: the secant stiffness
falls by a factor of ten over the curvatures that occur, so one eta_b cannot describe the strip; a fit of its whole
shape weighs them.  The authors' law puts the largest curvatures next to the clamp.

Yarn over a ledge (K. Singal and others, their repository stitch-by-stitch): pictures without a scale, cropped to
different sizes, and the free lengths in their names.  What can be compared is the thickness of the one yarn that the
named lengths imply; it varies with the yarn and with the exposure, so it checks lengths to about a tenth only.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError, TrackingError
from stripfold.vision import eta
from stripfold.vision.centreline import Centreline, find
from stripfold.vision.pictures import read_grey

TEXTILE = "bendstiff/test_image.jpg"
SCALE = 1.101e-4
"""Metres per pixel of the textile's picture, from its authors."""
AREAL_LOAD = 13.6
"""Weight per area of the textile, N m^-2, from its authors."""
GRAVITY = 9.81
MIDLINE = "bendstiff/test_reference_midline.csv"
LAW = "bendstiff/test_reference_moment_curvature.csv"
YARN = "yarn_bending/acrylic_{}_1.jpg"
YARN_LENGTHS = (0.10, 0.15, 0.20, 0.25)
"""Free lengths in the names of the yarn's pictures, m."""
POINTS = eta.POINTS
SHARES = np.linspace(0.1, 1.0, 10)
"""Curvatures at which the fitted law's secant is given, in its largest."""


def run(images: str | Path, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Measure all pictures in ``images``.

    Raises
    ------
    InvalidInputError
        A picture or a reference is missing.
    TrackingError
        A strip was not found.
    """
    say = progress or (lambda line: None)
    data = _textile(Path(images)) | _yarn(Path(images))
    say(f"textile: {1e3 * data['centreline_rms'][1]:.3f} mm off the authors' midline")
    variables = {
        name: (dims, values, {"units": TEXTS[name][0], "long_name": TEXTS[name][1]})
        for name, (dims, values) in data.items()
    }
    coords = {
        "yarn": ("yarn", np.array(YARN_LENGTHS), {"units": "m", "long_name": "free length of the yarn, by its name"}),
        "share": ("share", SHARES, {"units": "1", "long_name": "curvature / largest curvature of the fitted law"}),
    }
    attrs = {
        "textile_source": "P. H. Broberg et al., Composites Part B (2023), 110763; github.com/phbroberg/bendstiff, MIT",
        "yarn_source": "K. Singal et al., github.com/sabetta/stitch-by-stitch, MIT",
    }
    return xr.Dataset(variables, coords=coords, attrs=attrs)


Values = dict[str, tuple[Any, Any]]


def _textile(images: Path) -> Values:
    image = read_grey(images / TEXTILE)
    found = eta.from_image(image, SCALE, "cantilever", TEXTILE)
    line, shape, power = found.line, found.shape, found.power
    assert line is not None
    assert shape is not None
    assert power is not None
    exponent = found.exponent
    assert exponent is not None
    reference = _table(images / MIDLINE) * [1.0, -1.0]
    law = _table(images / LAW)
    law = law[law[:, 0] > 0.0]
    distance, shift, covered = _distances(line.points * SCALE, reference)
    low, high = found.interval
    scalars = {
        "centreline_rms": float(np.sqrt(np.mean(distance**2))),
        "centreline_span": float(np.ptp(line.points[:, 0])) * SCALE,
        "centreline_arc": line.length * SCALE,
        "reference_span": float(np.ptp(reference[:, 0])),
        "reference_arc": float(np.linalg.norm(np.diff(reference, axis=0), axis=1).sum()),
        "reference_covered": covered,
        "eta_b": found.eta_b,
        "eta_b_lower": low,
        "eta_b_upper": high,
        "eta_b_secant": found.secant(1.0),
        "fit_rms": found.residual,
        "fit_power_rms": power.rms * SCALE,
        "exponent": exponent[0],
        "exponent_lower": exponent[1],
        "exponent_upper": exponent[2],
        "linear": float(bool(found.linear)),
        "largest_curvature": power.curvature / SCALE,
    }
    values: Values = {name: ((), value) for name, value in scalars.items()}
    values |= {
        "x": ("point", line.points[:, 0] * SCALE),
        "z": ("point", -line.points[:, 1] * SCALE),
        "sd": ("point", line.sd * SCALE),
        "fit_x": ("point", shape.points[:, 0] * SCALE),
        "fit_z": ("point", -shape.points[:, 1] * SCALE),
        "fit_residual": ("point", shape.residual * SCALE),
        "fit_power_residual": ("point", power.residual * SCALE),
        "reference_x": ("reference", reference[:, 0]),
        "reference_z": ("reference", -(reference[:, 1] + shift)),
        "reference_distance": ("beside", distance),
        "reference_curvature": ("law", law[:, 0]),
        "reference_moment": ("law", law[:, 1]),
        "reference_eta_b": ("law", AREAL_LOAD / GRAVITY * law[:, 0] / law[:, 1]),
        "secant_eta_b": ("share", np.array([found.secant(float(share)) for share in SHARES])),
    }
    return values


def _yarn(images: Path) -> Values:
    lines = [
        find(read_grey(images / YARN.format(round(100 * length))), points=POINTS, source=f"yarn of {length:g} m")
        for length in YARN_LENGTHS
    ]
    scales = [length / line.length for line, length in zip(lines, YARN_LENGTHS, strict=True)]
    thickness = np.array([scale * float(np.median(line.width)) for line, scale in zip(lines, scales, strict=True)])
    columns: dict[str, list[float]] = {"yarn_eta_b": [], "yarn_eta_b_lower": [], "yarn_eta_b_upper": []}
    for length, scale in zip(YARN_LENGTHS, scales, strict=True):
        columns["yarn_eta_b"].append(np.nan)
        columns["yarn_eta_b_lower"].append(np.nan)
        columns["yarn_eta_b_upper"].append(np.nan)
        try:
            found = eta.from_image(read_grey(images / YARN.format(round(100 * length))), scale, "cantilever")
        except TrackingError:
            continue  # crooked by itself more than by its weight: stored as no number, which the text says
        columns["yarn_eta_b"][-1] = found.eta_b
        columns["yarn_eta_b_lower"][-1], columns["yarn_eta_b_upper"][-1] = found.interval
    values: Values = {
        "yarn_pixels": ("yarn", np.array([line.length for line in lines])),
        "yarn_rows_pixels": ("yarn", np.array([_by_rows(images, length) for length in YARN_LENGTHS])),
        "yarn_thickness": ("yarn", thickness),
        "yarn_score": ("yarn", np.array([float(line.score.min()) for line in lines])),
        "yarn_x": (("yarn", "point"), np.array([_scaled(*one)[:, 0] for one in zip(lines, scales, strict=True)])),
        "yarn_z": (("yarn", "point"), np.array([-_scaled(*one)[:, 1] for one in zip(lines, scales, strict=True)])),
    }
    return values | {name: ("yarn", np.array(column)) for name, column in columns.items()}


def _scaled(line: Centreline, scale: float) -> Array:
    return line.points * scale


def _by_rows(images: Path, length: float) -> float:
    """The yarn's length in pixels by another way: the middle of each row of Otsu's mask, from border to end.

    Good for yarn that hangs; where it leaves the ledge a row holds much of it, and the middle of it is taken.
    """
    image = read_grey(images / YARN.format(round(100 * length)))
    _, mask = cv2.threshold(cv2.GaussianBlur(image, (0, 0), 3.0), 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats(np.asarray(mask, dtype=np.uint8))
    part = labels == 1 + int(np.argmax(boxes[1:, 4]))
    rows = np.flatnonzero(part.any(axis=1))
    middles = np.array([np.flatnonzero(part[row]).mean() for row in rows])
    width = float(np.median(part[rows].sum(axis=1)))
    # Without the twist of its strands, which is a few widths long.
    size = int(width)
    middles = np.convolve(np.pad(middles, size, mode="edge"), np.ones(2 * size + 1) / (2 * size + 1), "valid")
    return float(np.hypot(np.diff(middles), 1.0).sum())


def _distances(points: Array, reference: Array) -> tuple[Array, float, float]:
    """Distances of reference points normal to the curve, the vertical shift between the two, and the share covered.

    The reference starts at zero height wherever its picture's first column had it: the mean vertical distance is free.
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


TEXTS = {
    "centreline_rms": ("m", "textile: root mean square distance of the authors' midline from the centreline"),
    "centreline_span": ("m", "textile: horizontal extent of the centreline"),
    "centreline_arc": ("m", "textile: length of the centreline"),
    "reference_span": ("m", "textile: horizontal extent of the authors' midline"),
    "reference_arc": ("m", "textile: length of the polygon through the authors' midline"),
    "reference_covered": ("1", "textile: share of the authors' midline beside which the centreline was found"),
    "eta_b": ("m-4 s2", "textile: weight-to-bending-stiffness ratio of the linear strip nearest to its shape"),
    "eta_b_lower": ("m-4 s2", "textile: lower end of the 95 % interval of eta_b"),
    "eta_b_upper": ("m-4 s2", "textile: upper end of the 95 % interval of eta_b"),
    "eta_b_secant": ("m-4 s2", "textile: eta_b of the secant at the largest curvature of the fitted law M ~ kappa^n"),
    "fit_rms": ("m", "textile: root mean square residual of the linear strip"),
    "fit_power_rms": ("m", "textile: root mean square residual with the law M ~ kappa^n"),
    "exponent": ("1", "textile: n of the law M ~ kappa^n"),
    "exponent_lower": ("1", "textile: lower end of the 95 % interval of n"),
    "exponent_upper": ("1", "textile: upper end of the 95 % interval of n"),
    "linear": ("1", "textile: 1 where the interval of n holds 1, 0 where the strip is not linear"),
    "largest_curvature": ("m-1", "textile: largest curvature of the fit with M ~ kappa^n"),
    "x": ("m", "textile: centreline, horizontal"),
    "z": ("m", "textile: centreline, upwards from the upper border of the picture"),
    "sd": ("m", "textile: standard deviation of the centreline, normal to it"),
    "fit_x": ("m", "textile: linear strip fitted to it, horizontal"),
    "fit_z": ("m", "textile: linear strip fitted to it, upwards"),
    "fit_residual": ("m", "textile: centreline less linear strip, normal to it"),
    "fit_power_residual": ("m", "textile: centreline less strip with M ~ kappa^n, normal to it"),
    "reference_x": ("m", "textile: the authors' midline, horizontal"),
    "reference_z": ("m", "textile: the authors' midline, upwards, shifted to the centreline's mean height"),
    "reference_distance": ("m", "textile: distance of the authors' midline from the centreline, normal to it"),
    "reference_curvature": ("m-1", "textile: curvature of the authors' moment-curvature law"),
    "reference_moment": ("N", "textile: moment per width of the authors' moment-curvature law"),
    "reference_eta_b": ("m-4 s2", "textile: eta_b of the secant of the authors' law"),
    "secant_eta_b": ("m-4 s2", "textile: eta_b of the secant of the fitted law M ~ kappa^n"),
    "yarn_pixels": ("1", "yarn: length of the centreline, pixels"),
    "yarn_rows_pixels": ("1", "yarn: length by the middles of the rows of Otsu's mask, pixels"),
    "yarn_thickness": ("m", "yarn: median width of the band, if the centreline is as long as the name says"),
    "yarn_score": ("1", "yarn: lowest score along the centreline"),
    "yarn_x": ("m", "yarn: centreline, horizontal, if it is as long as the name says"),
    "yarn_z": ("m", "yarn: centreline, upwards, if it is as long as the name says"),
    "yarn_eta_b": ("m-4 s2", "yarn: eta_b of the linear strip nearest to its shape; nan where its shape says nothing"),
    "yarn_eta_b_lower": ("m-4 s2", "yarn: lower end of the 95 % interval of eta_b"),
    "yarn_eta_b_upper": ("m-4 s2", "yarn: upper end of the 95 % interval of eta_b"),
}

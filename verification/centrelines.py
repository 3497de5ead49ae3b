"""The centreline and eta_b of a textile in a photograph, against what its authors report.

The textile hangs out of a clamp (P. H. Broberg and others, Composites Part B, 2023, 110763, and their repository
bendstiff): the authors give a midline and a moment-curvature law.  The law is far from linear: the secant stiffness
falls by a factor of ten over the curvatures in the picture, the largest of which are next to the clamp.  One eta_b
cannot describe the strip; a fit of the whole shape is a weighted mean.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.film import eta
from stripfold.film.cantilever import Cantilever
from stripfold.film.pictures import read_grey
from verification.common import dataset
from verification.numbers import Facts, Number

UNITS = {
    "m": "centreline_rms centreline_span",
    "m-1": "curvature reference_curvature",
    "m-4 s2": "eta_b eta_b_lower eta_b_upper reference_eta_b secant_eta_b",
}

TEXTILE = "bendstiff/test_image.jpg"
MIDLINE = "bendstiff/test_reference_midline.csv"
LAW = "bendstiff/test_reference_moment_curvature.csv"
SCALE = 1.101e-4
"""Metres per pixel of the textile's picture, from its authors."""
AREAL_LOAD = 13.6
"""Weight per area of the textile, N m^-2, from its authors."""
SHARES = np.linspace(0.1, 1.0, 10)
"""Curvatures, relative to the largest, at which the secant of the fitted law is stored."""


def run(images: str | Path = "../shared/data") -> xr.Dataset:
    """Measure the picture in ``images``.

    Raises InvalidInputError: the picture or a reference is missing; TrackingError: the strip was not found.
    """
    folder = Path(images)
    found = eta.from_image(read_grey(folder / TEXTILE), SCALE, "cantilever", TEXTILE)
    shape = found.fit
    assert isinstance(shape, Cantilever)
    assert shape.line is not None
    assert shape.power is not None
    law = _table(folder / LAW)
    curvature, moment = law[law[:, 0] > 0.0].T
    distance, covered = _distances(shape.line.points * SCALE, _table(folder / MIDLINE) * [1.0, -1.0])
    values = {
        "centreline_rms": ((), np.sqrt(np.mean(distance**2))),
        "centreline_span": ((), np.ptp(shape.line.points[:, 0]) * SCALE),
        "reference_covered": ((), covered),
        "eta_b": ((), found.eta_b),
        "eta_b_lower": ((), found.interval[0]),
        "eta_b_upper": ((), found.interval[1]),
        "exponent_upper": ((), shape.law[2]),
        "linear": ((), float(shape.linear)),
        "reference_curvature": ("law", curvature),
        "reference_eta_b": ("law", AREAL_LOAD / GRAVITY * curvature / moment),
        "curvature": ("share", SHARES * shape.power.curvature / SCALE),
        "secant_eta_b": ("share", [shape.secant(float(share), SCALE) for share in SHARES]),
    }
    source = "P. H. Broberg et al., Composites Part B (2023), 110763; github.com/phbroberg/bendstiff, MIT"
    return dataset(values, {"textile_source": source}, units=UNITS)


def _distances(points: Array, reference: Array) -> tuple[Array, float]:
    """Distances of reference points normal to the curve, and the share covered.

    The height of the reference is relative to its first point, so the mean vertical distance is free.
    """
    order = np.argsort(points[:, 0])
    x, y = points[order].T
    beside = (reference[:, 0] >= x[0] - 1e-3) & (reference[:, 0] <= x[-1] + 1e-3)
    away = np.interp(reference[beside, 0], x, y) - reference[beside, 1]
    slope = np.interp(reference[beside, 0], x, np.gradient(y, x))
    return (away - np.mean(away)) / np.hypot(1.0, slope), float(beside.mean())


def _table(path: Path) -> Array:
    try:
        return np.loadtxt(path, delimiter=",", comments="#", ndmin=2)
    except (OSError, ValueError) as error:
        raise InvalidInputError("images", str(path), "a table of two columns", str(error)) from error


def facts(d: xr.Dataset) -> Facts:
    return {"rms": 1e3 * d.centreline_rms, "span": 1e3 * d.centreline_span}


# fmt: off
NUMBERS = {
    facts: (
        Number("centreline_rms", "rms", "mm", "< 0.25 mm",
            "rms distance of the centreline in the photograph of a textile from its authors' midline"),
        Number("centreline_span", "span", "mm", ">= 222 mm", "horizontal extent of that centreline", digits=4),
    ),
}
# fmt: on

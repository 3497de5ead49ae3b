"""The critical points of all materials in one dataset, and the elastica's master curve beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from stripfold import elastica, schema
from stripfold.schema import Variable

PER_HEIGHT = (
    "snap",
    "lambda_0",
    "lambda_c",
    "lambda_c_lower",
    "lambda_c_upper",
    "lambda_c_eigenvalue",
    "detectors_agree",
    "lambda_end",
    "lambda_error",
    "free_length",
    "contact_folds",
    "height",
)
PER_MATERIAL = ("eta_b", "eta_m", "gravity_length", "thickness", "length")
STAR = {
    "z": Variable("1", "gripper height / L*", "z / L*"),
    "lambda_c": Variable("1", "critical advance of the gripper / L*", "lambda_c / L*"),
    "free_length": Variable("1", "free length at the critical point / L*"),
}
"""Variables of the master curve: in L*."""


def critical_points(runs: Mapping[str, xr.Dataset], labels: Mapping[str, str]) -> xr.Dataset:
    """Per material and height what the x-axis study found; rows padded with nan.

    Parameters
    ----------
    runs
        Datasets of :func:`.xaxis.run` by the material's name.
    labels
        How figures call each material.
    """
    names = list(runs)
    n = max(run.sizes["height"] for run in runs.values())

    def padded(values: xr.DataArray) -> np.ndarray:
        row = np.full(n, np.nan)
        row[: values.size] = values.values
        return row

    dims = ("material", "height_index")
    reasons = np.full((len(names), n), "", dtype=object)
    for row, m in zip(reasons, names, strict=True):
        row[: runs[m].sizes["height"]] = runs[m]["reason"].values
    return schema.dataset(
        {
            **{key: (dims, np.stack([padded(runs[m][key]) for m in names])) for key in PER_HEIGHT},
            **{key: ("material", [runs[m].attrs[key] for m in names]) for key in PER_MATERIAL},
            "reason": (dims, reasons),
            "label": ("material", [labels[m] for m in names]),
            "material": ("material", names),
        }
    )


def master_curve(heights: Sequence[float]) -> xr.Dataset:
    """The elastica's critical points, in L*, at ``heights`` above its touch limit."""
    curve = elastica.master_curve(np.asarray(heights))
    values = {"z": ("z", heights), "lambda_c": ("z", curve.advance), "free_length": ("z", curve.length)}
    return schema.dataset(values, {"touch_limit": elastica.touch_limit()}, table=STAR)

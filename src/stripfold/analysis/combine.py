"""The critical points of all materials in one dataset, and the elastica's master curve beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica

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
)
PER_MATERIAL = {"eta_b": "m-4 s2", "eta_m": "m-2 s2", "gravity_length": "m", "thickness": "m", "length": "m"}


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

    first = runs[names[0]]
    dims = ("material", "height_index")
    data: dict[str, Any] = {
        key: (dims, np.stack([padded(runs[m][key]) for m in names]), first[key].attrs) for key in PER_HEIGHT
    }
    reasons = np.full((len(names), n), "", dtype=object)
    for row, m in zip(reasons, names, strict=True):
        row[: runs[m].sizes["height"]] = runs[m]["reason"].values
    data["reason"] = (dims, reasons, first["reason"].attrs)
    data["height"] = (dims, np.stack([padded(runs[m]["height"]) for m in names]), first["height"].attrs)
    for key, units in PER_MATERIAL.items():
        values = np.array([runs[m].attrs[key] for m in names])
        data[key] = ("material", values, {"units": units, "long_name": key.replace("_", " ")})
    text = np.array([labels[m] for m in names], dtype=object)
    data["label"] = ("material", text, {"units": "1", "long_name": "label"})
    coords = {"material": ("material", np.array(names, dtype=object), {"units": "1", "long_name": "material"})}
    return xr.Dataset(data, coords=coords)


def master_curve(heights: Sequence[float]) -> xr.Dataset:
    """The elastica's critical points, in L*, at ``heights`` above its touch limit."""
    curve = elastica.master_curve(np.asarray(heights))
    return xr.Dataset(
        {
            "lambda_c": ("z", curve.advance, {"units": "1", "long_name": "critical advance / L*"}),
            "free_length": ("z", curve.length, {"units": "1", "long_name": "free length at the critical point / L*"}),
        },
        coords={"z": ("z", np.asarray(heights), {"units": "1", "long_name": "gripper height / L*"})},
        attrs={"touch_limit": elastica.touch_limit()},
    )

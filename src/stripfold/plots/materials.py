"""The critical points of several materials in one dataset: what it holds, and how its materials are named.

The dataset has the dimensions ``material`` and ``height_index`` and is padded with nan; in SI units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.plots.style import Look, look

NO_SNAP = "sag touches first: no snap"
"""How figures call a height at which lambda has no maximum."""

ETA_TITLE = r"$\eta_b$ [m$^{-4}$ s$^2$]"
"""Title of a legend of materials."""


class Points(NamedTuple):
    """Heights of one material, ascending, without padding; shape (m,), m.

    ``first`` is lambda_0; ``advance`` is lambda_c where ``snap``, elsewhere lambda where the advance ended;
    ``error`` is the estimate of its error.
    """

    height: Array
    advance: Array
    error: Array
    first: Array
    snap: NDArray[np.bool_]


def names(data: xr.Dataset) -> list[str]:
    """Names of the materials, in the dataset's order, which decides their colours."""
    return [str(name) for name in data["material"].values]


def looks(data: xr.Dataset) -> list[tuple[str, Look]]:
    """Name and look of each material."""
    return [(name, look(i)) for i, name in enumerate(names(data))]


def points(data: xr.Dataset, material: str) -> Points:
    """The heights of one material.

    Raises
    ------
    InvalidInputError
        No such material.
    """
    if material not in names(data):
        raise InvalidInputError("material", material, f"one of {', '.join(names(data))}")
    one = data.sel(material=material)
    order = np.argsort(one["height"].values)
    one = one.isel(height_index=order[np.isfinite(one["height"].values[order])])
    snap = one["snap"].values > 0
    advance = np.where(snap, one["lambda_c"].values, one["lambda_end"].values)
    return Points(one["height"].values, advance, one["lambda_error"].values, one["lambda_0"].values, snap)


def eta(data: xr.Dataset, material: str) -> str:
    """``eta_b`` of a material for a legend under :data:`ETA_TITLE`, with its name where it has one."""
    one = data.sel(material=material)
    label = str(one["label"].values)
    number = f"{float(f'{float(one.eta_b):.3g}'):.10g}"
    return number if label.startswith("η_b") else f"{number}: {label}".replace("η_b", r"$\eta_b$")

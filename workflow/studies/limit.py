"""The solid against the elastica as eta_m goes to zero: lambda_c at one height, on ever thinner strips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.static import End, StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.material import Material
from studies.common import blank, dataset


def run(
    eta_b: float, length_star: float, height: float, eta_m: Sequence[float], refinements: Sequence[float]
) -> xr.Dataset:
    """lambda_c of the solid, L*, for each ``eta_m`` (m^-2 s^2) on each mesh, coarse to fine, and the elastica's.

    Raises
    ------
    SolveError
        A run cannot be computed, or ends without a snap.
    """
    truth = elastica.critical(height).advance
    lambda_c = blank(len(eta_m), len(refinements))
    thickness = [Material(eta_b, value).relative_thickness for value in eta_m]
    for i, j in np.ndindex(lambda_c.shape):
        found = solve_height(StripModel(length_star, thickness[i]), height, refinements[j], past=0.0)
        if found.end is not End.SNAP:
            raise SolveError(f"no snap at eta_m = {eta_m[i]:g}, refinement {refinements[j]:g}: {found.end.reason}")
        lambda_c[i, j] = found.lam
    difference = lambda_c - truth
    order = np.diff(np.log(np.abs(difference[:, -1]))) / np.diff(np.log(np.asarray(eta_m)))
    both = ("eta_m", "refinement")
    return dataset(
        "limit",
        {
            "eta_m": ("eta_m", eta_m),
            "refinement": ("refinement", refinements),
            "lambda_c": (both, lambda_c),
            "lambda_c_elastica": ((), truth),
            "difference": (both, difference),
            "mesh_error": ("eta_m", np.abs(lambda_c[:, -1] - lambda_c[:, -2])),
            "order": ("eta_m", [np.nan, *order]),
            "thickness": ("eta_m", thickness),
        },
        {"eta_b": eta_b, "height_star": height, "length_star": length_star},
    )

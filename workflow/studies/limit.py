"""The solid against the elastica as eta_m goes to zero: lambda_c at one height, on ever thinner strips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.static import End, StripModel, solve_height
from stripfold.material import Material


def run(
    eta_b: float, length_star: float, height: float, eta_m: Sequence[float], refinements: Sequence[float]
) -> xr.Dataset:
    """lambda_c of the solid for each ``eta_m``, on each mesh.

    Parameters
    ----------
    eta_b
        m^-4 s^2.
    length_star, height
        Length of the strip and gripper height, L*.
    eta_m
        m^-2 s^2, shape (n,).
    refinements
        Factors on the element lengths, coarse to fine, shape (m,).

    Returns
    -------
    Dataset with ``lambda_c`` of dims (eta_m, refinement) and the elastica's, in L*.
    """
    truth = elastica.critical(height)
    lambda_c = np.full((len(eta_m), len(refinements)), np.nan)
    thickness = np.array([Material(eta_b, value).relative_thickness for value in eta_m])
    for i, h in enumerate(thickness):
        for j, refinement in enumerate(refinements):
            found = solve_height(StripModel(length_star, float(h)), height, refinement, past=0.0)
            if found.end is not End.SNAP:
                raise ValueError(f"no snap at eta_m = {eta_m[i]:g}, refinement {refinement:g}: {found.end.reason}")
            lambda_c[i, j] = found.last.lam
    difference = lambda_c - truth.advance
    order = np.full(len(eta_m), np.nan)
    order[1:] = np.diff(np.log(np.abs(difference[:, -1]))) / np.diff(np.log(np.asarray(eta_m)))
    return xr.Dataset(
        {
            "lambda_c": (("eta_m", "refinement"), lambda_c, {"units": "1", "long_name": "solid's lambda_c / L*"}),
            "lambda_c_elastica": ((), truth.advance, {"units": "1", "long_name": "elastica's lambda_c / L*"}),
            "difference": (("eta_m", "refinement"), difference, {"units": "1", "long_name": "solid - elastica, / L*"}),
            "mesh_error": (
                "eta_m",
                np.abs(lambda_c[:, -1] - lambda_c[:, -2]),
                {"units": "1", "long_name": "change of lambda_c / L* from the last refinement"},
            ),
            "order": (
                "eta_m",
                order,
                {"units": "1", "long_name": "order of the difference in eta_m, from the value before"},
            ),
            "thickness": ("eta_m", thickness, {"units": "1", "long_name": "h / L*"}),
        },
        coords={
            "eta_m": ("eta_m", list(eta_m), {"units": "m-2 s2", "long_name": "weight-to-membrane-stiffness ratio"}),
            "refinement": ("refinement", list(refinements), {"units": "1", "long_name": "factor on element lengths"}),
        },
        attrs={"eta_b": eta_b, "height_star": height, "length_star": length_star},
    )

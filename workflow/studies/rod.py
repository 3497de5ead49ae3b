"""The rod against the solid and the elastica: lambda_c over thickness and height.  All in L*."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.prediction import ElasticaPrediction, from_near_the_end
from stripfold.analysis.static import End, StripModel
from stripfold.errors import SolveError
from studies.common import Progress, blank, dataset

MODELS = ("rod", "solid")


def run(
    length_star: float,
    heights: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c of both models and of the elastica.

    Parameters
    ----------
    length_star
        Length of the strip, L*.
    heights, thicknesses
        Gripper heights and thicknesses h, L*.
    refinement
        Factor on the element lengths; the same runs at twice it tell the meshes' errors.

    Raises
    ------
    SolveError
        A run that cannot be computed, or that ends without a snap.
    """
    say = progress or (lambda _: None)
    shape = len(MODELS), len(heights), len(thicknesses)
    lambda_c, mesh_error = blank(*shape), blank(*shape)
    for at in np.ndindex(*lambda_c.shape):
        model, z, h = MODELS[at[0]], heights[at[1]], thicknesses[at[2]]
        say(f"{model}, z = {z:g} L*, h = {h:g} L*")
        fine, coarse = (_critical(model, length_star, h, z, r) for r in (refinement, 2.0 * refinement))
        lambda_c[at], mesh_error[at] = fine, abs(fine - coarse)
    truth = np.array([elastica.critical(z).advance for z in heights])
    over = ("model", "height", "thickness")
    rod, solid = lambda_c
    return dataset(
        "rod",
        {
            "model": ("model", MODELS),
            "height": ("height", heights),
            "thickness": ("thickness", thicknesses),
            "lambda_c": (over, lambda_c),
            "mesh_error": (over, mesh_error),
            "lambda_c_elastica": ("height", truth),
            "model_error": (over[1:], rod / solid - 1.0),
            "thickness_effect": (over[1:], solid / truth[:, None] - 1.0),
        },
        {"length_star": length_star},
    )


def _critical(model: str, length: float, thickness: float, height: float, refinement: float) -> float:
    """lambda_c."""
    run = from_near_the_end(StripModel(length, thickness, kind=model), ElasticaPrediction.at(height), refinement)
    if run.end is not End.SNAP:
        raise SolveError(f"no snap of the {model} at h = {thickness:g}, z = {height:g} L*: {run.end.reason}")
    return run.lam

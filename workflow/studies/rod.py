"""The rod against the solid and the elastica: lambda_c over thickness and height, and over the element length.

The first shows the error of the model, the second that of its mesh.  All in L*.
"""

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
FINER = {"rod": 0.5, "solid": 1.0}
"""Factor on the refinement at which the models are compared: the rod's elements have no node at their middle."""


def run(
    length_star: float,
    heights: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    thickness: float,
    height: float,
    refinements: Sequence[float],
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c of both models and of the elastica.

    Parameters
    ----------
    length_star
        Length of the strip, L*.
    heights, thicknesses
        Gripper heights and thicknesses h at which the models are compared, L*.
    refinement
        Factor on the element lengths for that, times :data:`FINER`; the same runs at twice it tell the meshes' errors.
    thickness, height
        Where the models' convergence is measured, L*.
    refinements
        Factors on the element lengths for that, coarse to fine; the last is the reference.

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
        own = FINER[model] * refinement
        fine, coarse = (_critical(model, length_star, h, z, r)[0] for r in (own, 2.0 * own))
        lambda_c[at], mesh_error[at] = fine, abs(fine - coarse)
    truth = np.array([elastica.critical(z).advance for z in heights])
    size, found = blank(len(MODELS), len(refinements)), blank(len(MODELS), len(refinements))
    for i, j in np.ndindex(*size.shape):
        say(f"{MODELS[i]}, elements {refinements[j]:g} times the standard ones")
        found[i, j], size[i, j] = _critical(MODELS[i], length_star, thickness, height, refinements[j])
    over, meshes = ("model", "height", "thickness"), ("model", "refinement")
    rod, solid = lambda_c
    return dataset(
        "rod",
        {
            "model": ("model", MODELS),
            "height": ("height", heights),
            "thickness": ("thickness", thicknesses),
            "refinement": ("refinement", refinements),
            "lambda_c": (over, lambda_c),
            "mesh_error": (over, mesh_error),
            "lambda_c_elastica": ("height", truth),
            "model_error": (over[1:], rod / solid - 1.0),
            "thickness_effect": (over[1:], solid / truth[:, None] - 1.0),
            "size": (meshes, size),
            "lambda_c_mesh": (meshes, found),
            "error": (meshes, found / found[:, -1:] - 1.0),
        },
        {"length_star": length_star, "thickness_star": thickness, "height_star": height},
    )


def _critical(model: str, length: float, thickness: float, height: float, refinement: float) -> tuple[float, float]:
    """lambda_c and the length of the free element at the lift-off."""
    strip = StripModel(length, thickness, kind=model)
    run = from_near_the_end(strip, ElasticaPrediction.at(height), refinement)
    if run.end is not End.SNAP:
        raise SolveError(f"no snap of the {model} at h = {thickness:g}, z = {height:g} L*: {run.end.reason}")
    ends = run.last.model.ends
    lift_off = int(np.argmin(np.abs(ends - run.free_length)))
    return run.lam, float(ends[lift_off] - ends[lift_off - 1])

"""The rod against the solid and the elastica: lambda_c over thickness and height, and over the element length.

What the rod lacks shows in the first, what its mesh costs in the second.  All in L*.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis import locate_rod
from stripfold.analysis.static import End, StripModel, solve_height
from stripfold.errors import SolveError

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
    progress: Callable[[str], None] | None = None,
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
    shape = (len(MODELS), len(heights), len(thicknesses))
    lambda_c, mesh_error = np.empty(shape), np.empty(shape)
    for at in np.ndindex(*shape):
        model, z, h = MODELS[at[0]], heights[at[1]], thicknesses[at[2]]
        say(f"{model}, z = {z:g} L*, h = {h:g} L*")
        own = FINER[model] * refinement
        fine, coarse = (_critical(model, length_star, h, z, r)[0] for r in (own, 2.0 * own))
        lambda_c[at], mesh_error[at] = fine, abs(fine - coarse)
    truth = np.array([elastica.critical(z).advance for z in heights])
    size, found = np.empty((len(MODELS), len(refinements))), np.empty((len(MODELS), len(refinements)))
    for i, model in enumerate(MODELS):
        for j, r in enumerate(refinements):
            say(f"{model}, elements {r:g} times the standard ones")
            found[i, j], size[i, j] = _critical(model, length_star, thickness, height, r)
    over, meshes = ("model", "height", "thickness"), ("model", "refinement")
    rod, solid = lambda_c

    def one(dims: tuple[str, ...], values: np.ndarray, what: str) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
        return dims, values, {"units": "1", "long_name": what}

    return xr.Dataset(
        {
            "lambda_c": one(over, lambda_c, "lambda_c / L*"),
            "mesh_error": one(over, mesh_error, "change of lambda_c / L* from the mesh half as fine"),
            "lambda_c_elastica": one(over[1:2], truth, "the elastica's lambda_c / L*"),
            "model_error": one(over[1:], rod / solid - 1.0, "rod over solid, minus one"),
            "thickness_effect": one(over[1:], solid / truth[:, None] - 1.0, "solid over elastica, minus one"),
            "size": one(meshes, size, "length of the shortest element / L*, near the lift-off"),
            "lambda_c_mesh": one(meshes, found, "lambda_c / L* on this mesh"),
            "error": one(meshes, found / found[:, -1:] - 1.0, "lambda_c over that of the finest mesh, minus one"),
        },
        coords={
            "model": ("model", list(MODELS), {"units": "1", "long_name": "model of the strip"}),
            "height": one(("height",), np.asarray(heights, float), "gripper height / L*"),
            "thickness": one(("thickness",), np.asarray(thicknesses, float), "h / L*"),
            "refinement": one(("refinement",), np.asarray(refinements, float), "factor on element lengths"),
        },
        attrs={"length_star": length_star, "thickness_star": thickness, "height_star": height},
    )


def _critical(model: str, length: float, thickness: float, height: float, refinement: float) -> tuple[float, float]:
    """lambda_c and the length of the shortest element."""
    strip = StripModel(length, thickness, kind=model)
    if model == "rod":
        found = locate_rod.run(strip, locate_rod.ElasticaPrediction.at(height), refinement)
        end, lam, size = found.end, found.lam, found.size
    else:
        run = solve_height(strip, height, refinement, past=0.0)
        end, lam, size = run.end, run.lam, float(np.diff(run.problem.model.ends).min())
    if end is not End.SNAP:
        raise SolveError(f"no snap of the {model} at h = {thickness:g}, z = {height:g} L*: {end.reason}")
    return lam, size

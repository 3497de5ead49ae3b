"""lambda_c of the models against each other and the elastica, over thickness and height.  All in L*."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask.model_error import PLANE, ROD, Section, exact, one_across
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.base.errors import SolveError
from stripfold.base.material import Material
from stripfold.follow.statics import StripModel
from stripfold.follow.track import End
from studies.common import Progress, dataset, grid

MODELS = ("rod", "solid")
BESIDE = 1e-3
"""Distance in free length of the states from which a derivative by it is taken, L*."""
NUMBERS = ("lambda_c", "mesh_error")


def lambda_c(length: float, refinement: float, model: str, height: float, thickness: float) -> dict[str, float]:
    """lambda_c on one mesh, and its change from elements twice as long.

    Raises SolveError: a run cannot be computed, or ends without a snap.
    """
    strip, prediction = StripModel(length, thickness, kind=model), ElasticaPrediction.at(height)
    fine, coarse = (from_near_the_end(strip, prediction, r) for r in (refinement, 2.0 * refinement))
    if fine.end is not End.SNAP:
        raise SolveError(f"no snap of the {model}: {fine.end.reason}")
    return {"lambda_c": fine.lam, "mesh_error": abs(fine.lam - coarse.lam)}


def thickness_effect(section: Section, height: float, length: float) -> float:
    """Derivative of lambda_c by h^2 at h = 0, of a strip with this section: from the elastica's branch alone.

    What the thickness adds to the energy, V h^2, moves the maximum of lambda by -(dV/dl) / (dP/dl) h^2, with the free
    length l along the branch and the force P that moves the gripper.  nan where the sag touches before.
    """
    found = elastica.critical(height)
    if not found.snap:
        return np.nan
    critical = found.state

    def added(state: elastica.State) -> float:
        s, weights = np.polynomial.legendre.leggauss(60)
        at = state.at(0.5 * state.length * (1.0 + s))
        vertical, cos, sin = state.force_0 + at.s, np.cos(at.theta), np.sin(at.theta)
        force, k, shear = state.force_x * cos + vertical * sin, at.curvature, state.force_x * sin - vertical * cos
        free = -((force - section.a / 2.0 * k**2) ** 2) / 24.0 + section.c * k**4 - section.d * shear**2
        lying = -(state.force_x**2) / 24.0 * (length - state.length)
        return 0.5 * state.length * float(weights @ free) + lying

    short, long = (elastica.state_at(height, critical.length + dl, critical) for dl in (-BESIDE, BESIDE))
    # The force on the gripper is -F_x.
    return (added(long) - added(short)) / (long.force_x - short.force_x)


def run_limit(
    eta_b: float,
    length_star: float,
    height: float,
    eta_m: Sequence[float],
    refinement: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c of the solid for each ``eta_m`` (m^-2 s^2), and the elastica's."""
    thickness = [Material(eta_b, value).relative_thickness for value in eta_m]
    case = partial(lambda_c, length_star, refinement, "solid", height)
    found = grid(case, NUMBERS, {"thickness": thickness}, threads, progress)
    values: dict[str, tuple[Any, Any]] = {name: ("eta_m", value) for name, (_, value) in found.items()}
    truth = elastica.critical(height).advance
    difference = values["lambda_c"][1] - truth
    order = np.diff(np.log(np.abs(difference))) / np.diff(np.log(eta_m))
    values |= {
        "eta_m": ("eta_m", eta_m),
        "lambda_c_elastica": ((), truth),
        "difference": ("eta_m", difference),
        "order": ("eta_m", [np.nan, *order]),
    }
    return dataset("limit", values, {"eta_b": eta_b, "height_star": height, "length_star": length_star})


def run_rod(
    length_star: float,
    heights: Sequence[float],
    thicknesses: Sequence[float],
    refinement: float,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """lambda_c of rod, solid and elastica at all heights, of strips of all thicknesses."""
    axes = {"model": MODELS, "gripper_height": heights, "thickness": thicknesses}
    values = grid(partial(lambda_c, length_star, refinement), NUMBERS, axes, threads, progress)
    rod, solid = values["lambda_c"][1]
    truth = np.array([elastica.critical(z).advance for z in heights])
    over = ("gripper_height", "thickness")
    sections = {"plane": PLANE, "rod": ROD, "solid": one_across(0.0), "exact": exact(0.0)}
    derived = [[thickness_effect(section, z, length_star) for z in heights] for section in sections.values()]
    differences = {
        "lambda_c_elastica": ("gripper_height", truth),
        "model_error": (over, rod / solid - 1.0),
        "thickness_effect": (over, solid / truth[:, None] - 1.0),
        "section": ("section", list(sections)),
        "derived": (("section", "gripper_height"), derived),
    }
    return dataset("rod", {**values, **differences}, {"length_star": length_star})

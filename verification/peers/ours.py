"""This package's side of the comparison with its peers: one equilibrium, and one critical point; in L*."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.base.arrays import Array
from stripfold.follow.contact_branch import from_elastica
from stripfold.follow.statics import StripModel, leg, lift, solve_height, start_along_x
from stripfold.strip.problem import AlongX

Line = tuple[Array, Array]
"""Distances from the grasped end, shape (n,), and places, shape (n, 2), from where that end lay."""


def model_equilibrium(strip: StripModel, height: float, lam: float, refinement: float) -> Line:
    """The mid-surface with the gripper at ``lam``, on a mesh; solved for from the elastica's state there.

    Raises SolveError: a state could not be computed.
    """
    near = elastica.state_at_advance(height, lam)
    found = from_elastica(strip.contact_mesh(refinement), AlongX(height), lam, near)
    place = found.problem.mid_surface(found.point.q)
    return found.model.s, place + np.array([strip.length / 2.0, 0.0])


def elastica_equilibrium(length: float, height: float, lam: float) -> Line:
    """The same of the elastica, at a thousand places; raises SolveError."""
    state = elastica.state_at_advance(height, lam)
    profile = state.at(np.linspace(state.length, 0.0, 801))
    lying = np.linspace(state.length, length, 202)[1:]
    s = np.concatenate([state.length - profile.s, lying])
    x = np.concatenate([state.length - profile.x, lying])
    return s, np.stack([x, np.concatenate([profile.z, 0.0 * lying])], axis=1)


def flat_equilibrium(strip: StripModel, height: float, lam: float, refinement: float) -> Line:
    """The same, followed from the flat strip: lifted to the height, then moved along x."""
    ((_, lifted),) = lift(strip.contact_mesh(refinement), [height])
    found = leg(start_along_x(lifted, height), lam).states[-1]
    place = found.problem.mid_surface(found.point.q)
    return found.model.s, place + np.array([strip.length / 2.0, 0.0])


def equilibrium(model: str, scene: Mapping[str, Any], refinement: float, flat: bool = False) -> dict[str, Any]:
    """Find the mid-surface ``place``, shape (n, 2), over the distance ``s`` from the grasped end.

    ``flat``: followed from the flat strip instead of solved for from the elastica.  Raises SolveError.
    """
    length, height, lam = scene["length"], scene["height"], scene["lam"]
    if model == "elastica":
        s, place = elastica_equilibrium(length, height, lam)
    elif flat:
        strip = StripModel(length, scene["thickness"], kind=model)
        s, place = flat_equilibrium(strip, height, lam, refinement)
    else:
        s, place = model_equilibrium(StripModel(length, scene["thickness"], kind=model), height, lam, refinement)
    return {"s": s, "place": place}


def critical(model: str, scene: Mapping[str, Any], refinement: float, flat: bool = False) -> dict[str, float]:
    """Find ``lambda_c`` on one mesh, from the elastica or the ``flat`` strip; raises SolveError."""
    height = scene["height"]
    if model == "elastica":
        return {"lambda_c": elastica.critical(height).advance}
    strip = StripModel(scene["length"], scene["thickness"], kind=model)
    if flat:
        return {"lambda_c": solve_height(strip, height, refinement).lam}
    return {"lambda_c": end_of_advance(strip, ElasticaPrediction.at(height), refinement).lam}


def reference(model: str, scene: Mapping[str, Any], refinement: float) -> tuple[CubicSpline, float]:
    """Mid-surface over the distance from the grasped end, and lambda_c, on a fine mesh."""
    line = equilibrium(model, scene, refinement)
    return CubicSpline(line["s"], line["place"]), critical(model, scene, refinement)["lambda_c"]

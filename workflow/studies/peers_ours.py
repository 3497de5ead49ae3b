"""This package's side of the comparison with its peers: one equilibrium, and one critical point; in L*."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from stripfold import elastica
from stripfold.analysis.contact_branch import STEPS, BranchCrossing, follow
from stripfold.analysis.prediction import ElasticaPrediction, end_of_advance
from stripfold.analysis.static import StripModel, at_lambda, lift, start_along_x
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.solve.events import Event, never

Line = tuple[Array, Array]
"""Distances from the grasped end, shape (n,), and places, shape (n, 2), from where that end lay."""


def model_equilibrium(strip: StripModel, height: float, lam: float, refinement: float) -> Line:
    """The mid-surface when the flat strip was lifted and its gripper moved to ``lam``, on a mesh.

    Raises
    ------
    SolveError
        A state could not be computed.
    """
    ((_, start),) = lift(strip.contact_mesh(refinement), [height])
    there = Event("lambda", lambda point, _: point.lam >= lam, located=never)
    first = start_along_x(start, height)
    for item in follow(first, STEPS, lambda _: [there], through_contact=False):
        if isinstance(item, BranchCrossing):
            found = at_lambda(item.after, lam)
            place = found.problem.mid_surface(found.point.q)
            return found.model.s, place + np.array([strip.length / 2.0, 0.0])
    raise AssertionError("a branch ends in an event or raises")


def elastica_equilibrium(length: float, height: float, lam: float) -> Line:
    """The same of the elastica, at a thousand places.

    Raises
    ------
    SolveError
        A state could not be computed.
    """
    before = None
    for state in elastica.x_axis_branch(height):
        if state.advance >= lam:
            break
        before = state
    if before is None or state.advance < lam:
        raise SolveError(f"no state with lambda = {lam:g} L* before the critical point")

    def excess(free: float) -> float:
        return elastica.state_at(height, free, guess=state).advance - lam

    free = float(brentq(excess, before.length, state.length, xtol=1e-12))
    profile = elastica.state_at(height, free, guess=state).at(np.linspace(free, 0.0, 801))
    lying = np.linspace(free, length, 202)[1:]
    s = np.concatenate([free - profile.s, lying])
    x = np.concatenate([free - profile.x, lying])
    return s, np.stack([x, np.concatenate([profile.z, 0.0 * lying])], axis=1)


def equilibrium(model: str, scene: Mapping[str, Any], refinement: float) -> dict[str, Any]:
    """The mid-surface ``place``, shape (n, 2), over the distance ``s`` from the grasped end; raises SolveError."""
    length, height, lam = scene["length"], scene["height"], scene["lam"]
    if model == "elastica":
        s, place = elastica_equilibrium(length, height, lam)
    else:
        s, place = model_equilibrium(StripModel(length, scene["thickness"], kind=model), height, lam, refinement)
    return {"s": s, "place": place}


def critical(model: str, scene: Mapping[str, Any], refinement: float) -> dict[str, float]:
    """``lambda_c`` on one mesh, from nothing; raises SolveError."""
    height = scene["height"]
    if model == "elastica":
        return {"lambda_c": elastica.critical(height).advance}
    strip = StripModel(scene["length"], scene["thickness"], kind=model)
    return {"lambda_c": end_of_advance(strip, ElasticaPrediction.at(height), refinement).lam}


def reference(model: str, scene: Mapping[str, Any], refinement: float) -> tuple[CubicSpline, float]:
    """Mid-surface over the distance from the grasped end, and lambda_c, on a fine mesh."""
    line = equilibrium(model, scene, refinement)
    return CubicSpline(line["s"], line["place"]), critical(model, scene, refinement)["lambda_c"]

"""The end of the solid's advance from a state shortly before it, predicted by the elastica.  Lengths in L*."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stripfold import elastica
from stripfold.analysis import planning
from stripfold.analysis.advance import LAMBDA_TOLERANCE
from stripfold.analysis.locate_rod import ElasticaPrediction
from stripfold.analysis.static import (
    ROBUST_NEWTON,
    X_STEPS,
    StripModel,
    XRun,
    along_x,
    lift,
    no_horizontal_force,
    to_the_end,
)
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.models.model import Model
from stripfold.problem import AlongX, StripProblem
from stripfold.solve import continuation, newton

BEFORE = 0.25
"""Distance in free length before the elastica's end at which the run begins, L*: lambda is about 0.06 L* lower."""
SHORTER = 10.0
"""Thick strips begin earlier by this times h^2 L*: their advance ends earlier by up to that."""
LOWER = 0.65
"""The relative difference of lambda from the elastica's is about this times h^2 (docs/method.md)."""


def run(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float = LAMBDA_TOLERANCE
) -> XRun:
    """Follow the branch from shortly before its end; lambda_c to a bracket of ``tolerance``.

    ``points`` begin there: the state without horizontal force is :func:`lambda_0`.  Where no state is
    found there, the branch is followed from lambda_0 and :attr:`.XRun.fallback` says why.  On one mesh: a close call
    (:attr:`.XRun.close`) is for the caller to settle.

    Raises
    ------
    SolveError
        When a state or the branch cannot be computed.
    """
    sweep = planning.Sweep(prediction.first.length, prediction.last.length)
    model = strip.model(planning.boundaries(strip.length, sweep, refinement, strip.sizes))
    problem = StripProblem(model, AlongX(prediction.height))
    before = BEFORE + SHORTER * strip.thickness**2
    try:
        near = elastica.state_at(prediction.height, prediction.last.length - before, prediction.last)
        lying = model.middle[model.s >= near.length, 1]
        lam = near.advance * (1.0 - LOWER * strip.thickness**2)
        active = np.intersect1d(lying, problem.bounded)
        state = newton.solve(problem, bent(model, near), lam, active, options=ROBUST_NEWTON)
        first = continuation.start(problem, state.q, lam, state.active, 1.0, X_STEPS)
        return to_the_end(problem, first, 0.0, X_STEPS, tolerance)
    except SolveError as error:
        # On a mesh so coarse, or of a strip so thick or so short, the elastica's state is not near the solid's.
        (_, lifted, state) = next(lift(strip, [prediction.height]))
        return replace(along_x(strip, prediction.height, (lifted, state), model.ends, past=0.0), fallback=str(error))


def lambda_0(run: XRun, prediction: ElasticaPrediction) -> float:
    """Advance without horizontal force, on the mesh of a run."""
    model = run.problem.model
    state = no_horizontal_force(run.problem, bent(model, prediction.first), prediction.height)
    return float(state.q[model.middle[0, 0]])


def bent(model: Model, state: elastica.State) -> Array:
    """Unknowns of a strip in a state of the elastica, lying flat behind it."""
    at = state.at(np.clip(state.length - model.s, 0.0, None))
    lying = model.s >= state.length
    # The elastica's X points from the lift-off to the gripper, and so does its arc length.
    x = np.where(lying, model.s, state.length - at.x) - model.length / 2.0
    position = np.stack([x, np.where(lying, 0.0, np.maximum(at.z, 0.0))], axis=1)
    return model.unknowns_of(position, np.where(lying, 0.0, -at.theta))

"""Hard cases of the way: very large and very small steps, starts from bad guesses."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import nan

import numpy as np

from stripfold import elastica
from stripfold.analysis.static import NEARBY_NEWTON, X_STEPS, End, StripModel, XRun, along_x, lift, solve_height
from stripfold.errors import NewtonError, SolveError
from stripfold.models.model import Model
from stripfold.solve import newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.problem import Equilibrium
from studies.hard_cases.case import Case, Finding, iterations
from studies.hard_cases.strips import PAPERS, SHIFT, mesh_error

STEPS, STARTS = "very large and very small steps", "starts from bad guesses"
STRIP, HEIGHT = StripModel(9.0, PAPERS), 3.0
Start = tuple[Model, Equilibrium]


@lru_cache(maxsize=4)
def lifted(height: float) -> Start:
    """The strip with its gripper at a height and free along x."""
    (_, model, state) = next(lift(STRIP, [height]))
    return model, state


def _judged(run: XRun, refinement: float) -> Finding:
    value = run.last.lam if run.end is End.SNAP else nan
    allowed = mesh_error(refinement) + SHIFT * STRIP.thickness**2
    return Finding(value, elastica.critical(HEIGHT).advance, allowed, iterations(run))


def _with_steps(size: float, refinement: float) -> Finding:
    options: StepOptions = replace(X_STEPS, first=size, largest=size)
    return _judged(along_x(STRIP, HEIGHT, lifted(HEIGHT), 2.0 * refinement, 0.0, options), 2.0 * refinement)


def _from(start: Start, refinement: float) -> Finding:
    return _judged(along_x(STRIP, HEIGHT, start, 2.0 * refinement, 0.0), 2.0 * refinement)


def _flat() -> Start:
    model, state = lifted(HEIGHT)
    return model, replace(state, q=np.zeros(model.size))


def _noisy(size: float) -> Start:
    """The right state with every place of the mid-surface moved at random."""
    model, state = lifted(HEIGHT)
    q = state.q.copy()
    q[model.middle] += size * np.random.default_rng(1).standard_normal(model.middle.shape)
    return model, replace(state, q=q)


def _mirrored() -> Start:
    """The strip below the floor."""
    model, state = lifted(HEIGHT)
    q = state.q.copy()
    q[model.middle[:, 1]] *= -1.0
    return model, replace(state, q=q)


def _past(refinement: float) -> None:
    """The gripper past lambda_c in one step: no state is near."""
    run = solve_height(STRIP, HEIGHT, 2.0 * refinement, past=0.0)
    newton.solve(
        run.problem, run.last.q, run.last.lam + 0.1, run.last.active, options=replace(NEARBY_NEWTON, max_distance=0.2)
    )


CASES = (
    Case("steps of 10 L*", STEPS, "lambda_c, elastica", lambda r: _with_steps(10.0, r)),
    Case("steps of 0.05 L*", STEPS, "lambda_c, elastica", lambda r: _with_steps(0.05, r)),
    Case("from a flat strip", STARTS, "lambda_c, elastica", lambda r: _from(_flat(), r), (SolveError,)),
    Case("from half the height", STARTS, "lambda_c, elastica", lambda r: _from(lifted(0.5 * HEIGHT), r), (SolveError,)),
    Case(
        "from twice the height", STARTS, "lambda_c, elastica", lambda r: _from(lifted(2.0 * HEIGHT), r), (SolveError,)
    ),
    Case("from a noisy state", STARTS, "lambda_c, elastica", lambda r: _from(_noisy(0.05), r), (SolveError,)),
    Case("from a state of noise", STARTS, "lambda_c, elastica", lambda r: _from(_noisy(1.0), r), (SolveError,)),
    Case("from below the floor", STARTS, "lambda_c, elastica", lambda r: _from(_mirrored(), r), (SolveError,)),
    Case("a tenth of an L* past lambda_c", STARTS, "no state is near: an error", _past, (NewtonError,)),
)

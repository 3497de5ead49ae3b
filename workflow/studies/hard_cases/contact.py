"""Hard cases of contact: grazing, low grippers, and strips that leave the floor."""

from __future__ import annotations

from math import nan

from stripfold import elastica
from stripfold.analysis.static import End, StripModel, lift_off, solve_height
from stripfold.errors import CoarseMeshError, InvalidInputError, SolveError
from stripfold.inputs import Scene
from studies.hard_cases.case import Case, Finding, iterations
from studies.hard_cases.strips import PAPERS, end_against_elastica

GRAZING, LOW, LIFTED = "grazing contact", "gripper at the floor", "lift-off of the whole strip"
BESIDE = 0.04
"""How far from the height at which the sag just touches, L*."""


def _grazing(side: float, refinement: float) -> Finding:
    """So thin that the elastica's limit is the strip's."""
    return end_against_elastica(StripModel(9.0, 0.02), elastica.touch_limit() + side * BESIDE, refinement)


def _lifted(length: float, refinement: float) -> Finding:
    """Too short to snap: followed until next to nothing lies, on the elastica of the same free length."""
    run = solve_height(StripModel(length, PAPERS), 3.0, refinement, past=0.0)
    free = lift_off(run.problem.model, run.last)
    value = run.last.lam if run.end is End.LIFTED else nan
    return Finding(value, elastica.state_at(3.0, free).advance, 0.15 * refinement, iterations(run))


def _too_short(_: float) -> None:
    Scene(length=0.18, height=0.09, eta_b=3780.0).require_long_enough()


def _on_the_floor(_: float) -> None:
    Scene(length=0.6, height=0.0, eta_b=3780.0)


def _low(height: float, thickness: float, refinement: float) -> Finding:
    return end_against_elastica(StripModel(9.0, thickness), height, refinement)


CASES = (
    Case(
        "just above the touch limit",
        GRAZING,
        "lambda_c, elastica: a snap",
        lambda r: _grazing(1.0, r),
        (CoarseMeshError,),
    ),
    Case(
        "just below the touch limit",
        GRAZING,
        "lambda, elastica: a touch",
        lambda r: _grazing(-1.0, r),
        (CoarseMeshError,),
    ),
    Case("z = 0.5 L*", LOW, "lambda at the touch, elastica", lambda r: _low(0.5, 0.02, r), (SolveError,)),
    Case("z = 0.3 L*", LOW, "lambda at the touch, elastica", lambda r: _low(0.3, 0.02, r), (SolveError,)),
    Case("z = 0.1 L*", LOW, "lambda at the touch, elastica", lambda r: _low(0.1, 0.02, r), (SolveError,)),
    Case(
        "z = 0.1 L*, h = 0.06 L*", LOW, "lambda at the touch, elastica", lambda r: _low(0.1, PAPERS, r), (SolveError,)
    ),
    Case("z = 0", LOW, "no folding: an error", _on_the_floor, (InvalidInputError,)),
    Case("strip of 6.5 L*", LIFTED, "lambda, elastica of the same free length", lambda r: _lifted(6.5, r)),
    Case("strip of 6.5 L*, asked for", LIFTED, "too short: an error", _too_short, (InvalidInputError,)),
)

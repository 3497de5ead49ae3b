"""Hard cases of the strip itself: thin, thick, soft, stiff, long, taut."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

import numpy as np

from stripfold import elastica
from stripfold.analysis import locate_rod
from stripfold.analysis.critical_point import find
from stripfold.analysis.static import (
    X_STEPS,
    End,
    StripModel,
    along_x,
    lift,
    no_horizontal_force,
    solve_height,
    transfer,
)
from stripfold.errors import ContinuationError, InvalidInputError
from stripfold.inputs import Model, Scene
from stripfold.material import Material
from stripfold.problem import AlongX, StripProblem
from stripfold.solve import continuation, newton
from studies.hard_cases.case import Case, Finding, iterations

THIN, THICK, DECADES, LONG, TAUT = "very thin", "thick", "eta_b over eight decades", "long strips", "taut strip"
PAPERS = 0.0594
"""Thickness of the paper's strips at eta_b = 3780, L*."""
SHIFT = 10.0
"""More than the thickness moves lambda_c, times h^2 (docs/numerics.md)."""


def mesh_error(refinement: float) -> float:
    """What the solid's mesh is allowed to be wrong by, L*."""
    return 0.02 * refinement


def end_against_elastica(strip: StripModel, height: float, refinement: float) -> Finding:
    """Where the advance ends, and that it ends for the elastica's reason."""
    run, truth = solve_height(strip, height, refinement, past=0.0), elastica.critical(height)
    value = run.last.lam if (run.end is End.SNAP) == truth.snap else nan
    return Finding(value, truth.state.advance, mesh_error(refinement) + SHIFT * strip.thickness**2, iterations(run))


def rod_lambda_c(strip: StripModel, height: float, refinement: float) -> float:
    """Of the fast rod; nan where it does not snap."""
    found = locate_rod.run(strip, locate_rod.ElasticaPrediction.at(height), min(refinement, 1.0))
    return found.lam if found.end is End.SNAP else nan


def _thin(refinement: float) -> Finding:
    """Lifted fifty times thicker: without horizontal force the thickness moves it by next to nothing."""
    (_, model, state) = next(lift(StripModel(9.0, 5e-3), [3.0]))
    run, truth = along_x(StripModel(9.0, 9e-5), 3.0, (model, state), refinement, past=0.0), elastica.critical(3.0)
    return Finding(run.last.lam if run.end is End.SNAP else nan, truth.advance, mesh_error(refinement), iterations(run))


def _thin_rod(refinement: float) -> Finding:
    truth = elastica.critical(3.0).advance
    return Finding(rod_lambda_c(StripModel(9.0, 9e-5, kind="rod"), 3.0, refinement), truth, 1e-4 * truth)


def _thick(refinement: float) -> Finding:
    """Two elements across and half as long ones along are another discretisation of the same strip."""
    run = solve_height(StripModel(9.0, 0.2), 3.0, 2.0 * refinement, past=0.0)
    other = solve_height(StripModel(9.0, 0.2, across=2), 3.0, refinement, past=0.0)
    same = run.end is other.end is End.SNAP
    count = iterations(run) + iterations(other)
    return Finding(run.last.lam if same else nan, other.last.lam, mesh_error(2.0 * refinement), count)


def _thick_rod(thickness: float, refinement: float) -> Finding:
    solid = solve_height(StripModel(9.0, thickness), 3.0, refinement, past=0.0)
    rod = rod_lambda_c(StripModel(9.0, thickness, kind="rod"), 3.0, refinement)
    return Finding(rod, solid.last.lam, mesh_error(refinement), iterations(solid))


def _too_thick(_: float) -> None:
    _scene(3780.0, "solid", 1e-3, 0.21)


def _scene(eta_b: float, model: Model, accuracy: float, thickness: float = 0.03) -> Scene:
    """A strip that is the same in L*, whatever its eta_b."""
    star = Material(eta_b).gravity_length
    eta_m = (thickness * star) ** 2 * eta_b / 12.0
    return Scene(length=9.0 * star, height=3.0 * star, eta_b=eta_b, eta_m=eta_m, model=model, accuracy=accuracy)


def _decades(_: float) -> Finding:
    """Largest distance from the mean, of itself."""
    lambda_c = []
    for eta_b in 10.0 ** np.arange(-1, 9):
        scene = _scene(float(eta_b), "rod", 1e-3)
        lambda_c.append(find(scene).lambda_c / scene.material.gravity_length)
    return Finding(float(np.ptp(lambda_c) / np.mean(lambda_c)), 0.0, 1e-8)


def _one_decade(eta_b: float, refinement: float) -> Finding:
    scene = _scene(eta_b, "solid", 5e-3 * refinement)
    truth = elastica.critical(3.0).advance
    return Finding(find(scene).lambda_c / scene.material.gravity_length, truth, 5e-3 * refinement * truth)


def _stiffest_refused(_: float) -> None:
    """With the paper's eta_m this one would be a third of L* thick."""
    star = Material(0.1).gravity_length
    Scene(length=16.0 * star, height=3.0 * star, eta_b=0.1)


def _taut(refinement: float) -> Finding:
    """The gripper goes back until the strip pulls: the horizontal force, against the elastica of the same advance."""
    strip, height, free = StripModel(30.0, 0.01, kind="rod"), 3.0, 16.0
    truth = _longer(elastica.state_no_horizontal_force(height), free)
    # The elastica does not stretch.
    stretch = (truth.force_x + 0.5 * height * free / strip.length) * strip.length * strip.thickness**2 / 12.0
    target = truth.advance - stretch
    (_, model, state) = next(lift(strip, [height]))
    ends = np.linspace(0.0, strip.length, round(strip.length / (0.15 * refinement)) + 1)
    other = strip.model(ends)
    problem = StripProblem(other, AlongX(height))
    start = no_horizontal_force(problem, transfer(model, state.q, other), height)
    lambda_0 = float(start.q[other.middle[0, 0]])
    point = continuation.start(problem, start.q, lambda_0, start.active, -1.0, X_STEPS)
    count = 0
    branch: Iterator = continuation.follow(problem, point, X_STEPS)
    while point.lam > target:
        before, point = point, next(branch)
        count += len(point.state.residuals) - 1
    near = min(before, point, key=lambda p: abs(p.lam - target))
    guess = near.q + (target - near.lam) / near.tangent.lam * near.tangent.q
    found = newton.solve(problem, guess, target, near.active, options=newton.NewtonOptions(max_distance=0.3))
    pull = -float(problem.residual(found.q, target)[other.middle[0, 0]])
    return Finding(pull, truth.force_x, 0.03 * truth.force_x, count)


def _longer(state: elastica.State, length: float) -> elastica.State:
    """The state at the same height with a longer free part, on the side where the strip is pulled."""
    height = float(state.z[-1])
    while state.length < length:
        state = elastica.state_at(height, min(state.length + 0.2, length), state)
    return state


CASES = (
    Case("thin, h / L = 1e-5", THIN, "lambda_c, elastica", _thin),
    Case("thin rod, h / L = 1e-5", THIN, "lambda_c, elastica", _thin_rod),
    Case("thick, h = 0.2 L*", THICK, "lambda_c, two elements across and half as long", _thick),
    Case("thick rod, h = 0.2 L*", THICK, "lambda_c, solid", lambda r: _thick_rod(0.2, r)),
    Case("too thick, h = 0.21 L*", THICK, "no strip: an error", _too_thick, (InvalidInputError,)),
    Case("eta_b 1e-1 to 1e8, rod", DECADES, "relative spread of lambda_c / L*", _decades),
    Case("eta_b = 1e-1, solid", DECADES, "lambda_c, elastica", lambda r: _one_decade(1e-1, r)),
    Case("eta_b = 1e8, solid", DECADES, "lambda_c, elastica", lambda r: _one_decade(1e8, r)),
    Case("eta_b = 1e-1, usual eta_m", DECADES, "no strip: an error", _stiffest_refused, (InvalidInputError,)),
    Case(
        "long, low",
        LONG,
        "lambda_c at L = 60, z = 3 L*",
        lambda r: end_against_elastica(StripModel(60.0, PAPERS), 3.0, r),
    ),
    Case(
        "long, high",
        LONG,
        "lambda_c at L = 60, z = 10",
        lambda r: end_against_elastica(StripModel(60.0, PAPERS), 10.0, r),
    ),
    Case("pulled back", TAUT, "horizontal force, elastica", _taut, (ContinuationError,)),
)

"""One critical point, as the command line prints it.  SI in, SI out."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from math import nan
from time import perf_counter
from typing import NamedTuple

import numpy as np

from stripfold import elastica
from stripfold.ask import select_model
from stripfold.ask.inputs import Scene
from stripfold.ask.model_error import solid_error
from stripfold.ask.prediction import (
    ElasticaPrediction,
    Snap,
    from_near_the_end,
    snap,
    without_horizontal_force,
)
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.contact_events import clearance
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, solve_height
from stripfold.follow.track import End, Track

Progress = Callable[[str], None]

ELASTICA_ERROR = 1e-9
"""Error of the elastica's lambda_c, L*, held by its tests."""
POINTS = 200
"""Points of the elastica's mid-surface."""
BY_ROD = "by the rod, as less of the strip lies there than the solid needs"
BRACKET = 0.01
"""Width of the bracket of lambda_c as a share of the accuracy."""


@dataclass(frozen=True, slots=True)
class CriticalResult:
    """A critical point, lengths in m; :class:`.results.CriticalPoint` describes the attributes."""

    lambda_0: float
    lambda_c: float
    x_c: float
    lambda_c_lower: float
    lambda_c_upper: float
    error: float
    lambda_touch: float
    touch_x: float
    free_length: float
    snap: bool
    reason: str
    seconds: float
    model: str
    model_error: float
    solid_error: float
    state: Array = field(repr=False)


def find(
    scene: Scene, progress: Progress | None = None, prediction: ElasticaPrediction | None = None
) -> CriticalResult:
    """Find the critical point of a scene to its accuracy.

    With the model "auto" the cheapest model is used whose lambda_c is within the accuracy of the solid's; otherwise the
    accuracy is that of the given model.  ``prediction`` is the elastica's at this height, if it is known already.

    Raises SolveError: when it cannot be computed, or not to the accuracy asked for.
    """
    began, say = perf_counter(), progress or (lambda _: None)
    prediction = prediction or ElasticaPrediction.at(scene.height_star)
    if scene.model == "auto":
        found, used = _auto(scene, prediction, say)
    else:
        found, used = _find(scene, prediction, say), scene
    reason = found.end.reason
    if found.end is End.LIFTED and used.model == "solid" and prediction.end(scene.length_star) is not End.LIFTED:
        # Where less lies than the strip is thick, the solid's lift-off has no place on the strip any more.
        rod = used.model_copy(update={"model": "rod", "law": "svk"})
        by_rod = _find(rod, prediction, say)
        if by_rod.end is not End.LIFTED:
            found, used, reason = by_rod, rod, f"{by_rod.end.reason}; {BY_ROD}"
    unit, material = scene.material.gravity_length, scene.material
    advance = unit * (found.lambda_c if found.end is End.SNAP else found.lambda_touch)
    printed = nan if scene.law == "printed" else 1.0
    return CriticalResult(
        lambda_0=unit * found.lambda_0,
        lambda_c=unit * found.lambda_c,
        x_c=unit * found.lambda_c - 0.5 * scene.length,
        lambda_c_lower=unit * found.lower,
        lambda_c_upper=unit * found.upper,
        error=unit * found.error,
        lambda_touch=unit * found.lambda_touch,
        touch_x=unit * found.touch_x,
        free_length=unit * found.free_length,
        snap=found.end is End.SNAP,
        reason=reason,
        seconds=perf_counter() - began,
        model=used.model,
        model_error=advance * used.distance_from_solid(used.model),
        solid_error=printed * advance * solid_error(material.relative_thickness, material.nu, scene.height_star),
        state=unit * found.state,
    )


class _Found(NamedTuple):
    """The end of an advance, in L*; nan: lambda_c and its bracket without a snap, lambda_touch with one."""

    end: End
    lambda_0: float
    free_length: float
    state: Array
    lambda_c: float = nan
    lower: float = nan
    upper: float = nan
    lambda_touch: float = nan
    touch_x: float = nan
    error: float = nan


def _auto(scene: Scene, prediction: ElasticaPrediction, progress: Progress) -> tuple[_Found, Scene]:
    """The end of the advance by the cheapest model that succeeds, and the scene with that model."""
    thickness, nu = scene.material.relative_thickness, scene.material.nu
    models = select_model.candidates(prediction, scene.length_star, thickness, nu, scene.accuracy)
    for model in models:
        left = scene.model_copy(update={"model": model})
        left = left.model_copy(update={"accuracy": scene.accuracy - left.distance_from_solid(model)})
        try:
            return _find(left, prediction, progress), left
        except SolveError as error:
            # Such as a rod that is too thick for its low gripper.
            if model == models[-1]:
                raise
            progress(f"not by the {model}: {error}")
    raise AssertionError("the last model returns or raises")


def _find(scene: Scene, prediction: ElasticaPrediction, progress: Progress) -> _Found:
    """The end of the advance by the scene's model."""
    progress(f"model {scene.model}")
    first, last = prediction.first, prediction.last
    length, thickness = scene.length_star, scene.material.relative_thickness
    end = prediction.end(length)
    too_long = last.length - length
    if end is End.LIFTED and (scene.model == "elastica" or too_long > select_model.room_for(thickness)):
        return _Found(end, first.advance, last.length, np.empty((0, 2)))
    if scene.model == "elastica":
        state = _mid_surface(last, length)
        if end is End.TOUCH:
            assert last.sag is not None
            x = last.length - length / 2.0 - float(last.at(last.sag.s).x)
            return _Found(
                end, first.advance, last.length, state, lambda_touch=last.advance, touch_x=x, error=ELASTICA_ERROR
            )
        bracket = last.advance - ELASTICA_ERROR, last.advance + ELASTICA_ERROR
        return _Found(End.SNAP, first.advance, last.length, state, last.advance, *bracket, error=ELASTICA_ERROR)
    nu, law = (scene.material.nu, scene.law) if scene.model == "solid" else (0.0, "svk")
    strip = StripModel(length, thickness, nu, law=law, kind=scene.model)
    tolerance = max(LAMBDA_TOLERANCE, BRACKET * scene.accuracy * last.advance)
    run, error = _fine_enough(scene, strip, prediction, tolerance, progress)
    state = run.last.problem.mid_surface(run.last.point.q)
    lambda_0 = without_horizontal_force(strip, prediction, select_model.refinement(scene.model, scene.accuracy))
    if run.end is End.TOUCH:
        _, place = clearance(run.last.problem, run.last.point.q)
        x = float(run.last.mid_surface(np.array([place]))[0, 0])
        return _Found(run.end, lambda_0, run.free_length, state, lambda_touch=run.lam, touch_x=x, error=error)
    if run.critical is None:
        return _Found(run.end, lambda_0, run.free_length, state)
    bracket = run.critical.lower, run.critical.upper
    return _Found(run.end, lambda_0, run.free_length, state, run.lam, *bracket, error=error)


def _run(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float, progress: Progress
) -> Snap | Track:
    """The end of the advance, from the elastica's or, where a strip is so thick that none is near, from flat."""
    progress(f"elements {refinement:.2g} times the standard ones")
    with suppress(SolveError):
        return snap(strip, prediction, refinement)
    return _followed(strip, prediction, refinement, tolerance, progress)


def _followed(
    strip: StripModel, prediction: ElasticaPrediction, refinement: float, tolerance: float, progress: Progress
) -> Track:
    """The end of the advance, the branch followed to it."""
    try:
        return from_near_the_end(strip, prediction, refinement, tolerance)
    except SolveError as error:
        progress(f"followed from the flat strip: {error}")
        return solve_height(strip, prediction.height, refinement)


def _mid_surface(state: elastica.State, length: float) -> Array:
    """Mid-surface of a state of the elastica from the grasped end on, shape (n, 2), L*."""
    at = state.at(np.linspace(state.length, 0.0, POINTS))
    return np.vstack([np.column_stack([state.length - length / 2.0 - at.x, at.z]), [length / 2.0, 0.0]])


def _fine_enough(
    scene: Scene, strip: StripModel, prediction: ElasticaPrediction, tolerance: float, progress: Progress
) -> tuple[Track, float]:
    """The run on the first mesh within the scene's accuracy, and its error, L*."""
    refinement = select_model.refinement(scene.model, scene.accuracy)
    coarse: Snap | Track = _run(strip, prediction, select_model.COARSER * refinement, tolerance, progress)
    while True:
        end = _run(strip, prediction, refinement, tolerance, progress)
        try:
            fine = end.checked(tolerance) if isinstance(end, Snap) else end
        except SolveError as refused:
            progress(f"not the first limit point: {refused}")
            fine = _followed(strip, prediction, refinement, tolerance, progress)
        error = select_model.error(scene.model, refinement, fine.lam, coarse.lam, fine.slack)
        if fine.end is coarse.end and error <= scene.accuracy * fine.lam:
            return fine, error
        if refinement / select_model.COARSER < select_model.FINEST:
            raise SolveError(
                f"the error of lambda_c is {error / fine.lam:.1e}, allowed {scene.accuracy:.1e}",
                advice="ask for less accuracy",
            )
        refinement /= select_model.COARSER
        coarse = fine

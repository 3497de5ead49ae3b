"""One critical point, as the command line prints it.  SI in, SI out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from time import perf_counter
from typing import NamedTuple, TypeVar

import numpy as np

from stripfold import elastica
from stripfold.analysis import locate_rod, locate_solid, select_model
from stripfold.analysis.advance import LAMBDA_TOLERANCE
from stripfold.analysis.static import End, StripModel, XRun
from stripfold.arrays import Array
from stripfold.errors import CoarseMeshError, SolveError
from stripfold.inputs import Scene
from stripfold.models.model_error import model_error as of_model

Progress = Callable[[str], None]

ELASTICA_ERROR = 1e-9
"""Error of the elastica's lambda_c, L*, held by its tests."""
CONTACT_NOISE = 1e-5
"""Smallest relative error estimate of the solid's lambda_c over the refinement, for contact at nodes: two meshes may
agree by chance (study `rod`)."""
POINTS = 200
"""Points of the elastica's mid-surface."""
BRACKET = 0.01
"""Width of the bracket of lambda_c as a share of the accuracy."""


@dataclass(frozen=True, slots=True)
class CriticalResult:
    """A critical point, lengths in m; nan where there is none.

    Attributes
    ----------
    lambda_0, lambda_c
        Advance of the gripper past the flat end, with no horizontal force and at the critical point.
    x_c
        Gripper at the critical point in the paper's frame, origin mid-strip.
    lambda_c_lower, lambda_c_upper
        Bracket of lambda_c on the mesh used.
    error
        Estimated error of lambda_c of this model, due to mesh and bracket.
    free_length
        Length of the part off the floor when the advance ends.
    snap, reason
        Whether lambda has a maximum, and how the advance ends.
    seconds
        Time taken.
    model
        "solid", "rod" or "elastica": the one that was used.
    model_error
        Estimated distance of this model's lambda_c from the solid's; 0 for the solid.
    state
        Shape (n, 2): x and z of the mid-surface where the advance ends, from the grasped end; empty where the strip is
        too short for such a state.
    """

    lambda_0: float
    lambda_c: float
    x_c: float
    lambda_c_lower: float
    lambda_c_upper: float
    error: float
    free_length: float
    snap: bool
    reason: str
    seconds: float
    model: str
    model_error: float
    state: Array = field(repr=False)


def find(scene: Scene, progress: Progress | None = None) -> CriticalResult:
    """Find the critical point of a scene to its accuracy.

    With the model "auto" the cheapest model is used whose lambda_c is within the accuracy of the solid's; otherwise the
    accuracy is that of the given model.

    Raises
    ------
    SolveError
        When it cannot be computed, or not to the accuracy asked for.
    CoarseMeshError
        When the advance ends in another way than the elastica's, and not because of the strip's thickness.
    """
    began, say = perf_counter(), progress or (lambda _: None)
    prediction = locate_rod.ElasticaPrediction.at(scene.height_star)
    if scene.model == "auto":
        found, used = _auto(scene, prediction, say)
    else:
        found, used = _find(scene, prediction, say), scene
    _cross_check(found.end, scene, prediction)
    unit = scene.material.gravity_length
    return CriticalResult(
        lambda_0=unit * found.lambda_0,
        lambda_c=unit * found.lambda_c,
        x_c=unit * found.lambda_c - 0.5 * scene.length,
        lambda_c_lower=unit * found.lower,
        lambda_c_upper=unit * found.upper,
        error=unit * found.error,
        free_length=unit * found.free_length,
        snap=found.end is End.SNAP,
        reason=found.end.reason,
        seconds=perf_counter() - began,
        model=used.model,
        model_error=unit * found.lambda_c * _model_error(used),
        state=unit * found.state,
    )


def _cross_check(end: End, scene: Scene, prediction: locate_rod.ElasticaPrediction) -> None:
    """Refuse an end of the advance that the elastica rules out: a mesh's own contact has decided it.

    Raises
    ------
    CoarseMeshError
        The model snaps where the elastica's sag lands before, or the reverse.
    """
    if select_model.undecided(prediction, scene.length_star, scene.material.relative_thickness):
        return
    if end is not prediction.end(scene.length_star):
        raise CoarseMeshError(
            f"the advance ends in a {end.value}, that of the elastica in a {prediction.end(scene.length_star).value}: "
            f"at a height of {scene.height_star:.3g} L* the strip's thickness cannot decide that, its mesh can",
            advice="ask for more accuracy, or for the model elastica",
        )


Run = TypeVar("Run", XRun, locate_rod.Found)


class _Found(NamedTuple):
    """The end of an advance, in L*; lambda_c, its bracket and its error are nan where it is no snap."""

    end: End
    lambda_0: float
    free_length: float
    state: Array
    lambda_c: float = nan
    lower: float = nan
    upper: float = nan
    error: float = nan


def _auto(scene: Scene, prediction: locate_rod.ElasticaPrediction, progress: Progress) -> tuple[_Found, Scene]:
    """The end of the advance by the cheapest model that succeeds, and the scene with that model."""
    thickness, nu = scene.material.relative_thickness, scene.material.nu
    models = select_model.candidates(prediction, scene.length_star, thickness, nu, scene.accuracy)
    for model in models:
        left = scene.model_copy(update={"model": model})
        left = left.model_copy(update={"accuracy": scene.accuracy - _model_error(left)})
        try:
            return _find(left, prediction, progress), left
        except SolveError as error:
            # Such as a rod that is too thick for its low gripper.
            if model == models[-1]:
                raise
            progress(f"not by the {model}: {error}")
    raise AssertionError("the last model returns or raises")


def _model_error(scene: Scene) -> float:
    return of_model(scene.model, scene.material.relative_thickness, scene.material.nu)


def _find(scene: Scene, prediction: locate_rod.ElasticaPrediction, progress: Progress) -> _Found:
    """The end of the advance by the scene's model."""
    first, last = prediction.first, prediction.last
    end = prediction.end(scene.length_star)
    if end is End.LIFTED:
        return _Found(end, first.advance, last.length, np.empty((0, 2)))
    if scene.model == "elastica":
        state = _mid_surface(last, scene.length_star)
        if end is End.TOUCH:
            return _Found(end, first.advance, last.length, state)
        bracket = last.advance - ELASTICA_ERROR, last.advance + ELASTICA_ERROR
        return _Found(End.SNAP, first.advance, last.length, state, last.advance, *bracket, ELASTICA_ERROR)
    return _rod(scene, prediction, progress) if scene.model == "rod" else _solid(scene, prediction, progress)


def _solid(scene: Scene, prediction: locate_rod.ElasticaPrediction, progress: Progress) -> _Found:
    material = scene.material
    strip = StripModel(scene.length_star, material.relative_thickness, material.nu, law=scene.law)
    tolerance = max(LAMBDA_TOLERANCE, BRACKET * scene.accuracy * prediction.last.advance)

    def follow(refinement: float) -> XRun:
        run = locate_solid.run(strip, prediction, refinement, tolerance)
        if run.fallback:
            progress(f"followed from lambda_0: {run.fallback}")
        return run

    begin = select_model.solid_refinement(scene.accuracy)
    fine, error = _fine_enough(scene, follow, begin, progress, contact_noise=CONTACT_NOISE)
    lambda_0 = locate_solid.lambda_0(fine, prediction)
    state = fine.problem.model.mid_surface(fine.last.q)
    if fine.critical is None:
        return _Found(fine.end, lambda_0, fine.free_length, state)
    bracket = fine.critical.lower, fine.critical.upper
    return _Found(fine.end, lambda_0, fine.free_length, state, fine.critical.lam, *bracket, error)


def _rod(scene: Scene, prediction: locate_rod.ElasticaPrediction, progress: Progress) -> _Found:
    strip = StripModel(scene.length_star, scene.material.relative_thickness, kind="rod")
    refinement = select_model.rod_refinement(scene.accuracy, locate_rod.MESH_ERROR)
    fine, error = _fine_enough(
        scene, lambda r: locate_rod.run(strip, prediction, r), refinement, progress, locate_rod.LEFT
    )
    state = _with_held_end(fine.free_part[:, 1:], scene.length_star)
    if fine.end is not End.SNAP:
        return _Found(fine.end, fine.lambda_0, fine.free_length, state)
    return _Found(fine.end, fine.lambda_0, fine.free_length, state, fine.lam, fine.lam, fine.upper, error)


def _mid_surface(state: elastica.State, length: float) -> Array:
    """Mid-surface of a state of the elastica from the grasped end on, shape (n, 2), L*."""
    at = state.at(np.linspace(state.length, 0.0, POINTS))
    return _with_held_end(np.column_stack([state.length - length / 2.0 - at.x, at.z]), length)


def _with_held_end(free_part: Array, length: float) -> Array:
    return np.vstack([free_part, [length / 2.0, 0.0]])


def _fine_enough(
    scene: Scene,
    follow: Callable[[float], Run],
    refinement: float,
    progress: Progress,
    share: float = 1.0,
    contact_noise: float = 0.0,
) -> tuple[Run, float]:
    """The run on the first mesh within the scene's accuracy, and its error, L*.

    The error is ``share`` of the change from the mesh half as fine, plus the run's slack and ``contact_noise`` times
    the refinement of lambda_c.
    """

    def followed(r: float) -> Run:
        progress(f"following the branch, elements {r:.2g} times the standard ones")
        return follow(r)

    coarse, fine = followed(2.0 * refinement), followed(refinement)
    while True:
        error = share * abs(fine.lam - coarse.lam) + fine.slack + contact_noise * refinement * fine.lam
        if fine.end is coarse.end and error <= scene.accuracy * fine.lam:
            return fine, error
        if refinement / 2.0 < select_model.FINEST:
            raise SolveError(
                f"the error of lambda_c is {error / fine.lam:.1e}, allowed {scene.accuracy:.1e}",
                advice="ask for less accuracy",
            )
        refinement /= 2.0
        coarse, fine = fine, followed(refinement)

"""One critical point: what the command line prints.  SI in, SI out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from time import perf_counter
from typing import TypeVar

from .. import elastica
from ..errors import SolveError
from ..scene import Scene
from . import quick
from .static import End, Strip, XRun, along_x, lift

Progress = Callable[[str], None]

ELASTICA_ERROR = 1e-9
"""Error of the elastica's lambda_c, L*: its own tests hold it to that."""
FINEST = 0.1
"""Smallest factor on the element lengths that is tried."""


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
        Estimate of what the mesh and the bracket leave open in lambda_c.
    free_length
        Length of the part off the floor when the advance ends.
    snap, reason
        Whether lambda has a maximum, and what ends the advance.
    seconds
        Time taken.
    model
        "solid", "rod" or "elastica".
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


def find(scene: Scene, progress: Progress | None = None) -> CriticalResult:
    """Find the critical point of a scene to its accuracy.

    Raises
    ------
    SolveError
        When it cannot be computed, or not to the accuracy asked for.
    """
    began = perf_counter()
    of = {"elastica": _elastica, "rod": _rod, "solid": _solid}[scene.model]
    result = of(scene, progress or (lambda _: None))
    lambda_0, lambda_c, lower, upper, error, free_length, snap, reason = result
    unit = scene.material.gravity_length
    return CriticalResult(
        lambda_0=unit * lambda_0,
        lambda_c=unit * lambda_c,
        x_c=unit * lambda_c - 0.5 * scene.length,
        lambda_c_lower=unit * lower,
        lambda_c_upper=unit * upper,
        error=unit * error,
        free_length=unit * free_length,
        snap=snap,
        reason=reason,
        seconds=perf_counter() - began,
        model=scene.model,
    )


Run = TypeVar("Run", XRun, quick.Found)
Found = tuple[float, float, float, float, float, float, bool, str]


def _elastica(scene: Scene, progress: Progress) -> Found:
    height = scene.height_star
    point = elastica.critical(height)
    lambda_0 = elastica.state_no_horizontal_force(height).advance
    end = point.state or (point.touch.state if point.touch else None)
    assert end is not None
    if end.length >= scene.length_star:
        return lambda_0, nan, nan, nan, nan, end.length, False, End.LIFTED.reason
    if not point.snap:
        return lambda_0, nan, nan, nan, nan, end.length, False, End.TOUCH.reason
    c = point.advance
    return lambda_0, c, c - ELASTICA_ERROR, c + ELASTICA_ERROR, ELASTICA_ERROR, end.length, True, End.SNAP.reason


def first_refinement(accuracy: float) -> float:
    """Factor on the element lengths that usually meets a relative accuracy of lambda_c (``docs/numerics.md``)."""
    return min(2.0, max(FINEST, (accuracy / 5e-3) ** 0.5 * 2.0))


def _solid(scene: Scene, progress: Progress) -> Found:
    height, material = scene.height_star, scene.material
    strip = Strip(scene.length_star, material.relative_thickness, material.nu, law=scene.law)
    progress("lifting")
    (_, model, state) = next(lift(strip, [height]))

    def follow(r: float) -> XRun:
        return along_x(strip, height, (model, state), r, past=0.0)

    fine, error = _fine_enough(scene, follow, first_refinement(scene.accuracy), progress)
    lower, upper = (fine.critical.lower, fine.critical.upper) if fine.critical else (nan, nan)
    return _found(fine, lower, upper, error)


def _rod(scene: Scene, progress: Progress) -> Found:
    strip = Strip(scene.length_star, scene.material.relative_thickness, kind="rod")
    foretold = quick.Foretold.at(scene.height_star)
    if foretold.last.length >= strip.length:
        return foretold.first.advance, nan, nan, nan, nan, foretold.last.length, False, End.LIFTED.reason
    refinement = min(1.0, max(FINEST, (scene.accuracy / quick.MESH_ERROR) ** 0.25))
    fine, error = _fine_enough(scene, lambda r: quick.run(strip, foretold, r), refinement, progress, quick.LEFT)
    return _found(fine, fine.lam, fine.upper, error)


def _fine_enough(
    scene: Scene, follow: Callable[[float], Run], refinement: float, progress: Progress, share: float = 1.0
) -> tuple[Run, float]:
    """The run on the first mesh that is known to the scene's accuracy, and its error, L*.

    ``share`` of the change from the mesh half as fine is taken for the error that is left.
    """

    def followed(r: float) -> Run:
        progress(f"following the branch, elements {r:.2g} times the standard ones")
        return follow(r)

    coarse, fine = followed(2.0 * refinement), followed(refinement)
    while True:
        error = share * abs(fine.lam - coarse.lam) + fine.slack
        if fine.end is coarse.end and error <= scene.accuracy * fine.lam:
            return fine, error
        if refinement / 2.0 < FINEST:
            raise SolveError(
                f"lambda_c is known to {error / fine.lam:.1e} only, asked for was {scene.accuracy:.1e}",
                advice="ask for less accuracy",
            )
        refinement /= 2.0
        coarse, fine = fine, followed(refinement)


def _found(run: XRun | quick.Found, lower: float, upper: float, error: float) -> Found:
    if run.end is not End.SNAP:
        return run.lambda_0, nan, nan, nan, nan, run.free_length, False, run.end.reason
    return run.lambda_0, run.lam, lower, upper, error, run.free_length, True, run.end.reason

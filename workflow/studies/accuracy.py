"""Accuracy versus run time: error of the end of the advance over models, meshes and settings.

Scenes are strips of one length and thickness at several gripper heights: lambda_c where they snap, and at a low gripper
lambda at the first touch.  All in L*.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis import critical_point as critical
from stripfold.analysis.prediction import ElasticaPrediction, from_near_the_end
from stripfold.analysis.static import LAMBDA_TOLERANCE, End, StripModel
from stripfold.arrays import Array
from stripfold.errors import SolveError
from stripfold.inputs import Scene
from stripfold.material import Material
from stripfold.schema import Values
from studies.common import Progress, blank, command, dataset, timed, timed_process

Shape = Callable[[Array], Array]
"""The strip's mid-surface: from distances from the grasped end, shape (n,), to places, shape (n, 2)."""

OF_ELASTICA = 25
"""Calls of the elastica per call of another model: one takes hundredths of a second."""
ETA_B = 3780.0
"""Of the strips whose presets are measured, m^-4 s^2; results in L* do not depend on it."""
COMPARED_PLACES = 400
"""Places along the strip at which two states are compared."""
PRESETS = ("auto", "solid")
"""Models that are requested with an accuracy."""


class Answer(NamedTuple):
    """Where the advance ends, lambda there, and the strip's state."""

    end: End
    lam: float
    shape: Shape


class Strategy(NamedTuple):
    """One way to the end of the advance.

    Attributes
    ----------
    kind
        "elastica", "rod" or "solid".
    order, across
        Order of the solid's elements, and their number across the thickness.
    refinement
        Factor on the element lengths.
    tolerance
        Bracket of lambda, L*.
    """

    kind: str
    order: int = 2
    across: int = 1
    refinement: float = 1.0
    tolerance: float = LAMBDA_TOLERANCE

    def answer(self, length: float, thickness: float, height: float) -> Answer:
        """Follow it."""
        prediction = ElasticaPrediction.at(height)
        if self.kind == "elastica":
            return Answer(
                End.SNAP if prediction.snap else End.TOUCH, prediction.last.advance, _bent(prediction.last, length)
            )
        strip = StripModel(length, thickness, order=self.order, across=self.across, kind=self.kind)
        run = from_near_the_end(strip, prediction, self.refinement, self.tolerance)
        return Answer(run.end, run.lam, run.last.mid_surface)


def run(
    length_star: float,
    thickness: float,
    heights: Sequence[float],
    strategies: Sequence[Mapping[str, Any]],
    reference: float,
    accuracies: Sequence[float],
    repeats: int,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors and times of all strategies at all heights, and of the model chosen for an accuracy.

    Parameters
    ----------
    length_star, thickness
        Of the strip, L*.
    heights
        Gripper heights, L*, shape (n,).
    strategies
        Fields of :class:`Strategy`, each.
    reference
        Refinement of the solid that is the reference; its change from twice this refinement is stored too.
    accuracies
        Requested of each model of :data:`PRESETS`.
    repeats
        Calls after an uncounted one of which the median time is taken, in this process.

    Raises
    ------
    SolveError
        When the reference or a preset fails.  A strategy that fails has nan.
    """
    say = progress or (lambda _: None)
    ways = [Strategy(**given) for given in strategies]
    s = np.linspace(0.0, length_star, COMPARED_PLACES)
    shape = (len(ways), len(heights))
    error, state_error, seconds = (blank(*shape) for _ in range(3))
    truth, uncertain, state_uncertain, snaps = (blank(len(heights)) for _ in range(4))
    memory = blank(len(ways))
    for j, height in enumerate(heights):
        say(f"z = {height:g} L*")
        scene = length_star, thickness, height
        finest, finer = (Strategy("solid", refinement=r).answer(*scene) for r in (reference, 2.0 * reference))
        truth[j], uncertain[j], snaps[j] = finest.lam, abs(finer.lam / finest.lam - 1.0), finest.end is End.SNAP
        there = finest.shape(s)
        state_uncertain[j] = _distance(finer.shape(s), there)
        for i, way in enumerate(ways):
            try:
                seconds_of, answer = timed(partial(way.answer, *scene), repeats)
            except SolveError as failure:
                say(f"{way}: {failure}")
                continue
            say(f"{way}: {answer.end}, {answer.lam / finest.lam - 1.0:.1e}, {np.median(seconds_of):.3f} s")
            seconds[i, j] = np.median(seconds_of)
            if j == len(heights) - 1:
                memory[i] = timed_process(f"from {__name__} import Strategy\n{way!r}.answer{scene!r}")[2]
            if answer.end is finest.end:
                error[i, j] = answer.lam / finest.lam - 1.0
                state_error[i, j] = _distance(answer.shape(s), there)
    return dataset(
        "accuracy",
        {
            "height": ("height", heights),
            "accuracy": ("accuracy", accuracies),
            "asked": ("asked", PRESETS),
            "error": (("way", "height"), error),
            "state_error": (("way", "height"), state_error),
            "seconds": (("way", "height"), seconds),
            "way_memory": ("way", memory),
            "reference": ("height", truth),
            "uncertain": ("height", uncertain),
            "state_uncertain": ("height", state_uncertain),
            "snaps": ("height", snaps.astype(np.int8)),
            **_presets(length_star, thickness, heights, accuracies, truth, repeats, say),
            **_of_elastica(heights, repeats),
            **_memory(length_star, heights),
            **{field: ("way", [getattr(way, field) for way in ways]) for field in Strategy._fields},
        },
        {"length_star": length_star, "thickness_star": thickness, "repeats": repeats},
    )


def _presets(
    length: float,
    thickness: float,
    heights: Sequence[float],
    accuracies: Sequence[float],
    truth: Array,
    repeats: int,
    say: Progress,
) -> Values:
    """The model chosen for an accuracy, its time, its estimate and its true error; nan where there is no snap."""
    shape = (len(PRESETS), len(accuracies), len(heights))
    seconds, estimate, error = (blank(*shape) for _ in range(3))
    chosen = np.empty(shape, dtype=object)
    for at in np.ndindex(*shape):
        scene = scene_of(length, thickness, heights[at[2]], PRESETS[at[0]], accuracies[at[1]])
        taken, found = timed(partial(critical.find, scene), repeats)
        seconds[at], chosen[at] = np.median(taken), found.model
        say(f"{PRESETS[at[0]]} to {accuracies[at[1]]:g} at {heights[at[2]]:g} L*: {found.model}, {seconds[at]:.3f} s")
        if found.snap:
            estimate[at] = (found.error + found.model_error) / found.lambda_c
            error[at] = found.lambda_c / scene.material.gravity_length / truth[at[2]] - 1.0
    over = ("asked", "accuracy", "height")
    values = {"model": chosen, "seconds": seconds, "estimate": estimate, "error": error}
    return {f"preset_{name}": (over, value) for name, value in values.items()}


def _of_elastica(heights: Sequence[float], repeats: int) -> Values:
    """Time of the elastica's end of the advance, and its distance from one solved on a finer grid."""
    seconds, error = blank(len(heights)), blank(len(heights))
    for j, height in enumerate(heights):
        taken, found = timed(partial(elastica.critical, height), OF_ELASTICA * repeats)
        seconds[j] = np.median(taken)
        error[j] = found.state.advance / elastica.advance_on_finer_grid(found) - 1.0
    return {"elastica_seconds": ("height", seconds), "elastica_error": ("height", error)}


def _memory(length: float, heights: Sequence[float]) -> Values:
    """Peak memory of a process that finds one lambda_c to 1e-3, by each model."""
    scene = scene_of(length, 0.0, heights[-1], "solid", 1e-3)
    words = ["critical", "--length", repr(scene.length), "--height", repr(scene.height), "--eta-b", repr(ETA_B)]
    models = ("elastica", "rod", "solid")
    peaks = [timed_process(command(*words, "--json", "--model", model))[2] for model in models]
    return {"model": ("model", models), "memory": ("model", peaks)}


def scene_of(
    length: float, thickness: float, height: float, model: str, accuracy: float, nu: float = 0.0, eta_b: float = ETA_B
) -> Scene:
    """A scene from lengths in L*."""
    unit = Material(eta_b).gravity_length
    eta_m = max((thickness * unit) ** 2 * eta_b / 12.0, 1e-9)
    given = {"eta_b": eta_b, "eta_m": eta_m, "nu": nu, "model": model, "accuracy": accuracy}
    return Scene(length=length * unit, height=height * unit, **given)  # type: ignore[arg-type]


def _distance(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other, axis=1).max())


def _bent(state: elastica.State, length: float) -> Shape:
    def shape(s: Array) -> Array:
        at, lies = state.at(np.clip(state.length - s, 0.0, None)), s >= state.length
        x = np.where(lies, s, state.length - at.x) - length / 2.0
        return np.stack([x, np.where(lies, 0.0, at.z)], axis=1)

    return shape


def presets(times: xr.Dataset) -> str:
    """One row per requested accuracy and model, as a table in Markdown: the chosen model, its time and its error.

    Times and errors are the largest over the heights with a snap.
    """
    rows = ["| `--accuracy` | `--model` | chosen | time | estimated error | true error |", "|---|---|---|---|---|---|"]
    snaps = times.sel(height=times["snaps"] > 0)
    for accuracy in times["accuracy"].values:
        for asked in times["asked"].values:
            one = snaps.sel(accuracy=accuracy, asked=asked)
            chosen = ", ".join(dict.fromkeys(str(name) for name in one["preset_model"].values))
            told, error = (float(np.abs(one[name]).max()) for name in ("preset_estimate", "preset_error"))
            seconds = float(one["preset_seconds"].max())
            rows.append(f"| {accuracy:.0e} | `{asked}` | {chosen} | {seconds:.2g} s | {told:.0e} | {error:.0e} |")
    return "\n".join(rows) + "\n"

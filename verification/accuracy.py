"""Accuracy versus run time: error of the end of the advance over models, meshes and settings.

Scenes are strips of one length and thickness at several gripper heights: lambda_c where they snap, and at a low gripper
lambda at the first touch.  All in L*.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import MODEL_LOOKS, draw_pareto, entry, headroom, note, plain_numbers
from stripfold import elastica
from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.ask.select_model import solid_error
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, styled
from stripfold.elastica._continuation import SNAP, TOUCH
from stripfold.elastica._system import gripper_at, newton, refine
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel
from stripfold.follow.track import End
from verification.common import Progress, dataset, grid, markdown_table, timed
from verification.numbers import Facts, Number

UNITS = {"s": "elastica_seconds preset_seconds seconds"}

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
        run = end_of_advance(strip, prediction, self.refinement, self.tolerance)
        return Answer(run.end, run.lam, run.last.mid_surface)


STRATEGIES = (
    {"kind": "elastica"},
    {"kind": "rod", "refinement": 2.0},
    {"kind": "rod", "refinement": 1.4},
    {"kind": "rod", "refinement": 1.0},
    {"kind": "rod", "refinement": 0.5},
    {"kind": "solid", "refinement": 2.0},
    {"kind": "solid", "refinement": 1.4},
    {"kind": "solid", "refinement": 1.0},
    {"kind": "solid", "refinement": 0.5},
    {"kind": "solid", "refinement": 1.0, "across": 2},
    {"kind": "solid", "refinement": 2.0, "order": 1, "across": 2},
    {"kind": "solid", "refinement": 1.0, "order": 1, "across": 2},
    {"kind": "solid", "refinement": 0.5, "order": 1, "across": 2},
)


def run(
    length_star: float = 20.0,
    thickness: float = 0.0594,
    heights: Sequence[float] = (1.2, 3.0, 9.0),
    strategies: Sequence[Mapping[str, Any]] = STRATEGIES,
    reference: float = 0.25,
    accuracies: Sequence[float] = (0.01, 0.001, 0.0001),
    repeats: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Errors and times of all strategies at all heights, and of the model chosen for an accuracy.

    ``length_star``, ``thickness``: of the strip, L*.  ``heights``: gripper heights, L*, shape (n,).  ``strategies``:
    fields of :class:`Strategy`, each.  ``reference``: refinement of the solid that is the reference; its change from
    twice this refinement is stored too.  ``accuracies``: requested of each model of :data:`PRESETS`.  ``repeats``:
    calls after an uncounted one of which the median time is taken, in this process.

    Numbers that could not be had are nan; of the presets, ``no_result`` says why.
    """
    ways = [Strategy(**given) for given in strategies]
    s = np.linspace(0.0, length_star, COMPARED_PLACES)

    @cache
    def truth(height: float) -> tuple[Answer, Answer]:
        """On the finest mesh and on the one before."""
        finest, finer = (
            Strategy("solid", refinement=r).answer(length_star, thickness, height) for r in (reference, 2.0 * reference)
        )
        return finest, finer

    def of_reference(height: float) -> dict[str, float]:
        finest, finer = truth(height)
        apart = _distance(finer.shape(s), finest.shape(s))
        uncertain = abs(finer.lam / finest.lam - 1.0)
        snaps = finest.end is End.SNAP
        return {"reference": finest.lam, "uncertain": uncertain, "state_uncertain": apart, "snaps": snaps}

    def of_way(i: int, height: float) -> dict[str, float]:
        finest, _ = truth(height)
        seconds, answer = timed(partial(ways[i].answer, length_star, thickness, height), repeats)
        if answer.end is not finest.end:
            return {"seconds": float(np.median(seconds))}
        apart = _distance(answer.shape(s), finest.shape(s))
        error = answer.lam / finest.lam - 1.0
        return {"seconds": float(np.median(seconds)), "error": error, "state_error": apart}

    def of_preset(asked: Any, accuracy: float, height: float) -> dict[str, Any]:
        finest, _ = truth(height)
        scene = scene_of(length_star, thickness, height, asked, accuracy)
        seconds, found = timed(partial(critical.find, scene), repeats)
        row = {"preset_seconds": np.median(seconds), "preset_model": found.model}
        if not found.snap:
            return row
        return row | {
            "preset_estimate": (found.error + found.model_error) / found.lambda_c,
            "preset_error": found.lambda_c / scene.material.gravity_length / finest.lam - 1.0,
        }

    def of_elastica(height: float) -> dict[str, float]:
        """Time of the elastica's end of the advance, and its distance from one solved on a finer grid."""
        seconds, found = timed(partial(elastica.critical, height), OF_ELASTICA * repeats)
        error = found.state.advance / advance_on_finer_grid(found) - 1.0
        return {"elastica_seconds": float(np.median(seconds)), "elastica_error": error}

    over = {"gripper_height": heights}
    of_presets = [f"preset_{name}" for name in ("seconds", "model", "estimate", "error")]
    grids = [
        grid(case, names, axes | over, progress=progress)
        for case, names, axes in (
            (of_reference, ("reference", "uncertain", "state_uncertain", "snaps"), {}),
            (of_way, ("seconds", "error", "state_error"), {"way": range(len(ways))}),
            (of_elastica, ("elastica_seconds", "elastica_error"), {}),
            (of_preset, of_presets, {"asked": PRESETS, "accuracy": accuracies}),
        )
    ]
    values = {name: value for found in grids for name, value in found.items() if name != "way"}
    values |= {field: ("way", [getattr(way, field) for way in ways]) for field in Strategy._fields}
    attrs = {"length_star": length_star, "thickness_star": thickness, "repeats": repeats}
    return dataset(values, attrs, units=UNITS)


def advance_on_finer_grid(point: elastica.CriticalPoint) -> float:
    """The advance at the same event with half as many nodes again, for an estimate of the discretisation error."""
    y = point.state._unknowns()
    finer = refine(y, 3 * point.state.s.size // 2)
    event = SNAP if point.snap else TOUCH
    return elastica.State._from(newton(finer, (*gripper_at(point.z), event.condition))).advance


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
    header = "`--accuracy`", "`--model`", "chosen", "time", "estimated error", "true error"
    rows = []
    snaps = times.sel(gripper_height=times["snaps"] > 0)
    for accuracy in times["accuracy"].values:
        for asked in times["asked"].values:
            one = snaps.sel(accuracy=accuracy, asked=asked)
            chosen = ", ".join(dict.fromkeys(str(name) for name in one["preset_model"].values))
            told, error = (float(np.abs(one[name]).max()) for name in ("preset_estimate", "preset_error"))
            seconds = float(one["preset_seconds"].max())
            rows.append((f"{accuracy:.0e}", f"`{asked}`", chosen, f"{seconds:.2g} s", f"{told:.0e}", f"{error:.0e}"))
    return markdown_table(header, rows)


HEIGHT = 3.0
"""Gripper height at which times are quoted, L*."""


def facts(d: xr.Dataset) -> Facts:
    solid = d.sel(asked="solid", accuracy=1e-3)
    return {
        "z": HEIGHT,
        "seconds": solid.preset_seconds.sel(gripper_height=HEIGHT),
        "estimate": solid.preset_estimate.sel(gripper_height=HEIGHT),
        "off": np.abs(solid.preset_error).max(),
        "across": solid_error(float(d.attrs["thickness_star"]), 0.0, HEIGHT),
        "slowest": solid.preset_seconds.max(),
        "elastica": d.elastica_seconds.sel(gripper_height=HEIGHT),
        "slowest_elastica": d.elastica_seconds.max(),
        "apart": np.abs(d.elastica_error).max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("time_solid_1e-3", "seconds", "s", "<= 0.2 s, estimate and true errors <= 1e-3",
            "median time of one solid lambda_c with its error estimate ({estimate:.0e} relative) at z = {z:g} L*, one "
            "core, warm process; at all heights at most {slowest:.2g} s, true errors at most {off:.0e} against much "
            "shorter elements, one across like these, which are within {across:.0e} of the exact solid",
            lambda f: f.estimate <= 1e-3 and f.off <= 1e-3 and f.across <= 1e-3),
        Number("time_elastica", "elastica", "s", "<= 0.005 s, difference <= 1e-9",
            "median time of the elastica's critical point at z = {z:g} L*, one core, warm process; at all heights at "
            "most {slowest_elastica:.2g} s and {apart:.0e} from the solution on a finer grid",
            lambda f: f.apart <= 1e-9),
    ),
}
# fmt: on


LEAST = 1e-7
"""Smaller errors are drawn here: the reference is no better."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over run time, a panel per height, with the Pareto front.

    Open markers: elements of order one, or two elements across the thickness.  Dotted: uncertainty of the reference.
    """
    count = data.sizes["gripper_height"]
    rows = count // 2 + 1
    fig = figure(2.0 * rows, 5.2)
    panels = fig.subplots(rows, 2, squeeze=False, sharey=True).ravel()
    kinds = data["kind"].values
    plain = (data["order"].values == 2.0) & (data["across"].values == 1.0)
    for j, ax in enumerate(panels[:count]):
        one = data.isel(gripper_height=j)
        cost = one["seconds"].values
        error = np.maximum(np.abs(one["error"].values), LEAST)
        for kind, how in MODEL_LOOKS.items():
            for filled in (True, False):
                of = (kinds == kind) & (plain == filled)
                name = kind if filled and j == 0 and of.any() else None
                face = how.color if filled else "white"
                ax.plot(cost[of], error[of], how.marker, color=how.color, mfc=face, label=name)
        draw_pareto(ax, cost, error, max(float(one["uncertain"]), LEAST))
        ax.set(xscale="log", yscale="log", xlabel="run time [s]")
        what = r"$\lambda_c$" if one["snaps"] else "first touch"
        note(ax, f"({'abcdefgh'[j]}) $z = {float(one['gripper_height']):g}\\,L^*$, {what}", loc="upper right")
    for ax in panels[count:]:
        ax.set_axis_off()
    for ax in panels[1:count]:
        ax.sharex(panels[0])
    panels[0].autoscale(axis="x")  # to what all of them show
    for ax in panels[:count]:
        plain_numbers(ax.xaxis)
    headroom(panels[0], 0.12)
    fig.supylabel(r"error of $\lambda$, relative", fontsize=9.0)
    handles = panels[0].get_legend_handles_labels()[0]
    open_marks = entry("solid, order one or two across", MODEL_LOOKS["solid"].color, "none", marker="s", mfc="white")
    handles += [
        open_marks,
        entry("Pareto front", GREY, lw=1.0),
        entry("uncertainty of the reference", GREY, ":", lw=0.8),
    ]
    panels[count].legend(handles=handles, loc="center")
    return fig

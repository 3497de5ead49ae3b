"""Does the true error of lambda_c stay within its estimate?  Random scenes, each against a much finer solution.

The scenes are drawn from the whole range of accepted inputs, and may end with a touch: lambda_touch counts as lambda_c.
The reference of a scene with the solid or the rod is the same model on a much finer mesh.  Where the model is left open
it is the solid, so that the estimate includes the model's error; for the elastica, the rod, whose distance from the
solid is added to the reference's uncertainty: in strips so thin it is closer to the solid than the finest mesh of that.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import critical, select_model
from stripfold.ask.inputs import LENGTH_STAR, MAX_THICKNESS_STAR, Scene
from stripfold.ask.prediction import ElasticaPrediction, end_of_advance
from stripfold.ask.select_model import model_error
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.base.validation import ETA_B, HEIGHT_STAR
from stripfold.follow.statics import StripModel
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, covers, seed_of, share

UNITS = {"m-4 s2": "eta_b", "s": "seconds"}

MODELS = ("auto", "solid", "rod")
ETA_M = (1e-9, 0.1)
NU = (0.0, 0.49)
ACCURACY = (1e-6, 1e-2)
FINER = 0.45
"""Refinement of the reference over that which an error as estimated needs."""
CERTAIN = 0.3
"""Largest uncertainty of a reference, as a share of the estimate that it judges."""
NUMBER, REFUSED, UNCERTAIN = "number", "refused", "no reference"
"""Outcomes: judged; the accuracy was refused, or the solve failed with a typed error; no reference is good enough."""


def run(cases: int = 2, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts.

    Dataset over ``case``: what was drawn, the outcome, the estimate and the true error, both relative and nan where
    there is none, and the model used.
    """
    return table("case", pooled(partial(case, seed=seed), range(cases), threads, progress), {"seed": seed}, units=UNITS)


def case(number: int, seed: int) -> dict[str, Any]:
    """One case; each has a random stream of its own."""
    scene, prediction = _drawn(np.random.default_rng([seed, number]), MODELS[number % len(MODELS)])
    row: dict[str, Any] = {
        "case": number,
        "asked": scene.model,
        "used": "",
        "eta_b": scene.eta_b,
        "length": scene.length_star,
        "height": scene.height_star,
        "thickness": scene.material.relative_thickness,
        "nu": scene.nu,
        "accuracy": scene.accuracy,
        **dict.fromkeys(("estimate", "error", "uncertainty", "seconds"), np.nan),
        "outcome": REFUSED,
        "message": "",
    }
    found, message = attempted(partial(critical.find, scene, prediction=prediction))
    if found is None:
        return row | {"message": message}
    advance = found.lambda_c if found.snap else found.lambda_touch
    estimate = (found.error + (found.model_error if scene.model == "auto" else 0.0)) / advance
    row |= {"used": found.model, "seconds": found.seconds, "estimate": estimate, "outcome": UNCERTAIN}
    truth, message = attempted(partial(_reference, scene, prediction, found.model, estimate))
    if truth is None:
        return row | {"message": message}
    lam, uncertainty = truth
    row |= {"error": abs(advance / scene.gravity_length / lam - 1.0), "uncertainty": uncertainty}
    return row | {"outcome": NUMBER if uncertainty <= CERTAIN * estimate else UNCERTAIN}


def _drawn(draw: np.random.Generator, asked: str) -> tuple[Scene, ElasticaPrediction]:
    """A scene that is accepted, and the elastica's prediction of its end."""

    def between(low: float, high: float) -> float:
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    while True:
        eta_b, height, accuracy = between(*ETA_B), between(*HEIGHT_STAR), between(*ACCURACY)
        unit = Material(eta_b).gravity_length
        thickest = (MAX_THICKNESS_STAR * unit) ** 2 * eta_b / 12.0
        eta_m, nu = between(ETA_M[0], min(ETA_M[1], thickest)), float(draw.uniform(*NU))
        prediction = ElasticaPrediction.at(height)
        length = between(max(LENGTH_STAR[0], prediction.last.length), LENGTH_STAR[1])
        given = {"eta_b": eta_b, "eta_m": eta_m, "nu": nu, "model": asked, "accuracy": accuracy}
        try:
            scene = Scene(length=length * unit, height=height * unit, **given)  # type: ignore[arg-type]
            scene.require_long_enough(prediction.last.length)
        except InvalidInputError:
            continue
        return scene, prediction


def _reference(scene: Scene, prediction: ElasticaPrediction, used: str, estimate: float) -> tuple[float, float]:
    """The true end of the advance, L*, and its relative uncertainty; raises SolveError where it cannot be computed."""
    thickness = scene.material.relative_thickness
    kind = "rod" if scene.model == "rod" or used == "elastica" else "solid"
    strip = StripModel(scene.length_star, thickness, scene.nu if kind == "solid" else 0.0, kind=kind)
    finest = FINER * select_model.refinement(kind, estimate)
    fine, coarse = (end_of_advance(strip, prediction, r) for r in (finest, select_model.COARSER * finest))
    uncertainty = select_model.error(kind, finest, fine.lam, coarse.lam, fine.slack) / fine.lam
    if kind != scene.model and kind == "rod":
        uncertainty += model_error("rod", thickness, scene.nu, scene.height_star, scene.length_star)
    return fine.lam, uncertainty


def facts(d: xr.Dataset) -> Facts:
    """A scene that was refused, or has no good reference, counts neither way; the criterion limits their number."""
    judged = d.sel(case=(d.outcome == NUMBER).values)
    # So written, nan counts as outside.
    within, width = (judged.error <= judged.estimate).values, (judged.estimate / judged.error).values
    groups = {
        **{name: judged.asked == name for name in MODELS},
        "h < 0.01 L*": judged.thickness < 0.01,
        "thicker": judged.thickness >= 0.01,
        "nu < 0.25": judged.nu < 0.25,
        "above": judged.nu >= 0.25,
        "accuracy < 1e-4": judged.accuracy < 1e-4,
        "looser": judged.accuracy >= 1e-4,
    }
    return {
        "share": share(within),
        "cases": d.sizes["case"],
        "judged": judged.sizes["case"],
        "seed": seed_of(d),
        "refused": (d.outcome == REFUSED).sum(),
        "unknown": (d.outcome == UNCERTAIN).sum(),
        "by_group": ", ".join(f"{name} {share(within[chosen.values]):.2f}" for name, chosen in groups.items()),
        "width": np.median(width),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("estimate_coverage", "share", "1", ">= 0.95, 0.85 of the scenes judged",
            "share of random scenes ({seed}) over the whole range of inputs whose true error of lambda_c or "
            "lambda_touch is within its estimate, in the median {width:.2g} times as large ({by_group}); {judged} of "
            "{cases} scenes are judged, {refused} were refused, {unknown} have no reference that is good enough",
            lambda f: covers(f.share, f.judged, 0.95, 1.0) and f.judged >= 0.85 * f.cases),
    ),
}
# fmt: on

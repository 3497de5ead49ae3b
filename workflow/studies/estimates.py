"""Does the true error of lambda_c stay within its estimate?  Random scenes, each against a much finer solution.

The reference of a scene with the solid or the rod is the same model on a much finer mesh; where the model is left open
it is the solid, so that the estimate includes the model's error.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold.analysis import critical_point
from stripfold.analysis.prediction import ElasticaPrediction, from_near_the_end
from stripfold.analysis.static import End, StripModel
from stripfold.errors import SolveError
from studies.accuracy import scene_of
from studies.common import Progress, attempted, pooled, table

MODELS = ("auto", "solid", "rod")
ETA_B = (1e2, 1e6)
HEIGHT = (1.62, 9.0)
LONGER = (0.6, 10.0)
"""By how much the strip is longer than the elastica's free part, L*; of less than half an L* it would lift off."""
THICKNESS = (0.005, 0.2)
NU = (0.0, 0.45)
ACCURACY = {"auto": (1e-4, 1e-2), "solid": (3e-4, 1e-2), "rod": (1e-6, 1e-2)}
"""Requested accuracies; a solid to 1e-4 would take long."""
TRUTH = {"solid": 0.25, "rod": 0.15}
"""Refinement of the reference."""


def run(cases: int, seed: int, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts; a solve that failed has nan.

    Dataset over ``case``: what was drawn, the estimate, the true error, both relative, and the model used.
    """
    return table("estimates", "case", pooled(partial(case, seed=seed), range(cases), threads, progress), {"seed": seed})


def case(number: int, seed: int) -> dict[str, Any]:
    """One case; each has a random stream of its own."""
    draw = np.random.default_rng([seed, number])
    asked = MODELS[number % len(MODELS)]
    eta_b, thickness, accuracy = (
        float(np.exp(draw.uniform(*np.log(of)))) for of in (ETA_B, THICKNESS, ACCURACY[asked])
    )
    height, nu = float(draw.uniform(*HEIGHT)), float(draw.uniform(*NU))
    prediction = ElasticaPrediction.at(height)
    length = prediction.last.length + float(draw.uniform(*LONGER))
    scene = scene_of(length, thickness, height, asked, accuracy, nu, eta_b)
    row: dict[str, Any] = {
        "case": number,
        "asked": asked,
        "used": "",
        "eta_b": eta_b,
        "length": length,
        "height": height,
        "thickness": thickness,
        "nu": nu,
        "accuracy": accuracy,
        **dict.fromkeys(("estimate", "error", "seconds"), np.nan),
        "message": "",
    }

    def truth() -> float:
        kind = "rod" if asked == "rod" else "solid"
        strip = StripModel(length, thickness, nu if kind == "solid" else 0.0, kind=kind)
        run = from_near_the_end(strip, prediction, TRUTH[kind])
        if run.end is not End.SNAP:
            raise SolveError(f"the reference is no snap: {run.end.reason}")
        return run.lam

    found, message = attempted(partial(critical_point.find, scene))
    if found is None:
        return row | {"message": message}
    row |= {"used": found.model, "seconds": found.seconds}
    if not found.snap:
        return row | {"message": found.reason}
    lam, message = attempted(truth)
    if lam is None:
        return row | {"message": message}
    row["estimate"] = (found.error + (found.model_error if asked == "auto" else 0.0)) / found.lambda_c
    row["error"] = abs(found.lambda_c / scene.material.gravity_length / lam - 1.0)
    return row

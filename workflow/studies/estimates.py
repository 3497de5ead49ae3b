"""Does the true error of lambda_c stay within its estimate?  Random scenes, each against a much finer solution.

The truth of a scene that asks for the solid or the rod is that model's on a much finer mesh; of one that leaves the
model open it is the solid's, so that the estimate has the model's error in it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from stripfold.analysis import critical_point as critical
from stripfold.analysis import locate_rod, locate_solid
from stripfold.analysis.static import End, StripModel
from stripfold.errors import SolveError
from studies.accuracy import scene_of

MODELS = ("auto", "solid", "rod")
ETA_B = (1e2, 1e6)
HEIGHT = (1.62, 9.0)
LONGER = (0.3, 10.0)
"""By how much the strip is longer than the elastica's free part, L*."""
THICKNESS = (0.005, 0.2)
NU = (0.0, 0.45)
ACCURACY = {"auto": (1e-4, 1e-2), "solid": (3e-4, 1e-2), "rod": (1e-6, 1e-2)}
"""What is asked for; a solid to 1e-4 takes its time."""
TRUTH = {"solid": 0.35, "rod": 0.2}
"""Factor on the element lengths of the truth."""


def run(cases: range, seed: int, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Run the cases with these numbers of the sequence that ``seed`` starts; a solve that failed has nan.

    Returns
    -------
    Dataset over ``case``: what was drawn, the estimate, the true error, both relative, and the model used.
    """
    rows = []
    for number in cases:
        # One stream per case: any part of the study can be run alone.
        draw = np.random.default_rng([seed, number])
        asked = MODELS[number % len(MODELS)]
        eta_b, thickness, accuracy = (
            float(np.exp(draw.uniform(*np.log(of)))) for of in (ETA_B, THICKNESS, ACCURACY[asked])
        )
        height, nu = float(draw.uniform(*HEIGHT)), float(draw.uniform(*NU))
        prediction = locate_rod.ElasticaPrediction.at(height)
        length = prediction.last.length + float(draw.uniform(*LONGER))
        scene = scene_of(length, thickness, height, asked, accuracy, nu, eta_b)
        estimate = error = seconds = np.nan
        used = message = ""
        try:
            found = critical.find(scene)
            used, seconds = found.model, found.seconds
            truth = _truth("rod" if asked == "rod" else "solid", prediction, length, thickness, nu)
            if found.snap:
                lam = found.lambda_c / scene.material.gravity_length
                estimate = (found.error + (found.model_error if asked == "auto" else 0.0)) / found.lambda_c
                error = abs(lam / truth - 1.0)
            else:
                message = found.reason
        except SolveError as failure:
            message = f"{type(failure).__name__}: {failure}"
        rows.append(
            (number, asked, used, eta_b, length, height, thickness, nu, accuracy, estimate, error, seconds, message)
        )
        if progress:
            progress(f"case {number}: {asked} {used} {error:.1e} <= {estimate:.1e} <= {accuracy:.1e} {message}")
    names = {
        "asked": ("1", "model asked for"),
        "used": ("1", "model used"),
        "eta_b": ("m-4 s2", "weight-to-bending-stiffness ratio"),
        "length": ("1", "strip length / L*"),
        "height": ("1", "gripper height / L*"),
        "thickness": ("1", "h / L*"),
        "nu": ("1", "Poisson's ratio"),
        "accuracy": ("1", "relative accuracy asked for"),
        "estimate": ("1", "estimated relative error of lambda_c"),
        "error": ("1", "relative distance of lambda_c from the truth"),
        "seconds": ("s", "time of the solve, others beside it"),
        "message": ("1", "why there is no lambda_c"),
    }
    columns = list(zip(*rows, strict=True))
    texts = ("asked", "used", "message")
    data = {
        name: ("case", np.array(column, dtype=object if name in texts else None), {"units": u, "long_name": t})
        for (name, (u, t)), column in zip(names.items(), columns[1:], strict=True)
    }
    case = ("case", np.array(columns[0]), {"units": "1", "long_name": "number of the case"})
    return xr.Dataset(data, coords={"case": case}, attrs={"seed": seed})


def _truth(model: str, prediction: locate_rod.ElasticaPrediction, length: float, thickness: float, nu: float) -> float:
    """lambda_c / L* on a much finer mesh.

    Raises
    ------
    SolveError
        It fails, or is no snap.
    """
    strip = StripModel(length, thickness, nu if model == "solid" else 0.0, kind=model)
    found = (locate_rod.run if model == "rod" else locate_solid.run)(strip, prediction, TRUTH[model])
    if found.end is not End.SNAP:
        raise SolveError(f"the truth is no snap: {found.end.reason}")
    return found.lam

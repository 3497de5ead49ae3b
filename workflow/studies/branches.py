"""Random strips on the solid against the elastica: does the continuation ever leave its branch unseen?

For each case the elastica says what has to come out: a snap at its lambda_c, the sag landing first, or a strip that is
too short.  The solid differs from it by its thickness, by a known amount; anything else is a jump.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.static import End, StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.material import Material

ETA_B = (1e2, 1e6)
HEIGHT = (1.7, 5.0)
LENGTH = (10.0, 25.0)
THICKNESS_SHIFT = -6.0
"""lambda_c of the solid less the elastica's, in L*, per (h/L*)^2: from the limit study."""
TOLERANCE = 5e-3
"""Relative difference of lambda_c, beside the shift above, beyond which a case is on another branch."""

RIGHT, WRONG, FAILED = 0, 1, 2


def run(
    cases: range, seed: int, refinement: float, eta_m: float, progress: Callable[[str], None] | None = None
) -> xr.Dataset:
    """Run the cases with these numbers of the sequence that ``seed`` starts.

    Returns
    -------
    Dataset over ``case``: what was drawn, what came out, and ``verdict`` 0 right, 1 wrong branch, 2 typed error.
    """
    rows = []
    for number in cases:
        # One stream per case: any part of the study can be run alone.
        draw = np.random.default_rng([seed, number])
        eta_b = float(np.exp(draw.uniform(*np.log(ETA_B))))
        height, length = float(draw.uniform(*HEIGHT)), float(draw.uniform(*LENGTH))
        h = Material(eta_b, eta_m).relative_thickness
        truth = elastica.critical(height)
        found, end, free, verdict, folds, message = np.nan, "", np.nan, FAILED, 0, ""
        try:
            outcome = solve_height(StripModel(length, h), height, refinement, past=0.0)
        except SolveError as error:
            message = str(error)
        else:
            found, end, free = outcome.last.lam, outcome.end.value, outcome.free_length
            folds = outcome.contact_folds
            shifted = truth.advance + THICKNESS_SHIFT * h**2
            same = end == End.SNAP and abs(found - shifted) <= TOLERANCE * truth.advance
            verdict = RIGHT if same else WRONG
        rows.append(
            (number, eta_b, height, length, h, truth.advance, truth.length, found, free, folds, verdict, end, message)
        )
        if progress:
            progress(f"case {number}: {end or message}")
    names = {
        "eta_b": ("m-4 s2", "weight-to-bending-stiffness ratio"),
        "height": ("1", "gripper height / L*"),
        "length": ("1", "strip length / L*"),
        "thickness": ("1", "h / L*"),
        "lambda_c_elastica": ("1", "elastica's lambda_c / L*"),
        "free_length_elastica": ("1", "elastica's free length / L*"),
        "lambda_end": ("1", "solid's lambda at the end of the advance / L*"),
        "free_length": ("1", "solid's free length / L*"),
        "contact_folds": ("1", "maxima of lambda due to the mesh, passed"),
        "verdict": ("1", "0 right, 1 wrong branch, 2 typed error"),
        "end": ("1", "what ended the advance"),
        "message": ("1", "the error's message"),
    }
    columns = list(zip(*rows, strict=True))
    data = {
        name: (
            "case",
            np.array(column, dtype=object if name in ("end", "message") else None),
            {"units": u, "long_name": t},
        )
        for (name, (u, t)), column in zip(names.items(), columns[1:], strict=True)
    }
    case = ("case", np.array(columns[0]), {"units": "1", "long_name": "number of the case"})
    return xr.Dataset(data, coords={"case": case}, attrs={"seed": seed, "refinement": refinement, "eta_m": eta_m})

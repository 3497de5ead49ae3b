"""Random strips on the solid against the elastica: does the continuation ever leave its branch unseen?

For each case the elastica says what the outcome must be: a snap at its lambda_c.  The solid differs from it by its
thickness, by a known amount; anything else is another branch.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.analysis.static import End, StripModel, solve_height
from stripfold.errors import SolveError
from stripfold.material import Material
from studies.common import Progress, pooled, table

ETA_B = (1e2, 1e6)
HEIGHT = (1.7, 5.0)
LENGTH = (10.0, 25.0)
THICKNESS_SHIFT = -6.0
"""lambda_c of the solid less the elastica's, in L*, per (h/L*)^2: from the limit study."""
TOLERANCE = 5e-3
"""Relative difference of lambda_c, beside the shift above, beyond which a case is on another branch."""

RIGHT, WRONG, FAILED = 0, 1, 2


def run(
    cases: int, seed: int, refinement: float, eta_m: float, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts.

    Returns
    -------
    Dataset over ``case``: what was drawn, the outcome, and ``verdict`` 0 right, 1 wrong branch, 2 typed error.
    """
    one = partial(case, seed=seed, refinement=refinement, eta_m=eta_m)
    attrs = {"seed": seed, "refinement": refinement, "eta_m": eta_m}
    return table("branches", "case", pooled(one, range(cases), threads, progress), attrs)


def case(number: int, seed: int, refinement: float, eta_m: float) -> dict[str, Any]:
    """One case; each has a random stream of its own."""
    draw = np.random.default_rng([seed, number])
    eta_b = float(np.exp(draw.uniform(*np.log(ETA_B))))
    height, length = float(draw.uniform(*HEIGHT)), float(draw.uniform(*LENGTH))
    h = Material(eta_b, eta_m).relative_thickness
    truth = elastica.critical(height)
    row = {
        "case": number,
        "eta_b": eta_b,
        "height": height,
        "length": length,
        "thickness": h,
        "lambda_c_elastica": truth.advance,
        "free_length_elastica": truth.length,
    }
    try:
        found = solve_height(StripModel(length, h), height, refinement, past=0.0)
    except SolveError as error:
        nothing = {"lambda_end": np.nan, "free_length": np.nan, "end": ""}
        return {**row, **nothing, "verdict": FAILED, "message": f"{type(error).__name__}: {error}"}
    shifted = truth.advance + THICKNESS_SHIFT * h**2
    same = found.end is End.SNAP and abs(found.lam - shifted) <= TOLERANCE * truth.advance
    return {
        **row,
        "lambda_end": found.lam,
        "free_length": found.free_length,
        "end": found.end.value,
        "verdict": RIGHT if same else WRONG,
        "message": "",
    }

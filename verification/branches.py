"""Random strips on the solid, followed from the flat strip, against the elastica and a finer mesh.

For each case the elastica says what the outcome must be: a snap at its lambda_c.  The solid differs from it by its
thickness, by a known amount; anything else is another branch.  The first cases are followed past their end: a maximum
of lambda that elements half as long do not have is a spurious limit point.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.follow.contact_branch import BranchPoint
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.track import End, Track
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, seed_of

UNITS = {"m-4 s2": "eta_b"}

ETA_B = (1e2, 1e6)
HEIGHT = (1.7, 5.0)
LENGTH = (10.0, 25.0)
THICKNESS_SHIFT = -6.0
"""lambda_c of the solid less the elastica's, in L*, per (h/L*)^2: from the limit study."""
TOLERANCE = 5e-3
"""Relative difference of lambda_c, beside the shift above, beyond which a case is on another branch."""

SAME = 1e-3
"""Relative difference of two maxima of lambda below which they are the same on two meshes."""
PAST = 1.0
"""Arc length past the end within which maxima are looked for, L*."""

RIGHT, WRONG, FAILED = 0, 1, 2


def run(
    cases: int = 160,
    compared: int = 20,
    seed: int = 1,
    refinement: float = 1.0,
    eta_m: float = 0.001,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The first cases of the sequence that ``seed`` starts; ``compared`` of them are run on a finer mesh too.

    Dataset over ``case``: what was drawn, the outcome, and ``verdict`` 0 right, 1 wrong branch, 2 error;
    ``spurious_limit_points`` is nan of cases that are not compared.
    """
    one = partial(case, compared=compared, seed=seed, refinement=refinement, eta_m=eta_m)
    attrs = {"seed": seed, "refinement": refinement, "eta_m": eta_m}
    return table("case", pooled(one, range(cases), threads, progress), attrs, units=UNITS)


def case(number: int, compared: int, seed: int, refinement: float, eta_m: float) -> dict[str, Any]:
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
    strip = StripModel(length, h)
    found, message = attempted(lambda: solve_height(strip, height, refinement, PAST if number < compared else 0.0))
    if found is None:
        nothing = {"lambda_end": np.nan, "free_length": np.nan, "spurious_limit_points": np.nan, "end": ""}
        return {**row, **nothing, "verdict": FAILED, "message": message}
    more = np.nan
    if number < compared:
        counted, message = attempted(lambda: spurious(found, strip, height, 0.5 * refinement))
        more = np.nan if counted is None else counted
    shifted = truth.advance + THICKNESS_SHIFT * h**2
    same = found.end is End.SNAP and abs(found.lam - shifted) <= TOLERANCE * truth.advance
    return {
        **row,
        "lambda_end": found.lam,
        "free_length": found.free_length,
        "spurious_limit_points": more,
        "end": found.end.value,
        "verdict": RIGHT if same else WRONG,
        "message": message,
    }


def spurious(run: Track, strip: StripModel, height: float, refinement: float) -> int:
    """Number of maxima of lambda that the branch on another mesh does not have: its last ones are computed first."""
    there = maxima(from_near_the_end(strip, ElasticaPrediction.at(height), refinement).branch)
    if lacking(maxima((*run.branch, *run.beyond)), there):
        again = solve_height(strip, height, refinement, PAST)
        there = maxima((*again.branch, *again.beyond))
    return lacking(maxima((*run.branch, *run.beyond)), there)


def lacking(found: Array, there: Array) -> int:
    """Number of maxima that are not among those of another mesh."""
    return sum(not np.any(np.abs(there - lam) < SAME * abs(lam)) for lam in found)


def maxima(points: Sequence[BranchPoint]) -> Array:
    """Maxima of lambda along a branch."""
    lam, rate = np.array([(at.point.lam, at.point.tangent.lam) for at in points]).T
    at = np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0))
    return np.maximum(lam[at], lam[at + 1])


def facts(d: xr.Dataset) -> Facts:
    wrong, failed = ((d.verdict == verdict).sum() for verdict in (WRONG, FAILED))
    return {"cases": d.sizes["case"], "seed": seed_of(d), "wrong": wrong, "failed": failed}


def spurious_facts(strips: xr.Dataset, random_paths: xr.Dataset) -> Facts:
    strip, path = (d.spurious_limit_points.dropna("case") for d in (strips, random_paths))
    return {
        "strips": strip.size,
        "paths": path.size,
        "drawn": random_paths.sizes["case"],
        "refused": (random_paths.outcome == "refused").sum(),
        "spurious": float(strip.sum()) + float(path.sum()),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("branch_jumps", "wrong", "count", "= 0",
            "runs on another branch than the elastica's, of {cases} random strips ({seed}); the {failed} that ended "
            "in an error have no branch and count in `branch_failures`"),
        Number("branch_failures", "failed", "count", "= 0",
            "runs that ended in a typed error instead of a result, of {cases} random strips ({seed})"),
    ),
    spurious_facts: (
        Number("spurious_limit_points", "spurious", "count", "= 0",
            "maxima of lambda on the branches of {strips} random strips and {paths} random paths (of {drawn}, of which "
            "{refused} are refused) that a finer mesh does not have"),
    ),
}
# fmt: on

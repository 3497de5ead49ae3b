"""Random strips and random gripper paths on the solid, against the elastica and shorter steps on another mesh.

Of a strip that is moved along x the elastica says what the outcome must be: a snap at its lambda_c.  The solid differs
from it by its thickness, by a known amount; anything else is another branch.  The first strips are followed past their
end: a maximum of lambda that elements half as long do not have is a spurious limit point.  Paths are smooth or have
corners, some are out of the strip's reach, some below the floor: each gets a verdict or is refused, and the same
verdict with shorter steps on another mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from stripfold.follow.contact_branch import STEPS, BranchPoint
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel, solve_height
from stripfold.follow.track import End, Track
from stripfold.paths import table as user_table
from stripfold.paths.curve import GripperPath, polygon_length
from verification.common import Progress, attempted, dataset, pooled
from verification.numbers import Facts, Number, seed_of

ETA_B, HEIGHT, LENGTH = (1e2, 1e6), (1.7, 5.0), (10.0, 25.0)
"""Ranges of strips along x: m^-4 s^2, L*."""
PATH_LENGTH, PATH_THICKNESS = (9.0, 20.0), (0.04, 0.1)
"""Ranges of strips on paths, L*; the paper's eta_m gives its fabrics these thicknesses."""
BEYOND_LAW = "crushed"
"""Outcome, and word of the message, of a strip that is compressed beyond its law."""
THICKNESS_SHIFT = -6.0
"""lambda_c of the solid less the elastica's, in L*, per (h/L*)^2: from the study of models."""
TOLERANCE, SAME = 5e-3, 1e-3
"""Relative difference of lambda_c, beside that shift, beyond which a case is on another branch; that of two maxima of
lambda below which they are the same on two meshes."""
PAST = 1.0
"""Arc length past the end within which maxima are looked for, L*."""
SAME_PLACE = 0.05
"""Distance between the critical points of both runs on a path below which they are the same, L*."""
SHORTER = 0.5
"""Factor on the steps of the second run on a path; that on its element lengths is the root of this one."""
RIGHT, WRONG, FAILED = 0, 1, 2


def run(
    cases: int = 60,
    compared: int = 5,
    paths: int = 6,
    seed: int = 1,
    refinement: float = 1.0,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The first strips and paths of the sequences that ``seed`` starts.

    Over ``case``: ``verdict`` 0 right, 1 wrong branch, 2 error.  Over ``path``: ``outcome`` "stable", "critical",
    "close" (to a touch), "refused", "crushed" or "undecided".  Over both: spurious limit points, nan where there is no
    second run, and the message of an error.
    """
    strips = pooled(partial(strip_case, compared=compared, seed=seed, refinement=refinement), range(cases), threads)
    assessed = pooled(partial(path_case, seed=seed, refinement=refinement), range(paths), threads, progress)
    return dataset(
        {
            **{name: ("case", [row[name] for row in strips]) for name in strips[0]},
            **{name: ("path", [row[name] for row in assessed]) for name in assessed[0]},
        },
        {"seed": seed},
    )


def strip_case(number: int, compared: int, seed: int, refinement: float) -> dict[str, Any]:
    """One strip along x; each has a random stream of its own."""
    draw = np.random.default_rng([seed, number])
    eta_b = float(np.exp(draw.uniform(*np.log(ETA_B))))
    height, length = float(draw.uniform(*HEIGHT)), float(draw.uniform(*LENGTH))
    strip, truth = StripModel(length, Material(eta_b, 0.001).relative_thickness), elastica.critical(height).advance
    past = PAST if number < compared else 0.0
    found, message = attempted(lambda: solve_height(strip, height, refinement, past))
    row: dict[str, Any] = {"verdict": FAILED, "spurious": np.nan, "message": message}
    if found is None:
        return row
    if past:
        row["spurious"], row["message"] = attempted(lambda: spurious(found, strip, height, 0.5 * refinement))
        row["spurious"] = np.nan if row["spurious"] is None else row["spurious"]
    apart = abs(found.lam - truth - THICKNESS_SHIFT * strip.thickness**2)
    return row | {"verdict": RIGHT if found.end is End.SNAP and apart <= TOLERANCE * truth else WRONG}


def spurious(run: Track, strip: StripModel, height: float, refinement: float) -> int:
    """Number of maxima of lambda that the branch on another mesh does not have: its last ones are computed first."""

    def lacking(there: Array) -> int:
        found = maxima((*run.branch, *run.beyond))
        return sum(not np.any(np.abs(there - lam) < SAME * abs(lam)) for lam in found)

    near = from_near_the_end(strip, ElasticaPrediction.at(height), refinement)
    if lacking(maxima(near.branch)) == 0:
        return 0
    again = solve_height(strip, height, refinement, PAST)
    return lacking(maxima((*again.branch, *again.beyond)))


def maxima(points: Sequence[BranchPoint]) -> Array:
    """Maxima of lambda along a branch."""
    lam, rate = np.array([(at.point.lam, at.point.tangent.lam) for at in points]).T
    at = np.flatnonzero((rate[:-1] > 0.0) & (rate[1:] <= 0.0))
    return np.maximum(lam[at], lam[at + 1])


def path_case(number: int, seed: int, refinement: float) -> dict[str, Any]:
    """One path, assessed twice."""
    random = np.random.default_rng([seed, number])
    strip = StripModel(float(random.uniform(*PATH_LENGTH)), float(random.uniform(*PATH_THICKNESS)))
    row: dict[str, Any] = {"outcome": "undecided", "apart": np.nan, "spurious_on_path": np.nan, "path_message": ""}
    try:
        path = _as_table(_way(random, strip.length, smooth=number % 2 == 0), strip.length)
    except InvalidInputError as error:
        return row | {"outcome": "refused", "path_message": str(error)}
    shorter = replace(STEPS, first=SHORTER * STEPS.first, largest=SHORTER * STEPS.largest)
    runs: list[Track] = []
    for how in ({"refinement": refinement}, {"refinement": refinement * SHORTER**0.5, "options": shorter}):
        found, message = attempted(partial(assess_strip, strip, path, **how))
        if found is None:
            return row | {"outcome": BEYOND_LAW if BEYOND_LAW in message else "undecided", "path_message": message}
        runs.append(found)
    critical = [one.events[0].travelled for one in runs if not one.stable]
    # Where one run touches, the other may become critical: near the limit below which nothing snaps.
    touches = [one.touch.travelled for one in runs if one.stable and one.touch is not None]
    apart = float(np.ptp([*critical, *touches])) if critical and len([*critical, *touches]) == 2 else 0.0
    same = len(critical) != 1 or len(touches) == 1
    if not same or apart > SAME_PLACE:
        return row | {"spurious_on_path": float(not runs[0].stable), "path_message": "the runs contradict each other"}
    outcome = "stable" if not critical else "critical" if len(critical) == 2 else "close"
    return row | {"outcome": outcome, "apart": apart, "spurious_on_path": 0.0}


def _way(random: np.random.Generator, length: float, smooth: bool) -> Array:
    """Way points above the floor, or nearly so: towards the held end on the whole, as folding does."""
    half, count = length / 2.0, int(random.integers(3, 6, endpoint=True))
    x = -half + np.sort(random.uniform(0.05, 1.0, count)) * length
    top = np.sqrt(np.maximum(length**2 - (x - half) ** 2, 0.0))
    z = random.uniform(0.02, 0.75, count) * top
    # A few are out of reach, a few below the floor.
    stray, place = random.uniform(), random.integers(count)
    if stray < 0.1:
        z[place] = -0.1 * length if stray < 0.05 else 1.1 * top[place] + 0.1 * length
    points = np.concatenate([[[-half, 0.0]], np.stack([x, z], axis=1)])
    if smooth:
        at = polygon_length(points)
        points = PchipInterpolator(at, points)(np.linspace(0.0, at[-1], 40 * count))
    return np.column_stack([np.arange(len(points)), points])


def _as_table(rows: Array, length: float) -> GripperPath:
    """The path as a user would hand it in; raises InvalidInputError: when it is refused."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "path.csv"
        np.savetxt(path, rows, "%.9g", ",", header="t,x,z", comments="")
        return user_table.read(path, length, 1.0)


def facts(d: xr.Dataset) -> Facts:
    strip, path = d.spurious.dropna("case"), d.spurious_on_path.dropna("path")
    outcomes, counts = np.unique(d.outcome.values, return_counts=True)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "wrong": (d.verdict == WRONG).sum(),
        "failed": (d.verdict == FAILED).sum(),
        "strips": strip.size,
        "paths": path.size,
        "spurious": float(strip.sum()) + float(path.sum()),
        "drawn": d.sizes["path"],
        "counts": ", ".join(f"{n} {outcome}" for n, outcome in zip(counts, outcomes, strict=True)),
        "undecided": (d.outcome == "undecided").sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("branch_jumps", "wrong", "count", "= 0",
            "runs on another branch than the elastica's, of {cases} random strips ({seed}); the {failed} that ended "
            "in an error have no branch and count in `branch_failures`"),
        Number("branch_failures", "failed", "count", "= 0",
            "runs that ended in a typed error instead of a result, of {cases} random strips ({seed})"),
        Number("spurious_limit_points", "spurious", "count", "= 0",
            "maxima of lambda on the branches of {strips} random strips and {paths} random paths that another mesh "
            "does not have"),
        Number("random_paths_undecided", "undecided", "count", "<= 2",
            "random paths without a verdict, of {drawn} ({seed}; {counts}): an error, or two runs that contradict each "
            "other"),
    ),
}
# fmt: on

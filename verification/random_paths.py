"""Random gripper paths: each gets a verdict or a clear error, and the verdict does not depend on the steps.

Smooth ones and ones with corners, some out of the strip's reach, some below the floor.  Every assessment is repeated
with shorter steps on another mesh, which would reveal a wrong branch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.follow.contact_branch import STEPS
from stripfold.follow.fall import assess_strip
from stripfold.follow.statics import StripModel
from stripfold.follow.track import Track
from stripfold.paths import table as user_table
from stripfold.paths.curve import GripperPath, polygon_length
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, seed_of

UNITS = {"degree": "angle"}

KINDS = ("smooth", "corners")
LENGTHS, THICKNESSES = (9.0, 20.0), (0.04, 0.1)
"""Ranges of strips, L*; the paper's eta_m gives its fabrics these thicknesses."""
SAME_PLACE = 0.05
"""Largest distance between the critical points of both runs, L*."""
SHORTER = 0.5
"""Factor on the steps of the second run; the factor on its element lengths is the root of this one."""
CONTRADICTED = "the second run contradicts the first"
SEGMENTS = (3, 6)
ROWS_PER_SEGMENT = 40


@dataclass(frozen=True, slots=True)
class Case:
    """A random strip and path; ``rows`` are t, x, z, shape (n, 3), L*."""

    kind: str
    strip: StripModel
    rows: Array


def case(number: int, seed: int) -> Case:
    """A random case, the same for the same numbers; any part of the study can be run alone."""
    random = np.random.default_rng([seed, number])
    strip = StripModel(float(random.uniform(*LENGTHS)), float(random.uniform(*THICKNESSES)))
    kind = KINDS[number % len(KINDS)]
    return Case(kind, strip, _rows(random, strip.length, kind))


def _rows(random: np.random.Generator, length: float, kind: str) -> Array:
    """Way points above the floor, or nearly so: towards the held end on the whole, as folding does."""
    half, count = length / 2.0, int(random.integers(*SEGMENTS, endpoint=True))
    x = -half + np.sort(random.uniform(0.05, 1.0, count)) * length
    top = np.sqrt(np.maximum(length**2 - (x - half) ** 2, 0.0))
    # A few are out of reach, a few below the floor.
    z = random.uniform(0.02, 0.75, count) * top
    stray = random.uniform()
    if stray < 0.05:
        z[random.integers(count)] = -0.1 * length
    elif stray < 0.1:
        place = random.integers(count)
        z[place] = 1.1 * top[place] + 0.1 * length
    points = np.concatenate([[[-half, 0.0]], np.stack([x, z], axis=1)])
    if kind == "smooth":
        at = polygon_length(points)
        fine = np.linspace(0.0, at[-1], ROWS_PER_SEGMENT * count)
        points = PchipInterpolator(at, points)(fine)
    return np.column_stack([np.arange(len(points)), points])


def run(
    cases: int = 24, seed: int = 1, refinement: float = 1.0, threads: int = 1, progress: Progress | None = None
) -> xr.Dataset:
    """Assess the first random paths of the sequence that ``seed`` starts statically, each twice.

    Dataset over ``case``: ``outcome`` ("stable", "critical", "close", "refused" or "undecided"), the first critical
    point of both runs, ``contact`` ("moving" or "nodal"), the message of an error, and ``spurious_limit_points``: 1
    where the first run, but not the second, is critical, nan where there are not two runs.
    """
    one = partial(numbered, seed=seed, refinement=refinement)
    rows = pooled(one, range(cases), threads, progress)
    return table("case", rows, {"seed": seed, "refinement": refinement}, units=UNITS)


def numbered(number: int, seed: int, refinement: float) -> dict[str, Any]:
    """The case of this number."""
    return {"case": number, **outcome(case(number, seed), refinement)}


def outcome(asked: Case, refinement: float) -> dict[str, Any]:
    """The outcome of one case."""
    row: dict[str, Any] = {
        "kind": asked.kind,
        "length": asked.strip.length,
        "thickness": asked.strip.thickness,
        **dict.fromkeys(("critical", "again", "angle", "touched", "spurious_limit_points"), np.nan),
        "contact": "",
        "message": "",
    }
    try:
        path = as_table(asked)
    except InvalidInputError as error:
        return {**row, "outcome": "refused", "message": str(error)}
    found, message = attempted(lambda: assess_strip(asked.strip, path, refinement=refinement))
    again, again_message = attempted(lambda: _again(asked, path, refinement))
    if found is None or again is None:
        return {**row, "outcome": "undecided", "message": message or again_message}
    row["critical"], row["again"] = _first(found), _first(again)
    row["angle"] = found.events[0].angle if found.events else np.nan
    row["contact"] = found.contact
    row["touched"] = float(found.touch is not None)
    close = found.stable != again.stable and _at_the_touch(found, again)
    same = found.stable == again.stable and not abs(row["critical"] - row["again"]) > SAME_PLACE
    row["spurious_limit_points"] = float(not (found.stable or same or close))
    if close:
        return {**row, "outcome": "close", "message": "the sag touches where the strip would become critical"}
    if not same:
        return {**row, "outcome": "undecided", "message": CONTRADICTED}
    return {**row, "outcome": "stable" if found.stable else "critical"}


def as_table(asked: Case) -> GripperPath:
    """The path as a user would hand it in.

    Raises InvalidInputError: when it is refused.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder) / "path.csv"
        lines = ["t,x,z", *(",".join(f"{value:.9g}" for value in row) for row in asked.rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return user_table.read(path, asked.strip.length, 1.0)


def _again(asked: Case, path: GripperPath, refinement: float) -> Track:
    steps = replace(STEPS, first=SHORTER * STEPS.first, largest=SHORTER * STEPS.largest)
    return assess_strip(asked.strip, path, refinement=refinement * SHORTER**0.5, options=steps)


def _at_the_touch(one: Track, other: Track) -> bool:
    """Whether one run touches where the other becomes critical: near the limit below which nothing snaps."""
    stable, critical = (one, other) if one.stable else (other, one)
    return stable.touch is not None and abs(stable.touch.travelled - critical.events[0].travelled) < SAME_PLACE


def _first(found: Track) -> float:
    return found.events[0].travelled if found.events else float("nan")


def facts(d: xr.Dataset) -> Facts:
    outcome = d.outcome.values
    messages = d.message.values[outcome == "undecided"]
    names = ("stable", "critical", "close", "refused", "undecided")
    return {
        "paths": len(outcome),
        "seed": seed_of(d),
        "counts": ", ".join(f"{np.sum(outcome == name)} {name}" for name in names),
        "apart": np.abs(d.critical - d.again).values[outcome == "critical"].max(initial=0.0),
        "undecided": len(messages),
        "contradicted": np.sum(messages == CONTRADICTED),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("random_paths_undecided", "undecided", "count", "<= 2",
            "random paths without a verdict, of {paths} ({seed}): an error, or two runs that contradict each other "
            "({contradicted})"),
    ),
}
# fmt: on

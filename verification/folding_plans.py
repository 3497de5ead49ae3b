"""Plans for random strips whose eta_b is uncertain: are the paths safe, are the refusals right, what do they cost.

A plan's rod is assessed once more on finer elements, with the least, the given and the largest eta_b.  Where the
plan says that there is none, two reasons are checked without the planner: a scan of critical points is nearer to the
triangular path than the margin, and a strip is lost on the R-path with the friction that there is, less what is to
spare.  Source: docs/plan.md.
"""

from __future__ import annotations

from functools import cache, partial
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica, paths
from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.friction import SPARE
from stripfold.ask.inputs import PathInputs, PlanInputs, Strip
from stripfold.ask.plan import DELAY, Choice, choose
from stripfold.ask.planned_motion import ACCURATE
from stripfold.base.arrays import Array
from stripfold.base.errors import NoPathError
from stripfold.follow.memory import STEP
from stripfold.paths import FoldPath
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, share

UNITS = {"s": "seconds speed_seconds"}

LENGTH, ETA_B, MARGIN, SPEED = (8.5, 30.0), (820.0, 30200.0), (0.1, 0.6), (0.03, 0.3)
"""What is drawn: strip length, L*, evenly; eta_b, m^-4 s^2, by its logarithm; margin, L*, evenly; speed, m/s, by its
logarithm."""
SLIDES, HAS_FRICTION = 0.5, 0.1
"""Shares of strips whose layers may slide, and of the others of those with a friction moment known."""
MOMENT, YIELD = (0.005, 0.3), (0.05, 0.5)
"""M_0, rho_a g L*^2, evenly in its logarithm, and kappa_y, 1/L*."""
UNCERTAINTY = 0.2
REFINEMENT = 0.5
"""Factor on the elements' lengths and on the steps with friction of the second assessment."""
BETWEEN_MESHES = 1.15
"""Ratio by which the friction that a strip needs may differ between meshes and steps."""
REFUSED, FAILED = "none", "failed"
SPACING = 0.05
"""Of the heights of critical points scanned, L*."""


def case(number: int, seed: int) -> tuple[PlanInputs, float]:
    """A random strip and a speed of its gripper, the same for the same numbers."""
    random = np.random.default_rng([seed, number])
    eta_b, moment, speed = (float(np.exp(random.uniform(*np.log(of)))) for of in (ETA_B, MOMENT, SPEED))
    unit = Strip(length=1.0, eta_b=eta_b).gravity_length
    length, margin = unit * random.uniform(*LENGTH), unit * random.uniform(*MARGIN)
    slides, has = random.uniform(size=2) < (SLIDES, HAS_FRICTION)
    asked: dict[str, Any] = {"length": length, "eta_b": eta_b, "margin": margin, "eta_b_uncertainty": UNCERTAINTY}
    if has and not slides:
        asked["friction_moment"] = moment * Strip(length=length, eta_b=eta_b).material.force_scale * unit
        asked["yield_curvature"] = float(random.uniform(*YIELD)) / unit
    return PlanInputs(**asked, layers_may_slide=bool(slides)), speed


def run(cases: int = 4, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Plan for the first random strips of the sequence that ``seed`` starts, and check each.

    Dataset over ``case``: the path, "none" or "failed"; ``safe``: whether it is stable on finer elements with all three
    eta_b, nan where there is none; ``confirmed``: whether the checked reasons against a path are confirmed, nan where
    there is one; what the plan cost, also with a speed; messages.
    """
    rows = pooled(partial(numbered, seed=seed), range(cases), threads, progress)
    return table("case", rows, {"seed": seed}, units=UNITS)


def numbered(number: int, seed: int) -> dict[str, Any]:
    """The case of this number."""
    asked, speed = case(number, seed)
    (found, message), seconds = _chosen(asked)
    _, speed_seconds = _chosen(asked.model_copy(update={"speed": speed}))
    row: dict[str, Any] = {"case": number, "seconds": seconds, "speed_seconds": speed_seconds, "path": FAILED}
    row |= {"safe": np.nan, "confirmed": np.nan, "message": message}
    if isinstance(found, NoPathError):
        checks = {"triangular": _no_triangular, "r-path": _no_r_path}
        of = [checks[one.path] for one in found.refused if one.path in checks]
        confirmed, message = attempted(lambda: all(check(asked) for check in of))
        row |= {"path": REFUSED, "confirmed": float(bool(confirmed)), "message": message}
    elif found is not None:
        moment = asked.friction_moment if found.sufficient_moment is not None else None
        safe, message = attempted(lambda: all(_assessed(asked, of, found.path, moment).stable for of in asked.strips))
        row |= {"path": found.path.name, "safe": float(bool(safe)), "message": message}
    return row


def _chosen(asked: PlanInputs) -> tuple[tuple[Choice | NoPathError | None, str], float]:
    """A plan or that there is none, an error's message, and the seconds that it cost."""

    def chosen() -> Choice | NoPathError:
        try:
            return choose(asked)
        except NoPathError as error:
            return error

    began = perf_counter()
    return attempted(chosen), perf_counter() - began


def _assessed(asked: PlanInputs, strip: Strip, path: FoldPath, moment: float | None) -> PathAssessment:
    """The rod on a path on finer elements, with this M_0, N."""
    friction: dict[str, Any] = {}
    if moment is not None:
        friction = {"friction_moment": moment, "step": STEP * REFINEMENT * strip.gravity_length}
    inputs, kappa_y = PathInputs(**strip.model_dump(), model="rod", **friction), asked.yield_curvature
    return assess(inputs, path, yield_curvature=kappa_y, refinement=REFINEMENT, compare=False)


def _no_triangular(asked: PlanInputs) -> bool:
    """Whether its second edge comes within the margin of critical points of the softest strip, before the touch."""
    unit = asked.strips[-1].gravity_length
    length, limit = asked.length / unit, elastica.touch_limit()
    heights, advance, free = _critical_points()
    snaps = (heights > limit) & (heights <= 0.5 * length) & (free < length)
    wall = np.column_stack([advance, heights])[snaps]
    z = np.linspace(0.5 * length, 0.0, 1000)
    edge = np.column_stack([length - z, z])
    lands = edge[:, 0] > np.interp(z, heights[heights < limit], advance[heights < limit])
    edge = edge[: int(np.argmax(lands & (z < limit)))]
    beyond = edge[:, 0] > np.interp(edge[:, 1], wall[:, 1], wall[:, 0], left=np.inf, right=np.inf)
    away = np.linalg.norm(edge[:, None] - wall, axis=2).min()
    return bool(beyond.any() or away <= asked.margin / unit + wall[1, 1] - wall[0, 1])


@cache
def _critical_points() -> tuple[Array, Array, Array]:
    """Heights, and advances and free lengths where a strip snaps or touches: those of a long one, for all strips."""
    heights = np.arange(0.5, 0.6 * LENGTH[1], SPACING)
    ends = [elastica.critical(float(z)).state for z in heights]
    return heights, np.array([end.advance for end in ends]), np.array([end.length for end in ends])


def _no_r_path(asked: PlanInputs) -> bool:
    """Whether one strip is lost without friction, or with so much less that nothing is to spare, or folded off."""
    path, given = paths.r_path(asked), asked.friction_moment
    moment: float | None = None
    if given is not None:
        kept = asked.margin * asked.material.force_scale / DELAY
        moment = min(given - kept, given / SPARE) / BETWEEN_MESHES
        if moment <= 0.0:
            return True
    # The softest strip is usually lost, and early.  A solve that fails confirms nothing; another strip may.
    for strip in reversed(asked.strips):
        found, _ = attempted(partial(_assessed, asked, strip, path, moment))
        if found is not None and not found.stable:
            return True
    off = [_assessed(asked, strip, path, given).shape_error / strip.gravity_length for strip in asked.strips]
    return max(off) > ACCURATE


def facts(d: xr.Dataset) -> Facts:
    path, none = d.path.values, d.path.values == REFUSED
    safe = d.safe.values[np.isfinite(d.safe.values)]
    kinds = [name for name in np.unique(path) if name not in (REFUSED, FAILED)]
    return {
        "cases": len(path),
        "failed": (path == FAILED).sum(),
        "planned": safe.size,
        "kinds": ", ".join(f"{(path == name).sum()} {name}" for name in kinds),
        "safe": share(safe == 1.0),
        "none": none.sum(),
        "unconfirmed": (none & (d.confirmed.values != 1.0)).sum(),
        "seconds": d.seconds.median(),
        "longest": d.seconds.max(),
        "speed_seconds": d.speed_seconds.median(),
        "speed_longest": d.speed_seconds.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("plan_safe", "safe", "1", "= 1, none failed",
            "share of the {planned} planned paths ({kinds}) for {cases} random strips that the rod on finer elements "
            "follows with the least, the given and the largest eta_b: the planner's own solver on another mesh, "
            "consistency and no proof by other means", lambda f: f.failed == 0, digits=4),
        Number("plan_none", "none", "count", "each confirmed",
            "strips for which there is no path; where a scan or the same solver does not confirm why the triangular "
            "path or the R-path is refused: {unconfirmed}", lambda f: f.unconfirmed == 0, spread=1.0),
        Number("plan_seconds", "seconds", "s", "<= 1 s, the longest <= 5 s",
            "median time of a plan or a refusal, one core, warm process; the longest {longest:.2g} s",
            lambda f: f.longest <= 5.0),
        Number("plan_speed_seconds", "speed_seconds", "s", "<= 1 s, the longest <= 5 s",
            "the same with `--speed`, 0.03 to 0.3 m/s; the longest {speed_longest:.2g} s",
            lambda f: f.speed_longest <= 5.0),
    ),
}
# fmt: on

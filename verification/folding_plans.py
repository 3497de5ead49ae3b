"""Plans for random strips whose eta_b is uncertain: are the paths safe, are the refusals right, what do they cost.

A plan's rod is assessed once more on finer elements, with the least, the given and the largest eta_b.  Where the
plan says that there is none, each reason is checked without the planner: a scan of heights has no low path, a scan of
critical points is nearer to the triangular path than the margin, and a strip is lost on the R-path with the friction
that there is, less what is to spare.  Source: docs/plan.md.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache, partial
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr

from stripfold import elastica, paths
from stripfold.ask.assess import PathAssessment, assess
from stripfold.ask.friction import SPARE
from stripfold.ask.inputs import PathInputs, PlanInputs, Strip
from stripfold.ask.plan import DELAY, FREE, GIVING, LEAST_BUMP, PUSH, SHARPEST, choose
from stripfold.ask.planned_motion import ACCURATE
from stripfold.base.arrays import Array
from stripfold.base.errors import NoPathError, SolveError
from stripfold.follow.memory import STEP
from stripfold.follow.track import BUMP
from stripfold.paths import FoldPath
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, share

UNITS = {"s": "seconds speed_seconds still_seconds"}

LENGTH, ETA_B, MARGIN = (8.5, 30.0), (820.0, 30200.0), (0.1, 0.6)
"""What is drawn: strip length, L*, evenly; eta_b, m^-4 s^2, evenly in its logarithm; margin, L*, evenly."""
SLIDES, HAS_FRICTION = 0.5, 0.08
"""Shares of strips whose layers may slide, and of those with a friction moment known."""
MOMENT, YIELD = (0.005, 0.3), (0.05, 0.5)
"""M_0, rho_a g L*^2, evenly in its logarithm, and kappa_y, 1/L*."""
UNCERTAINTY = 0.2
TIMED = 60
"""Cases that are planned once more, with and without a speed, to time it."""
TIMED_FRICTION, SPEED = 0.5, (0.03, 0.3)
"""Share of these with a friction moment known where layers must not slide, and their speed, m/s, by its logarithm."""
REFINEMENT = 0.5
"""Factor on the elements' lengths and on the steps with friction of the second assessment."""
BETWEEN_MESHES = 1.15
"""Ratio by which the friction that a strip needs may differ between meshes and steps."""
REFUSED, FAILED = "none", "failed"
SCANNED = 40
"""Heights that are scanned for a low path."""
SPACING = 0.05
"""Of the heights of critical points scanned, L*."""


def case(number: int, seed: int, has_friction: float = HAS_FRICTION) -> PlanInputs:
    """A random strip, the same for the same numbers; ``has_friction``: share of those with a friction moment known."""
    random = np.random.default_rng([seed, number])
    eta_b = float(np.exp(random.uniform(*np.log(ETA_B))))
    unit = Strip(length=1.0, eta_b=eta_b).gravity_length
    length, margin = unit * random.uniform(*LENGTH), unit * random.uniform(*MARGIN)
    slides, has = random.uniform(size=2) < (SLIDES, has_friction)
    asked = {"length": length, "eta_b": eta_b, "margin": margin, "eta_b_uncertainty": UNCERTAINTY}
    moment, kappa_y = np.exp(random.uniform(*np.log(MOMENT))), random.uniform(*YIELD)
    if has and not slides:
        material = Strip(length=length, eta_b=eta_b).material
        friction = {"friction_moment": moment * material.force_scale * unit, "yield_curvature": kappa_y / unit}
        asked |= {name: float(value) for name, value in friction.items()}
    return PlanInputs(**asked, layers_may_slide=bool(slides))


def run(cases: int = 12, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Plan for the first random strips of the sequence that ``seed`` starts, and check each.

    Dataset over ``case``: the path, "none" or "failed"; ``safe``: whether it is stable on finer elements with all three
    eta_b, nan where there is none; ``confirmed``: whether all reasons against a path are confirmed, nan where there is
    one; what the plan cost; reasons and messages.  Of the first :data:`TIMED` cases also what a plan costs with and
    without a speed, where more of them have friction, and whether its R-path was refused for too little of it.
    """
    rows = pooled(partial(numbered, seed=seed), range(cases), threads, progress)
    return table("case", rows, {"seed": seed}, units=UNITS)


def numbered(number: int, seed: int) -> dict[str, Any]:
    """The case of this number."""
    asked = case(number, seed)
    began = perf_counter()
    unit = asked.gravity_length
    row: dict[str, Any] = {"case": number, "length": asked.length / unit, "asked_margin": asked.margin / unit}
    row |= {"slides": float(asked.layers_may_slide), "moment": 0.0, "safe": np.nan, "confirmed": np.nan}
    if asked.friction_moment is not None:
        row["moment"] = asked.friction_moment / (asked.material.force_scale * unit)
    found, message = attempted(lambda: _chosen(asked))
    row["seconds"] = perf_counter() - began
    row |= times(number, seed)
    row |= {"path": FAILED, "margin": np.nan, "reason": "", "message": message}
    if isinstance(found, NoPathError):
        wrong, message = attempted(lambda: unconfirmed(asked, found))
        confirmed = wrong == () and not message
        message = message or ", ".join(wrong or ())
        return row | {"path": REFUSED, "reason": str(found), "confirmed": float(confirmed), "message": message}
    if found is not None:
        bad, message = attempted(lambda: unsafe(asked, found.path, found.sufficient_moment is not None))
        row |= {"path": found.path.name, "margin": found.margin / unit, "reason": found.reason}
        return row | {"safe": float(bad == "" and not message), "message": message or bad}
    return row


def times(number: int, seed: int) -> dict[str, float]:
    """What a plan costs with and without a speed; nan but for the first cases."""
    row = dict.fromkeys(("still_seconds", "speed_seconds", "r_path_refused"), np.nan)
    if number >= TIMED:
        return row
    asked = case(number, seed, TIMED_FRICTION)
    speed = float(np.exp(np.random.default_rng([seed, number, TIMED]).uniform(*np.log(SPEED))))
    for name, given in (("still_seconds", None), ("speed_seconds", speed)):
        began = perf_counter()
        found, _ = attempted(partial(_chosen, asked.model_copy(update={"speed": given})))
        row[name] = perf_counter() - began
    refused = getattr(found, "refused", ())
    row["r_path_refused"] = float(asked.friction_moment is not None and any(one.path == "r-path" for one in refused))
    return row


def _chosen(asked: PlanInputs) -> Any:
    try:
        return choose(asked)
    except NoPathError as error:
        return error


def unsafe(asked: PlanInputs, path: FoldPath, friction: bool) -> str:
    """What is wrong on finer elements with one of the three eta_b; empty if nothing is."""
    moment = asked.friction_moment if friction else None
    lost = [strip.eta_b for strip in asked.strips if not follows(asked, strip, path, moment)]
    return f"lost with eta_b = {lost[0]:.4g}" if lost else ""


def follows(asked: PlanInputs, strip: Strip, path: FoldPath, moment: float | None = None) -> bool:
    """Whether the rod follows a path on finer elements, with this M_0, N."""
    return _verdict(asked, strip, path, moment).stable


def _verdict(asked: PlanInputs, strip: Strip, path: FoldPath, moment: float | None) -> PathAssessment:
    friction: dict[str, Any] = {}
    if moment is not None:
        friction = {"friction_moment": moment, "step": STEP * REFINEMENT * strip.gravity_length}
    inputs, kappa_y = PathInputs(**strip.model_dump(), model="rod", **friction), asked.yield_curvature
    return assess(inputs, path, yield_curvature=kappa_y, refinement=REFINEMENT, compare=False)


def unconfirmed(asked: PlanInputs, error: NoPathError) -> tuple[str, ...]:
    """The paths refused whose reasons are not confirmed."""
    checks = {"low": _no_low, "triangular": _no_triangular, "r-path": _no_r_path}
    return tuple(one.path for one in error.refused if not checks[one.path](asked))


def _no_low(asked: PlanInputs) -> bool:
    """Whether layers must not slide, or no height has the margin with the softest strip and bends all gently."""
    if not asked.layers_may_slide:
        return True
    stiffest, given, softest = (strip.gravity_length for strip in asked.strips)
    thickness, lies = asked.strips[0].material.thickness, asked.length + FREE * stiffest
    heights = given * np.linspace(0.3, 2.0, SCANNED)
    snaps = np.array([elastica.critical(float(height / softest)).snap for height in heights])
    margin = heights[snaps][0] - heights
    bent = (thickness <= SHARPEST * heights) & (heights**3 >= GIVING * lies * thickness**2)
    smooth = BUMP * heights**4 >= LEAST_BUMP * PUSH**2 * stiffest**3
    return not np.any((margin >= asked.margin + heights[1] - heights[0]) & bent & smooth)


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
    # The softest strip is usually lost, and early.
    for strip in reversed(asked.strips):
        # A solve that fails confirms nothing; another strip may.
        with suppress(SolveError):
            if not follows(asked, strip, path, moment):
                return True
    off = [_verdict(asked, strip, path, given).shape_error / strip.gravity_length for strip in asked.strips]
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
        "paths": len(kinds),
        "safe": share(safe == 1.0),
        "none": none.sum(),
        "unconfirmed": (none & (d.confirmed.values != 1.0)).sum(),
        "seconds": np.median(d.seconds.values),
        "longest": d.seconds.values.max(),
        "timed": np.isfinite(d.speed_seconds).sum(),
        "r_paths_refused": np.nansum(d.r_path_refused),
        "still_seconds": np.nanmedian(d.still_seconds),
        "still_longest": np.nanmax(d.still_seconds),
        "speed_seconds": np.nanmedian(d.speed_seconds),
        "speed_longest": np.nanmax(d.speed_seconds),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("plan_safe", "safe", "1", "= 1",
            "share of the {planned} planned paths that the rod on finer elements follows with the least, the given and "
            "the largest eta_b: the planner's own solver on another mesh, consistency and no proof by other means",
            digits=4),
        Number("plan_none", "none", "count", "a scan confirms all reasons of each",
            "strips for which there is no path; reasons that a scan by the same solver does not confirm: {unconfirmed}",
            lambda f: f.unconfirmed == 0),
        Number("plan_seconds", "seconds", "s", "<= 2 s",
            "median time of a plan or a refusal, one core, warm process; the longest {longest:.2g} s"),
        Number("plan_still_seconds", "still_seconds", "s", "<= 1 s, the longest <= 5 s",
            "the same of {timed:.0f} strips, of half of which without sliding layers a friction moment is known "
            "({r_paths_refused:.0f} R-paths refused although); the longest {still_longest:.2g} s",
            lambda f: f.still_longest <= 5.0),
        Number("plan_speed_seconds", "speed_seconds", "s", "<= 1 s, the longest <= 5 s",
            "the same with `--speed`, 0.03 to 0.3 m/s; the longest {speed_longest:.2g} s",
            lambda f: f.speed_longest <= 5.0),
    ),
}
# fmt: on

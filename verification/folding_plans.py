"""Plans for random strips whose eta_b is uncertain: what comes of the paths, how sure that is, and what it costs.

Each strip has a true eta_b, a true friction between its layers and a gripper that is a little off, drawn from what the
planner is told.  A chain of point masses that shares no code with it follows the chosen path in time, with stretch, a
floor that rubs and free lift-off; its fold is compared with what the plan states.  And what comes of each path of a
strip that is known, over its length: how far it snaps, and how far its fold is off with friction between the layers.
Source: docs/plan.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import ceil
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, Look
from stripfold.ask.inputs import PlanInputs, Release, Strip
from stripfold.ask.outcome import NORMAL_95, Outcome, outcome_of
from stripfold.ask.plan import candidates, choose
from stripfold.base.arrays import Array
from stripfold.draw.colours import GREEN
from stripfold.draw.style import figure, styled
from stripfold.paths.motion import timed
from stripfold.paths.rpath import half_fold
from verification.chain import Chain
from verification.common import Progress, attempted, dataset, grid, pooled, table
from verification.numbers import Facts, Number

UNITS = {"s": "seconds", "m": "median most error paper"}

LENGTH, ETA_B, SPEED = (8.5, 30.0), (820.0, 30200.0), (0.05, 0.15)
"""What is drawn: strip length, L*, evenly; eta_b, m^-4 s^2, and the gripper's speed, m/s, by their logarithms."""
UNCERTAINTY, ACCURACY, FRICTION = 0.2, 1e-3, 0.5
"""What the planner is told: of eta_b, relative; of the gripper, m; and the largest friction between the layers."""
PAPER = ("triangular", "circular", "r-path")
SHOWN = {"low": ("low path", Look(GREEN, "s")), **PATH_LOOKS}
"""Paths of the figure."""
KNOWN = ("drop", "energy", "off")
ETA, UNIT, THICKNESS = 3770.0, Strip(length=1.0, eta_b=3770.0).gravity_length, 0.05
"""eta_b, m^-4 s^2, L*, m, and thickness, L*, of the strips in it."""
SPACING, LEAST = 0.06, 0.04
"""Of the chain's nodes, L*; and the least thickness of which it has the stretch, L*."""
REST = 50.0
"""Duration for which the gripper stands at the end, sqrt(L*/g)."""


def case(number: int, seed: int) -> PlanInputs:
    """A random strip, the same for the same numbers."""
    random = np.random.default_rng([seed, number])
    eta_b, speed = (float(np.exp(random.uniform(*np.log(of)))) for of in (ETA_B, SPEED))
    unit = Strip(length=1.0, eta_b=eta_b).gravity_length
    return PlanInputs(
        length=unit * random.uniform(*LENGTH),
        eta_b=eta_b,
        eta_b_uncertainty=UNCERTAINTY,
        gripper_accuracy=ACCURACY,
        layer_friction=FRICTION,
        speed=speed,
    )


def run(
    cases: int = 2,
    followed: int = 1,
    lengths: Sequence[float] = (9.0, 16.0),
    seed: int = 1,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Plan for the first random strips of the sequence that ``seed`` starts; the first ``followed`` by the chain, too.

    Dataset over ``case``: the chosen path, "failed" where there is none; ``median`` and 95 % quantile, ``most``, of the
    error of its fold; the least such quantile of the paper's three paths, ``paper``; the chain's ``error``, nan of
    those that are not followed; whether the best one snaps; seconds of the plan; messages.  Over ``shown`` and
    ``length``: :func:`known`.
    """
    rows = pooled(partial(numbered, seed=seed, followed=followed), range(cases), threads, progress)
    values = grid(known, KNOWN, {"shown": list(SHOWN), "length": lengths}, threads, progress)
    of = table("case", rows, {"seed": seed}, units=UNITS)
    return of.merge(dataset(values, {}))


def known(path: str, length: float) -> dict[str, float]:
    """Drop, L*, energy, rho_a g L*^2, and error of the fold with friction, L*, of a strip of 0.05 L* thickness."""
    strip = Strip(length=length * UNIT, eta_b=ETA, eta_m=ETA * (THICKNESS * UNIT) ** 2 / 12.0)
    exact: dict[str, Any] = {"eta_b_uncertainty": 0.0, "gripper_accuracy": 0.0, "layer_friction": FRICTION}
    asked = PlanInputs(**strip.model_dump(), **exact)
    candidate = next(one for one in candidates(asked) if one.name == path)
    found = outcome_of(asked, candidate, asked.strips, lambda line: None)
    energy = found.energy / asked.material.scales["J m-1"]
    return {"drop": found.drop / UNIT, "energy": energy, "off": found.error[1] / UNIT}


def numbered(number: int, seed: int, followed: int) -> dict[str, Any]:
    """The case of this number."""
    asked = case(number, seed)
    row: dict[str, Any] = {"case": number, "path": "failed", "snaps": 0.0}
    row |= dict.fromkeys(("median", "most", "paper", "error"), np.nan)
    began = perf_counter()
    found, message = attempted(lambda: choose(asked.model_copy(update={"speed": None}))[0])
    row |= {"seconds": perf_counter() - began, "message": message}
    if found is None:
        return row
    best = found[0]
    row |= {"path": best.name, "median": best.error[0], "most": best.error[1], "snaps": float(best.drop != 0.0)}
    row["paper"] = min(outcome.error[1] for outcome in found if outcome.name in PAPER)
    if number < followed:
        row["error"] = by_chain(asked, best, np.random.default_rng([seed, number, 1]))
    return row


def by_chain(asked: PlanInputs, best: Outcome, random: np.random.Generator) -> float:
    """The error of the fold of a chain with a true strip and gripper, m."""
    eta_b = asked.eta_b * random.uniform(1.0 - UNCERTAINTY, 1.0 + UNCERTAINTY)
    off, mu = random.normal(0.0, ACCURACY / NORMAL_95), random.uniform(0.0, FRICTION)
    strip = Strip(length=asked.length, eta_b=eta_b)
    unit, second = strip.gravity_length, strip.material.scales["s"]
    travelled, places = best.path.curve.sampled(best.path.spacing)
    motion = timed(travelled, places, asked.gripper_speed, asked.acceleration)
    chain = Chain.of(strip.length_star, max(strip.material.relative_thickness, LEAST), SPACING)
    t = np.arange(0.0, motion.t[-1] / second, chain.step) * second
    # Between the planned times the speed is linear.
    at = np.array([motion.lam(float(time)) for time in t[::50]])
    s = np.interp(t, t[::50], at)
    way = np.column_stack([np.interp(s, travelled, of) for of in places.T]) / unit
    # A gripper that is off has grasped the strip where it should.
    way[:, 0] += off / unit * np.minimum(s / unit, 1.0)
    way[:, 1] = np.maximum(way[:, 1], 0.0)
    still = np.tile(way[-1], (ceil(REST / chain.step), 1))
    state, drag = chain.flat(), Release().air * second
    for part in (way, still):
        chain.follow(state, part, drag, mu=mu)
    folded: Array = half_fold(strip.length_star).folded.at(chain.arc)
    return unit * float(np.linalg.norm(state[:2].T - folded, axis=1).max())


def facts(d: xr.Dataset) -> Facts:
    path, done = d.path.values, d.path.values != "failed"
    followed = np.isfinite(d.error.values)
    inside = d.error <= d.most
    gain = (d.paper - d.most).values[done]
    return {
        "cases": len(path),
        "failed": (~done).sum(),
        "kinds": ", ".join(f"{(path == name).sum()} {name}" for name in np.unique(path[done])),
        "snap": d.snaps.sum(),
        "followed": followed.sum(),
        "covered": inside.values[followed].mean() if followed.any() else np.nan,
        "above": (d.error < d["median"]).values[followed].mean() if followed.any() else np.nan,
        "largest": d.error.max(),
        "worse": (gain < -ACCURACY).sum(),
        "gain": 1e3 * np.median(gain[np.isfinite(gain)]),
        "seconds": d.seconds.median(),
        "longest": d.seconds.max(),
        "seed": d.attrs["seed"],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("plan_refused", "failed", "count", "= 0",
            "of {cases} random strips of 8.5 to 30 L\\* (seed {seed}) those for which there is no ranked table of "
            "paths; chosen were {kinds}, of which {snap:.0f} snap"),
        Number("plan_coverage", "covered", "1", "0.93 to 0.97",
            "share of {followed} chosen paths on which the fold of an explicit chain of masses, with eta_b, friction "
            "and gripper drawn from what the planner was told, is off by at most what the planner says that 95 % are; "
            "below its median {above:.2f}; the largest error {largest:.2g} m",
            lambda f: 0.93 <= f.covered <= 0.97, spread=0.1),
        Number("plan_gain", "gain", "mm", "none worse",
            "median by which that bound lies below the best of the paper's three paths; by more "
            "than the gripper's accuracy above it: {worse}", lambda f: f.worse == 0, spread=1.0),
        Number("plan_seconds", "seconds", "s", "<= 3 s, the longest <= 10 s",
            "median time of a plan with its table, one core, warm process; the longest {longest:.2g} s",
            lambda f: f.seconds <= 3.0 and f.longest <= 10.0),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) how far strips snap on each path, over their length, and (b) how far their folds are off."""
    fig = figure(2.8)
    axes = fig.subplots(1, 2)
    for path, (label, how) in SHOWN.items():
        of = data.sel(shown=path)
        for ax, name in zip(axes, ("drop", "off"), strict=True):
            ax.plot(of["length"], of[name], color=how.color, marker=how.marker, ms=3, label=label)
    axes[0].set(ylabel="height of the snap$\\,/\\,L^*$", title="(a)")
    axes[1].set(ylabel="fold off by$\\,/\\,L^*$", title="(b)", yscale="log")
    for ax in axes:
        ax.set_xlabel("length of the strip$\\,/\\,L^*$")
    fig.legend(*axes[0].get_legend_handles_labels(), fontsize=7, loc="outside upper center", ncols=4)
    return fig

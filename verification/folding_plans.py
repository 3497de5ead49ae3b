"""Plans for random strips whose eta_b is uncertain: what comes of the paths, how sure that is, and what it costs.

Each strip has a true eta_b, a true friction between its layers and a gripper that is a little off, drawn from what the
planner is told.  A chain of point masses that shares no code with it follows the chosen path in time, with stretch, a
floor that rubs and free lift-off, and for some MuJoCo, a public engine; their folds are compared with what the plan
states.  So are those of cloth, the hinges of whose chain slide.  And what comes of each path of a strip that is known,
over its length: how far it snaps, and how far its fold is off with friction between the layers.
Source: docs/plan.md.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from functools import partial
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, Look
from stripfold.ask.inputs import PlanInputs, Release, Strip
from stripfold.ask.outcome import NORMAL_95, Outcome, outcome_of
from stripfold.ask.plan import candidates, choose
from stripfold.base.arrays import Array
from stripfold.base.errors import StripfoldError
from stripfold.draw.colours import BLACK, GREEN, GREY, VERMILLION
from stripfold.draw.style import figure, styled
from stripfold.paths.motion import timed
from stripfold.paths.rpath import half_fold
from verification.chain import Chain
from verification.common import ONE_CORE, Progress, attempted, dataset, grid, pooled, table
from verification.numbers import Facts, Number
from verification.peers import FOLDER

LENGTHS = "median most error engine paper"
UNITS = {"s": "seconds", "m": f"{LENGTHS} cloth_{LENGTHS.replace(' ', ' cloth_')}"}

LENGTH, ETA_B, SPEED = (8.5, 30.0), (820.0, 30200.0), (0.05, 0.15)
"""What is drawn: strip length, L*, evenly; eta_b, m^-4 s^2, and the gripper's speed, m/s, by their logarithms."""
UNCERTAINTY, ACCURACY, FRICTION = 0.2, 1e-3, 0.5
"""What the planner is told: of eta_b, relative; of the gripper, m; and the largest friction between the layers."""
MOMENT, TOLD = (0.2, 1.1), 0.1
"""M_0 of cloth, rho_a g L*^2, drawn by its logarithm, as fabrics have (docs/physics.md, section 10); how well the
planner is told it, relative."""
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
EACH = 0.05
"""Distance of the times at which chain and engine are told the way, sqrt(L*/g)."""
ENGINE_SPACING = 0.12
"""Of MuJoCo's points, L*."""


def case(number: int, seed: int, cloth: bool = False) -> PlanInputs:
    """A random strip, the same for the same numbers; ``cloth``: one with friction in bending."""
    random = np.random.default_rng([seed, number])
    eta_b, speed = (float(np.exp(random.uniform(*np.log(of)))) for of in (ETA_B, SPEED))
    strip = Strip(length=1.0, eta_b=eta_b)
    length = strip.gravity_length * random.uniform(*LENGTH)
    moment = strip.material.scales["N"] * float(np.exp(random.uniform(*np.log(MOMENT))))
    return PlanInputs(
        length=length,
        friction_moment=moment if cloth else None,
        friction_uncertainty=TOLD if cloth else None,
        eta_b=eta_b,
        eta_b_uncertainty=UNCERTAINTY,
        gripper_accuracy=ACCURACY,
        layer_friction=FRICTION,
        speed=speed,
    )


def run(
    cases: int = 2,
    followed: int = 1,
    engine: int = 1,
    cloth: int = 0,
    timed: int = 1,
    lengths: Sequence[float] = (9.0, 16.0),
    seed: int = 1,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Plan for the first random strips of the sequence that ``seed`` starts.

    The first ``followed`` are followed by the chain, too, and the first ``engine`` of these by MuJoCo, where it is
    installed.  ``cloth``: number of strips with friction in bending, all of which are followed by the chain.

    Dataset over ``case``: the chosen path, "failed" where there is none; ``median`` and 95 % quantile, ``most``, of the
    error of its fold; the least such quantile of the paper's three paths, ``paper``; the chain's ``error`` and the
    ``engine``'s, nan of those that are not followed; whether the best one snaps; messages.  Over ``timed`` the seconds
    of the plans of the first, once more and one after the other, since processes beside each other share a core.  Over
    ``cloth`` the same of its strips.  Over ``shown`` and ``length``: :func:`known`.
    """
    rows = pooled(partial(numbered, seed=seed, followed=followed, engine=engine), range(cases), threads, progress)
    rubbed = pooled(partial(numbered, seed=seed, followed=cloth, cloth=True), range(cloth), threads, progress)
    seconds = dataset({"seconds": ("timed", [_seconds(number, seed) for number in range(timed)])}, {}, units=UNITS)
    values = grid(known, KNOWN, {"shown": list(SHOWN), "length": lengths}, threads, progress)
    of = table("case", rows, {"seed": seed}, units=UNITS).merge(seconds)
    if rubbed:
        named = [{"cloth": row.pop("case"), **{f"cloth_{name}": row[name] for name in row}} for row in rubbed]
        of = of.merge(table("cloth", named, units=UNITS))
    return of.merge(dataset(values, {}))


def known(path: str, length: float) -> dict[str, float]:
    """Drop, L*, energy, rho_a g L*^2, and error of the fold with friction, L*, of a strip of 0.05 L* thickness."""
    strip = Strip(length=length * UNIT, eta_b=ETA, eta_m=ETA * (THICKNESS * UNIT) ** 2 / 12.0)
    exact: dict[str, Any] = {"eta_b_uncertainty": 0.0, "gripper_accuracy": 0.0, "layer_friction": FRICTION}
    asked = PlanInputs(**strip.model_dump(), **exact)
    candidate = next(one for one in candidates(asked) if one.name == path)
    found = outcome_of(asked, candidate, asked.strips)
    energy = found.energy / asked.material.scales["J m-1"]
    return {"drop": found.drop / UNIT, "energy": energy, "off": found.error[1] / UNIT}


def numbered(number: int, seed: int, followed: int, engine: int = 0, cloth: bool = False) -> dict[str, Any]:
    """The case of this number."""
    asked = case(number, seed, cloth)
    row: dict[str, Any] = {"case": number, "path": "failed", "snaps": 0.0}
    row |= dict.fromkeys(("median", "most", "paper", "error", "engine"), np.nan)
    found, row["message"] = attempted(lambda: choose(asked.model_copy(update={"speed": None}))[0])
    if found is None:
        return row
    best = found[0]
    row |= {"path": best.name, "median": best.error[0], "most": best.error[1], "snaps": float(best.drop != 0.0)}
    row["paper"] = min(outcome.error[1] for outcome in found if outcome.name in PAPER)
    if number < followed:
        truth = Truth.drawn(asked, best, np.random.default_rng([seed, number, 1]))
        row["error"] = by_chain(truth)
        if number < engine:
            row["engine"] = by_engine(truth)
    return row


def _seconds(number: int, seed: int) -> float:
    """Time of a plan with its table; nan where there is none."""
    asked, began = case(number, seed).model_copy(update={"speed": None}), perf_counter()
    found, _ = attempted(lambda: choose(asked))
    return np.nan if found is None else perf_counter() - began


class Truth(NamedTuple):
    """A true strip, its friction with the floor and in bending, rho_a g L*^2, and its gripper's way: places, L*, at
    times, sqrt(L*/g)."""

    strip: Strip
    mu: float
    moment: float
    t: Array
    way: Array

    @classmethod
    def drawn(cls, asked: PlanInputs, best: Outcome, random: np.random.Generator) -> Truth:
        """One of those that the planner was told of, on the path that it chose."""
        eta_b = asked.eta_b * random.uniform(1.0 - UNCERTAINTY, 1.0 + UNCERTAINTY)
        off, mu = random.normal(0.0, ACCURACY / NORMAL_95), random.uniform(0.0, FRICTION)
        strip = Strip(length=asked.length, eta_b=eta_b)
        moment = (asked.friction_moment or 0.0) * random.uniform(1.0 - TOLD, 1.0 + TOLD) / strip.material.scales["N"]
        unit, second = strip.gravity_length, strip.material.scales["s"]
        travelled, places = best.path.curve.sampled(best.path.spacing)
        motion = timed(travelled, places, asked.gripper_speed, asked.acceleration)
        t = np.append(np.arange(0.0, motion.t[-1], EACH * second), motion.t[-1])
        s = np.array([motion.lam(float(time)) for time in t])
        way = np.column_stack([np.interp(s, travelled, of) for of in places.T]) / unit
        # A gripper that is off has grasped the strip where it should.
        way[:, 0] += off / unit * np.minimum(s / unit, 1.0)
        way[:, 1] = np.maximum(way[:, 1], 0.0)
        return cls(strip, mu, moment, t / second, way)

    @property
    def drag(self) -> float:
        """Of air on a fall, per mass, sqrt(g/L*)."""
        return Release().air * self.strip.material.scales["s"]

    def off(self, places: Array) -> float:
        """Error of a fold, m; ``places``: of points at equal distances, L*, shape (n, 2)."""
        length = self.strip.length_star
        folded = half_fold(length).folded.at(np.linspace(0.0, length, len(places)))
        return self.strip.gravity_length * float(np.linalg.norm(places - folded, axis=1).max())


def by_chain(truth: Truth) -> float:
    """The error of the fold of a chain of point masses, m."""
    strip = truth.strip
    chain = Chain.of(strip.length_star, max(strip.material.relative_thickness, LEAST), SPACING, truth.moment)
    t = np.arange(0.0, truth.t[-1] + REST, chain.step)
    way, state = np.column_stack([np.interp(t, truth.t, of) for of in truth.way.T]), chain.flat()
    chain.follow(state, way, truth.drag, mu=truth.mu)
    return truth.off(state[:2].T)


def by_engine(truth: Truth) -> float:
    """The error of the fold of MuJoCo's rod, m; nan where it is not installed."""
    python = FOLDER / ".venv" / "bin" / "python"
    if not python.exists():
        return float("nan")
    case = {"length": truth.strip.length_star, "spacing": ENGINE_SPACING, "mu": truth.mu, "drag": truth.drag}
    scene = json.dumps(case | {"t": truth.t.tolist(), "way": truth.way.tolist()})
    done = subprocess.run(
        [python, FOLDER / "mujoco_fold.py"], input=scene, capture_output=True, text=True, env=os.environ | ONE_CORE
    )
    if done.returncode:
        raise StripfoldError(f"MuJoCo ended with an error: {done.stderr[-300:]}")
    return truth.off(np.array(json.loads(done.stdout)))


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


def of_engine(d: xr.Dataset) -> list[Facts]:
    """None where it is not installed."""
    known = np.isfinite(d.engine.values)
    apart = np.abs(d.engine - d.error).values[known]
    if not known.any():
        return []
    inside = int((d.engine <= d.most).values[known].sum())
    differ = {"apart": 1e3 * np.median(apart), "farthest": 1e3 * apart.max(), "largest": 1e3 * d.engine.max()}
    return [{"inside": inside, "count": known.sum(), "least": int(np.floor(0.85 * known.sum())), **differ}]


def of_folded(d: xr.Dataset) -> list[Facts]:
    """None where no cloth was folded."""
    if "cloth" not in d.dims:
        return []
    error, path = d.cloth_error.values, d.cloth_path.values
    known = np.isfinite(error)
    apart = np.abs(error - d.cloth_median.values)[known]
    return [
        {
            "folded": known.sum(),
            "count": len(path),
            "inside": (error <= d.cloth_most.values)[known].mean(),
            "kinds": ", ".join(f"{(path == name).sum()} {name}" for name in np.unique(path)),
            "usual": 1e3 * np.median(error[known]),
            "apart": 1e3 * np.median(apart),
            "seed": d.attrs["seed"],
        }
    ]


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
            "median time of a plan with its table, {d.sizes[timed]} in one warm process with nothing beside it; "
            "the longest {longest:.2g} s",
            lambda f: f.seconds <= 3.0 and f.longest <= 10.0),
    ),
    of_folded: (
        Number("plan_coverage_cloth", "inside", "1", ">= 0.93, all of them folded",
            "the same share of {folded} of {count} strips of cloth, M_0 of 0.2 to 1.1 rho_a g L*^2, told within 10 %, "
            "with hinges that slide (seed {seed}); chosen were {kinds}; the folds are off by {usual:.2g} mm in the "
            "median, which is {apart:.2g} mm from the plan's median",
            lambda f: f.inside >= 0.93 and f.folded == f.count, spread=0.1),
    ),
    of_engine: (
        Number("plan_engine", "inside", "count", ">= {least} of {count}",
            "of {count} of these folds those that are off by at most as much by MuJoCo, a public engine; its errors "
            "differ from the chain's by {apart:.2g} mm in the median and by at most {farthest:.2g} mm, the largest is "
            "{largest:.2g} mm", lambda f: f.inside >= f.least),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) how far strips snap on each path, over their length, (b) how far their folds are off, and (c) the errors
    of random strips by the chain and the engine below what the plan states."""
    fig = figure(5.0)
    axes = list(fig.subplot_mosaic([["a", "b"], ["c", "c"]]).values())
    for path, (label, how) in SHOWN.items():
        of = data.sel(shown=path)
        for ax, name in zip(axes, ("drop", "off"), strict=False):
            ax.plot(of["length"], of[name], color=how.color, marker=how.marker, ms=3, label=label)
    axes[0].set(ylabel="height of the snap$\\,/\\,L^*$", title="(a)")
    axes[1].set(ylabel="fold off by$\\,/\\,L^*$", title="(b)", yscale="log")
    for ax in axes[:2]:
        ax.set_xlabel("length of the strip$\\,/\\,L^*$")
    both = data.isel(case=np.flatnonzero(np.isfinite(data.error.values))[:20])
    number = np.arange(both.sizes["case"])
    axes[2].vlines(number, 1e3 * both["median"], 1e3 * both["most"], color=GREY, lw=3, label="plan: median to 95 %")
    axes[2].plot(number, 1e3 * both["error"], "o", color=BLACK, ms=3, label="chain of masses")
    axes[2].plot(number, 1e3 * both["engine"], "x", color=VERMILLION, ms=4, label="MuJoCo")
    axes[2].set(xlabel="random strip", ylabel="fold off by [mm]", title="(c)", ylim=(0.0, None))
    handles = [handle for ax in axes[::2] for handle in ax.get_legend_handles_labels()[0]]
    fig.legend(handles=handles, fontsize=7, loc="outside upper center", ncols=3)
    return fig

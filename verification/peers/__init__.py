"""Other programs on the same strip: time against error for one equilibrium and, where they can, one critical point.

Each runs in a process and an environment of its own (in this folder).  If one has no answer, the reason is stored.
Errors are against this package's converged solution of the model that the program solves: the solid, the rod or the
elastica.  All in L*.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots import models
from plots.pieces import Look, note
from stripfold import elastica
from stripfold.ask.critical import ELASTICA_ERROR
from stripfold.base.errors import StripfoldError
from stripfold.draw.colours import BLACK, GREY, ORANGE, PINK, SKY
from stripfold.draw.style import figure, legend_above, styled
from verification.common import ONE_CORE, Progress, blank, dataset, markdown_table, timed
from verification.numbers import Facts, Number
from verification.peers import ours as peers_ours

UNITS = {"s": "seconds time"}

Settings = list[dict[str, Any]]

EQUILIBRIUM, CRITICAL = "equilibrium", "critical"
QUESTIONS = (EQUILIBRIUM, CRITICAL)
TOLERANCES = (1e-2, 1e-3, 1e-4)
"""Errors at which times are given, L*."""
COUNTERPARTS = {"felupe": "solid", "mujoco": "rod", "pyelastica": "rod", "auto": "elastica"}
"""The one of our models with whose time a program's is compared."""
TITLES = {"felupe": "felupe", "mujoco": "MuJoCo", "pyelastica": "PyElastica", "auto": "AUTO-07p"}
"""How the programs write themselves."""
RATIO_TOLERANCE = 1e-3
"""Error at which times are compared, L*."""
REFERENCE = {"elastica": 1.0, "solid": 0.25, "rod": 0.125}
"""Refinement of the reference solution of each model."""
OURS: dict[str, dict[str, tuple[float, ...]]] = {
    "solid": dict.fromkeys(QUESTIONS, (2.0, 1.4, 1.0, 0.5)),
    "rod": dict.fromkeys(QUESTIONS, (2.0, 1.4, 1.0, 0.5)),
    "elastica": dict.fromkeys(QUESTIONS, (1.0,)),
}
"""Refinements of our own runs; the elastica has one accuracy only."""
FLAT = " from flat"
"""End of the names of our runs that start from the flat strip, as the programs do, not from the elastica's state."""
OURS |= {f"{model}{FLAT}": dict.fromkeys(QUESTIONS, (2.0, 1.4, 1.0, 0.5)) for model in ("solid", "rod")}
AUTO = {EQUILIBRIUM: (2, 3, 5, 10, 20, 40), CRITICAL: (2, 3, 5, 10, 20, 40)}
"""Mesh intervals."""
NO_FOLDS = "solves at given displacements: it follows no branch round a fold and locates none"
NO_STATICS = "moves in time: the strip falls somewhat behind the fold, the later the faster the gripper and the damping"
PEERS: Mapping[str, dict[str, Any]] = {
    "felupe": {"model": "solid", EQUILIBRIUM: [{"elements": n} for n in (20, 40, 80, 120, 160)], CRITICAL: NO_FOLDS},
    "mujoco": {
        "model": "elastica",
        EQUILIBRIUM: [
            {"elements": 60, "moving": 40, "steps": [0.2]},
            {"elements": 110, "moving": 40, "steps": [0.2]},
            {"elements": 220, "moving": 40, "steps": [0.2, 0.05]},
            *({"elements": n, "moving": 40, "steps": [0.2, 0.05, 0.02]} for n in (330, 480)),
        ],
        CRITICAL: NO_STATICS,
    },
    "pyelastica": {
        # Its law weakens a stretched rod: only a thin one becomes the elastica (docs/peers.md).
        "model": "elastica",
        EQUILIBRIUM: [
            {"elements": n, "thickness": h}
            for n, h in (([40], 0.05), ([40, 80], 0.05), ([40, 200], 0.03), ([40, 240], 0.02), ([40, 320], 0.015))
        ],
        CRITICAL: NO_STATICS,
    },
    "auto": {
        "model": "elastica",
        **{q: [{"intervals": n, "degree": 4, "largest_step": 0.5} for n in AUTO[q]] for q in QUESTIONS},
    },
}
"""The peers: the model that each solves, and per question its settings, coarse to fine, or why it cannot pose it."""
FOLDER = Path(__file__).parent
"""The programs' scripts and their environment."""
LONGEST = 1800.0
"""Time that one peer may take in all, s."""


def run(
    length_star: float = 12.0,
    thickness: float = 0.05,
    height: float = 3.0,
    advance: float = 8.0,
    repeats: int = 3,
    folder: str | os.PathLike[str] = FOLDER,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Run every program on every question.

    ``length_star``, ``thickness``: of the strip, L*.  ``height``, ``advance``: of the gripper in the equilibrium, L*: z
    and lambda; the critical point is the one at this height.  ``repeats``: counted runs of each setting; of one that
    takes longer than a second there is one.  ``folder``: with the programs' scripts and their environment.  Raises
    StripfoldError: this package itself has no answer.
    """
    say = progress or (lambda _: None)
    scene = {"length": length_star, "thickness": thickness, "height": height, "lam": advance, "repeats": repeats}
    truth = {model: peers_ours.reference(model, scene, refinement) for model, refinement in REFERENCE.items()}
    rows: list[dict[str, Any]] = []
    programs = {
        name: {"model": name.removesuffix(FLAT), "version": "", **dict.fromkeys(QUESTIONS, "")} for name in OURS
    }
    for name in programs:
        say(f"ours: {name}")
        rows += _ours(name, scene, truth)
    for name, how in PEERS.items():
        say(name)
        said, answer = _ask(name, {**scene, "questions": _posed(how), "start": _start(height)}, Path(folder))
        programs[name] = {"model": how["model"], "version": answer["version"], **_reasons(how, said)}
        rows += _judged(name, how["model"], answer["runs"], truth)
    return collected(rows, programs, scene)


def collected(
    rows: list[dict[str, Any]], programs: Mapping[str, Mapping[str, str]], scene: Mapping[str, float]
) -> xr.Dataset:
    """Runs over ``run``, programs over ``program``.

    A run has ``program``, ``question``, ``setting``, ``seconds`` (the median), ``error`` (nan where it failed) and
    ``failed`` (why, or nothing).
    """
    names, tolerances = list(programs), np.array(TOLERANCES)
    times = blank(len(names), len(QUESTIONS), len(tolerances))
    for row in rows:
        best = times[names.index(row["program"]), QUESTIONS.index(row["question"])]
        best[row["error"] <= tolerances] = np.fmin(best[row["error"] <= tolerances], row["seconds"])
    columns = {"name": "program", "asked": "question"} | {key: key for key in ("setting", "failed", "seconds", "error")}
    return dataset(
        {
            "program": ("program", names),
            "question": ("question", QUESTIONS),
            "accuracy": ("accuracy", tolerances),
            **{name: ("run", [row[key] for row in rows]) for name, key in columns.items()},
            "time": (("program", "question", "accuracy"), times),
            "model": ("program", [p["model"] for p in programs.values()]),
            "version": ("program", [p["version"] for p in programs.values()]),
            "reason": (("program", "question"), [[p[q] for q in QUESTIONS] for p in programs.values()]),
        },
        {key: float(value) for key, value in scene.items()},
        units=UNITS,
    )


def _ours(name: str, scene: Mapping[str, Any], truth: Mapping[str, Any]) -> list[dict[str, Any]]:
    model, flat, runs = name.removesuffix(FLAT), name.endswith(FLAT), []
    for question, refinements in OURS[name].items():
        answer = {EQUILIBRIUM: peers_ours.equilibrium, CRITICAL: peers_ours.critical}[question]
        for refinement in refinements:
            seconds, found = timed(partial(answer, model, scene, refinement, flat), scene["repeats"], process_time)
            setting = {} if model == "elastica" else {"refinement": refinement}
            runs.append({"question": question, "setting": setting, "seconds": seconds, **found})
    rows = _judged(name, model, runs, truth)
    if model == "elastica":
        # It is the reference: its error is the one that its tests verify.
        rows = [{**row, "error": ELASTICA_ERROR} for row in rows]
    return rows


def _judged(name: str, model: str, runs: list[dict[str, Any]], truth: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of :func:`collected` from what a program answered."""
    line, lambda_c = truth[model]
    rows = []
    for one in runs:
        if "failed" in one:
            error = np.nan
        elif one["question"] == EQUILIBRIUM:
            apart = np.asarray(one["place"]) - line(np.asarray(one["s"]))
            error = float(np.linalg.norm(apart, axis=1).max())
        else:
            error = abs(one["lambda_c"] - lambda_c)
        rows.append(
            {
                "program": name,
                "question": one["question"],
                "setting": ", ".join(f"{key} {value}" for key, value in one["setting"].items()),
                "seconds": float(np.median(one["seconds"])) if one["seconds"] else np.nan,
                "error": error,
                "failed": one.get("failed", ""),
            }
        )
    return rows


def _posed(how: Mapping[str, Any]) -> dict[str, Settings]:
    return {question: how[question] for question in QUESTIONS if not isinstance(how[question], str)}


def _reasons(how: Mapping[str, Any], said: str) -> dict[str, str]:
    return {question: how[question] if isinstance(how[question], str) else said for question in QUESTIONS}


def _start(height: float) -> dict[str, Any]:
    """The state with no horizontal force, which AUTO is given: lambda, length, forces, height; rows along the arc."""
    state = elastica.state_no_horizontal_force(height)
    t = np.linspace(0.0, 1.0, 201)
    profile = state.at(t * state.length)
    rows = np.stack([t, profile.x, profile.z, profile.theta, profile.curvature, profile.s], axis=1)
    return {"parameters": [state.advance, state.length, state.force_x, state.force_0, height], "rows": rows.tolist()}


def _ask(name: str, scene: dict[str, Any], folder: Path) -> tuple[str, dict[str, Any]]:
    """Why there is no answer, or nothing; and the answer."""
    nothing = {"version": "", "runs": []}
    python = folder / ".venv" / "bin" / "python"
    if not python.exists():
        return "not installed: `make peers` installs it", nothing
    try:
        done = subprocess.run(
            [python, folder / f"{name}_strip.py"],
            input=json.dumps(scene),
            capture_output=True,
            text=True,
            env=os.environ | ONE_CORE,
            timeout=LONGEST,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no answer in {LONGEST:g} s", nothing
    if done.returncode:
        return f"ended with an error: {(done.stderr.strip() or 'without a message').splitlines()[-1]}", nothing
    try:
        return "", json.loads(done.stdout)
    except ValueError as error:
        raise StripfoldError(f"the script of {name} printed no answer: {error}") from error


def fastest(peers: xr.Dataset, name: str, question: str) -> tuple[float, float]:
    """Least time of a program to :data:`RATIO_TOLERANCE`, else that of its most accurate run; and the error reached."""
    seconds = float(peers["time"].sel(program=name, question=question, accuracy=RATIO_TOLERANCE))
    runs = runs_of(peers, name, question)
    if np.isfinite(seconds) or not runs.sizes["run"]:
        return seconds, RATIO_TOLERANCE
    best = runs.isel(run=int(np.argmin(runs["error"].values)))
    return float(best["seconds"]), float(best["error"])


def runs_of(peers: xr.Dataset, name: str, question: str) -> xr.Dataset:
    """The runs of one program on one question that have a solution."""
    which = (peers["name"] == name) & (peers["asked"] == question) & np.isfinite(peers["error"])
    return peers[["seconds", "error", "setting"]].isel(run=np.flatnonzero(which.values))


def table(peers: xr.Dataset) -> str:
    """The page's table: times to each tolerance, or why there are none."""
    tolerances = [f"{tolerance:.0e}".replace("e-0", "e-") for tolerance in peers["accuracy"].values]
    columns = [f"{question}, {tolerance}" for question in QUESTIONS for tolerance in tolerances]
    rows = []
    for name in peers["program"].values:
        one = peers.sel(program=name)
        cells = [TITLES.get(name, f"**{name}**, ours"), str(one["version"].item()) or "this one"]
        cells.append(str(one["model"].item()))
        for question in QUESTIONS:
            times = one["time"].sel(question=question).values
            cells += ["-" if np.isnan(seconds) else f"{seconds:.2g} s" for seconds in times]
        rows.append(cells)
    reasons = [
        f"* {TITLES[name]}, {question}: {reason}."
        for name in TITLES
        for question in QUESTIONS
        if (reason := str(peers["reason"].sel(program=name, question=question).item()))
    ]
    failed = [
        f"* {TITLES.get(str(run['name'].item()), run['name'].item())}, {run['asked'].item()}, {run['setting'].item()}: "
        f"{run['failed'].item()}."
        for run in (peers.isel(run=i) for i in range(peers.sizes["run"]))
        if run["failed"].item()
    ]
    times_to = markdown_table(["program", "version", "model", *columns], rows).rstrip()
    parts = [times_to, "No answer, because it", "\n".join(reasons)]
    parts += ["Runs without a solution:", "\n".join(failed)] if failed else []
    return "\n\n".join(parts) + "\n"


PEER_RATIOS = {"felupe": 10.0, "mujoco": 30.0, "pyelastica": 100.0, "auto": 1.5, "auto_critical": 2.0}
"""Asked of the time of another program over ours, which starts from the elastica's state."""


def facts(d: xr.Dataset) -> list[Facts]:
    """One for every question that both a program and our model beside it answered."""
    out = []
    for question, suffix, task in ((EQUILIBRIUM, "", "one equilibrium"), (CRITICAL, "_critical", "one critical point")):
        starts = [(name, ours, "") for name, ours in COUNTERPARTS.items()]
        starts += [(name, ours + FLAT, "_flat") for name, ours in COUNTERPARTS.items() if ours + FLAT in OURS]
        for name, ours, start in starts:
            (seconds, error), (own, own_error) = (fastest(d, one, question) for one in (name, ours))
            if np.isfinite(seconds / own):
                reached = [e <= RATIO_TOLERANCE for e in (error, own_error)]
                asked = PEER_RATIOS.get(name + suffix + start)
                bound = f">= {asked:g}, and " if asked else ""
                words = {
                    "key": name + suffix + start,
                    "asked": bound,
                    "program": TITLES[name],
                    "task": task,
                    "ours": ours,
                }
                note = "" if reached[0] else f"; it reached {error:.0e} only"
                out.append({**words, "seconds": seconds, "ratio": seconds / own, "note": note, "both": all(reached)})
    return out


# fmt: off
NUMBERS = {
    facts: (
        Number("peer_ratio_{key}", "ratio", "1", "{asked}both reach 0.001 L*",
            "{program}'s time for {task} ({seconds:.2g} s) over that of our {ours}, both to 0.001 L*{note}",
            lambda f: f.both),
    ),
}
# fmt: on


LABELS = {"equilibrium": "error of the centreline $/\\,L^*$", "critical": "error of $\\lambda_c\\,/\\,L^*$"}
PANELS = {"equilibrium": "(a) equilibrium", "critical": "(b) critical point"}
LOOKS = models.LOOKS | {
    "felupe": Look(PINK, "D"), "mujoco": Look(ORANGE, "v"), "pyelastica": Look(SKY, "P"), "auto": Look(BLACK, "X"),
    f"solid{FLAT}": Look(GREY, "s"), f"rod{FLAT}": Look(GREY, "o"),
}  # fmt: skip


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error over the time of every run; ours in bold."""
    fig = figure(5.2)
    axes = fig.subplots(2, 1, sharex=True, sharey=True)
    for ax, question in zip(axes, QUESTIONS, strict=True):
        for name in data["program"].values:
            runs = runs_of(data, name, question).sortby("seconds")
            label, size = (TITLES[name], (1.0, 3.5)) if name in TITLES else (f"ours: {name}", (2.2, 5.0))
            ax.plot(runs["seconds"], runs["error"], lw=size[0], ms=size[1], label=label, **LOOKS[name]._asdict())
        ax.set(xscale="log", yscale="log", ylabel=LABELS[question])
        note(ax, PANELS[question], "upper right")
    axes[-1].set_xlabel("processor time [s]")
    legend_above(fig, axes[0].get_legend_handles_labels()[0], ncols=3, fontsize=7)
    return fig

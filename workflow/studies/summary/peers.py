"""The numbers quoted about other programs on the same strip, and the table of their page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.peers import CRITICAL, EQUILIBRIUM, QUESTIONS
from studies.summary.entry import Entry, entry

OURS = {"felupe": "solid", "mujoco": "rod", "pyelastica": "rod", "auto": "elastica"}
"""Which of our models a peer's time is set against."""
NAMES = {"felupe": "felupe", "mujoco": "MuJoCo", "pyelastica": "PyElastica", "auto": "AUTO-07p"}
"""How the peers write themselves."""
TOLERANCE = 1e-3
"""Error at which the times are compared, L*."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """``peer_ratio_<name>`` for every peer that has an answer, from ``peers``, where there is such a dataset."""
    if "peers" not in data:
        return {}
    peers, out = data["peers"], {}
    for question, suffix in ((EQUILIBRIUM, ""), (CRITICAL, "_critical")):
        for name, ours in OURS.items():
            seconds, reached, error = _time(peers, name, question)
            own, own_reached, _ = _time(peers, ours, question)
            if np.isnan(seconds) or np.isnan(own):
                continue
            holds = reached and own_reached
            what = {EQUILIBRIUM: "one equilibrium", CRITICAL: "one critical point"}[question]
            out[f"peer_ratio_{name}{suffix}"] = entry(
                seconds / own,
                "1",
                f"{NAMES[name]}'s time for {what} ({seconds:.2g} s) over that of our {ours}, both to {TOLERANCE:g} L*"
                + ("" if reached else f"; it reached {error:.0e} only"),
                f"both reach {TOLERANCE:g} L*",
                holds,
                sources["peers"],
                2,
            )
    return out


def _time(peers: xr.Dataset, name: str, question: str) -> tuple[float, bool, float]:
    """Least time to the tolerance, else that of the most accurate run; whether it is reached; that run's error."""
    seconds = float(peers["time"].sel(program=name, question=question, accuracy=TOLERANCE))
    if np.isfinite(seconds):
        return seconds, True, TOLERANCE
    runs = runs_of(peers, name, question)
    if not runs.sizes["run"]:
        return np.nan, False, np.nan
    best = runs.isel(run=int(np.argmin(runs["error"].values)))
    return float(best["seconds"]), False, float(best["error"])


def runs_of(peers: xr.Dataset, name: str, question: str) -> xr.Dataset:
    """The runs of one program on one question that have a solution."""
    which = (peers["name"] == name) & (peers["asked"] == question) & np.isfinite(peers["error"])
    return peers[["seconds", "error", "setting"]].isel(run=np.flatnonzero(which.values))


def table(peers: xr.Dataset) -> str:
    """The page's table: times to each tolerance, or why there are none."""
    tolerances = [f"{tolerance:.0e}".replace("e-0", "e-") for tolerance in peers["accuracy"].values]
    columns = [f"{question}, {tolerance}" for question in QUESTIONS for tolerance in tolerances]
    rows = ["| program | version | model | " + " | ".join(columns) + " |", "|---" * (3 + len(columns)) + "|"]
    for name in peers["program"].values:
        one = peers.sel(program=name)
        cells = [NAMES.get(name, f"**{name}**, ours"), str(one["version"].item()) or "this one"]
        cells.append(str(one["model"].item()))
        for question in QUESTIONS:
            times = one["time"].sel(question=question).values
            cells += ["-" if np.isnan(seconds) else f"{seconds:.2g} s" for seconds in times]
        rows.append("| " + " | ".join(cells) + " |")
    reasons = [
        f"* {NAMES[name]}, {question}: {reason}."
        for name in NAMES
        for question in QUESTIONS
        if (reason := str(peers["reason"].sel(program=name, question=question).item()))
    ]
    failed = [
        f"* {NAMES.get(str(run['name'].item()), run['name'].item())}, {run['asked'].item()}, {run['setting'].item()}: "
        f"{run['failed'].item()}."
        for run in (peers.isel(run=i) for i in range(peers.sizes["run"]))
        if run["failed"].item()
    ]
    parts = ["\n".join(rows), "No answer, because it", "\n".join(reasons)]
    parts += ["Runs without a solution:", "\n".join(failed)] if failed else []
    return "\n\n".join(parts) + "\n"

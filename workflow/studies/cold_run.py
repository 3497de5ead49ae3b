"""Time and memory of a whole run in a fresh clone, by rule of the workflow or section of the checks."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from studies.common import dataset


def of_benchmarks(folder: Path, wall: float, cores: int) -> xr.Dataset:
    """A whole run, over ``rule``, the longest first.

    ``folder``: where each rule has a folder with a table per job; ``wall``: time of the whole run, s; ``cores``: how
    many cores it had.
    """
    rows = {rule.name: [_row(job) for job in sorted(rule.glob("*.tsv"))] for rule in folder.iterdir()}
    names = sorted(rows, key=lambda name: -sum(row["s"] for row in rows[name]))
    seconds = [[row["s"] for row in rows[name]] for name in names]
    values: dict[str, tuple[str, Any]] = {
        "rule": ("rule", names),
        "jobs": ("rule", [float(len(jobs)) for jobs in seconds]),
        "seconds": ("rule", [sum(jobs) for jobs in seconds]),
        "longest": ("rule", [max(jobs) for jobs in seconds]),
        "memory": ("rule", [max(row["max_rss"] for row in rows[name]) for name in names]),
    }
    return dataset("cold_run", values, {"wall": wall, "cores": cores})


def of_sections(printed: str, wall: float, cores: int) -> xr.Dataset:
    """A run of the checks, over ``section``, from the headings ``==== name (seconds so far s) ====`` that it prints."""
    headings = re.findall(r"^==== (.+) \((\d+) s\) ====$", printed, re.M)
    names, begins = zip(*headings, strict=True)
    seconds = np.diff([*map(float, begins), wall])[:-1]
    values = {"section": ("section", names[:-1]), "seconds": ("section", seconds)}
    return dataset("ci_run", values, {"wall": wall, "cores": cores})


def _row(path: Path) -> dict[str, float]:
    with path.open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file, delimiter="\t")
    # A job that was too short to be sampled has no memory.
    return {key: float(row[key]) if row[key] not in ("-", "NA") else 0.0 for key in ("s", "max_rss")}


def table(data: xr.Dataset) -> str:
    """As a table in Markdown."""
    total = float(data["seconds"].sum())
    rows = ["| rule | jobs | s together | share | longest, s | MB |", "|---|---|---|---|---|---|"]
    for name in data["rule"].values:
        one = data.sel(rule=name)
        rows.append(
            f"| {name} | {int(one['jobs'])} | {float(one['seconds']):.3g} | {float(one['seconds']) / total:.0%} | "
            f"{float(one['longest']):.3g} | {float(one['memory']):.0f} |"
        )
    rows.append(f"| all, {data.attrs['cores']} cores | {int(data['jobs'].sum())} | {total:.3g} | | | |")
    rows.append(f"| from start to end | | {data.attrs['wall']:.3g} | | | |")
    return "\n".join(rows) + "\n"

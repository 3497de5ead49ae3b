"""The small run of the whole chain on Slurm against the same run here: are all stored results the same?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from stripfold.files import store
from studies.common import table

MEASURED = ("clocked", "cost", "memory", "seconds", "solving", "wall")
"""In the names of variables that hold how long something took, or how much memory."""
APART = ("benchmarks", "logs", "recordings")
"""Folders of times, of texts, and of films, whose measured results are compared."""


def compare(here: Path, there: Path, wall_here: float, wall_there: float, jobs: int) -> xr.Dataset:
    """Which files of two folders of results hold the same, over ``file``.

    Values are compared bit for bit, with their dimensions and coordinates; run times, memory and attributes are left
    out.

    ``here``, ``there``: the folders, of a run on this machine and of one on Slurm; ``wall_here``, ``wall_there``: time
    of each run, s; ``jobs``: number of jobs that Slurm was given.
    """
    found = {path.relative_to(folder) for folder in (here, there) for path in folder.rglob("*.nc")}
    rows = [
        {"file": str(path), "same": float(_same(here / path, there / path))}
        for path in sorted(found)
        if path.parts[0] not in APART
    ]
    attrs = {"wall_here": wall_here, "wall_there": wall_there, "jobs": jobs}
    return table("slurm_run", "file", rows, attrs)


def _same(one: Path, other: Path) -> bool:
    if not (one.is_file() and other.is_file()):
        return False
    first, second = (untimed(store.read(path)) for path in (one, other))
    if set(first.variables) != set(second.variables):
        return False
    return all(_equal(first[name].variable, second[name].variable) for name in first.variables)


def untimed(data: xr.Dataset) -> xr.Dataset:
    """A dataset without the variables that hold run times and memory."""
    return data.drop_vars([str(name) for name in data.variables if any(word in str(name) for word in MEASURED)])


def _equal(one: xr.Variable, other: xr.Variable) -> bool:
    if one.dims != other.dims or one.shape != other.shape:
        return False
    return bool(np.array_equal(one.values, other.values, equal_nan=one.dtype.kind == "f"))

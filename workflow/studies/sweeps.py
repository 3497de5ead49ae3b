"""Sweeps by the command line on all cores: their rate, cost and memory, and single critical points beside them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from math import isnan
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr

from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.files import store
from studies.common import command, dataset, processor_time, timed_process

LENGTH = 0.6
"""m."""
HEIGHT, ETA_B = (0.03, 0.12), (820.0, 30200.0)
"""m, m^-4 s^2: the strips snap, and at the lowest heights touch first."""


def run(elastica: int, rod: int, checked: int, seed: int, threads: int = 1) -> xr.Dataset:
    """One sweep of each model over ``model``.

    ``elastica``, ``rod``: numbers of heights and of values of eta_b: the square of it is the number of scenes.
    ``checked``, ``seed``: so many random scenes of each are found again one by one.
    """
    rng = np.random.default_rng(seed)
    rows = [_sweep(model, count, checked, rng, threads) for model, count in (("elastica", elastica), ("rod", rod))]
    values = {name: ("model", [row[name] for row in rows]) for name in rows[0]}
    return dataset(
        "sweeps",
        {"model": ("model", ["elastica", "rod"]), **values},
        {"cores": threads, "checked": checked, "seed": seed, "dry_run": _dry_run(elastica)},
    )


def _dry_run(count: int) -> float:
    """Time in which Snakemake plans a job for each chunk of the rod's sweep over the elastica's grid, s."""
    workflow = Path(__file__).parents[1] / "sweep.smk"
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "grid.yaml").write_text(_grid("rod", count), encoding="utf-8")
        began = perf_counter()
        planned = [sys.executable, "-m", "snakemake", "-n", "-s", str(workflow), "--directory", folder]
        subprocess.run(planned, check=True, capture_output=True)
        return perf_counter() - began


def _grid(model: str, count: int) -> str:
    """A grid; JSON is YAML."""
    ranges = (("height", HEIGHT), ("eta_b", ETA_B))
    axes = {key: {"from": low, "to": high, "count": count} for key, (low, high) in ranges}
    return json.dumps({"length": LENGTH, "model": model, **axes})


def _sweep(model: str, count: int, checked: int, rng: np.random.Generator, cores: int) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder:
        grid, file = Path(folder) / "grid.yaml", Path(folder) / "sweep.nc"
        grid.write_text(_grid(model, count), encoding="utf-8")
        before = processor_time()
        (wall,), _, memory = timed_process(command("sweep", str(grid), "--output", str(file), "--cores", str(cores)))
        used = processor_time() - before
        found = store.read(file)
    places = rng.integers(count, size=(checked, 2))
    return {
        "scenes": found.reason.size,
        "results": int(found.free_length.notnull().sum()),
        "snaps": int(found.lambda_c.notnull().sum()),
        "wall": wall,
        "cost": used / found.reason.size,
        "memory": memory,
        "apart": max(_apart(found.isel(gripper_height=i, eta_b=j), model) for i, j in places),
    }


def _apart(found: xr.Dataset, model: str) -> float:
    """Distance in lambda_c or lambda_touch of a scene of a sweep from the scene alone, L*; inf between these two."""
    scene = Scene.of(
        {"length": LENGTH, "height": float(found.gripper_height), "eta_b": float(found.eta_b), "model": model}
    )
    alone = critical.find(scene)
    name = "lambda_c" if alone.snap else "lambda_touch"
    apart = abs(float(found[name]) - getattr(alone, name)) / scene.gravity_length
    return np.inf if isnan(apart) else apart

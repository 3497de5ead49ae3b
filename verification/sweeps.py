"""Sweeps by the command line on all cores: their rate, cost and memory, and single critical points beside them."""

from __future__ import annotations

import json
import tempfile
from math import isnan
from pathlib import Path

import numpy as np
import xarray as xr

from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.files import store
from stripfold.paths import PLANS
from verification.common import command, dataset, processor_time, timed_process
from verification.numbers import Facts, Number

UNITS = {"s": "cost wall", "Mbyte": "memory"}

LENGTH = 0.6
"""m."""
HEIGHT, ETA_B = (0.03, 0.12), (820.0, 30200.0)
"""m, m^-4 s^2: the strips snap, and at the lowest heights touch first."""


def run(
    elastica: int = 60, rod: int = 16, checked: int = 10, assessed: int = 24, seed: int = 1, threads: int = 1
) -> xr.Dataset:
    """One sweep of each model over ``model``, and one of the rod on the paper's paths.

    ``elastica``, ``rod``: numbers of heights and of values of eta_b: the square of it is the number of scenes.
    ``checked``, ``seed``: so many random scenes of each are found again one by one.  ``assessed``: strips on paths.
    """
    rng = np.random.default_rng(seed)
    rows = [_sweep(model, count, checked, rng, threads) for model, count in (("elastica", elastica), ("rod", rod))]
    paths: dict[str, object] = {
        "question": "assess",
        "path": list(PLANS),
        "length": {"from": 0.25, "to": 0.9},
        "model": "rod",
    }
    paths |= {"eta_b": {"from": ETA_B[0], "to": ETA_B[1]}, "samples": assessed, "seed": seed}
    found, wall, *_ = _swept(json.dumps(paths), threads)
    values = {name: ("model", [row[name] for row in rows]) for name in rows[0]}
    return dataset(
        {"model": ("model", ["elastica", "rod"]), **values},
        {
            **{"cores": threads, "checked": checked, "seed": seed, "assessed": assessed},
            "assessed_results": int(found.stable.notnull().sum()),
            "assessed_wall": wall,
        },
        units=UNITS,
    )


def _grid(model: str, count: int) -> str:
    """A grid; JSON is YAML."""
    ranges = (("height", HEIGHT), ("eta_b", ETA_B))
    axes = {key: {"from": low, "to": high, "count": count} for key, (low, high) in ranges}
    return json.dumps({"length": LENGTH, "model": model, **axes})


def _sweep(model: str, count: int, checked: int, rng: np.random.Generator, cores: int) -> dict[str, float]:
    found, wall, used, memory = _swept(_grid(model, count), cores)
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


def _swept(grid: str, cores: int) -> tuple[xr.Dataset, float, float, float]:
    """What a sweep finds, its time and processor time, s, and its memory, Mbyte."""
    with tempfile.TemporaryDirectory() as folder:
        source, file = Path(folder) / "grid.yaml", Path(folder) / "sweep.nc"
        source.write_text(grid, encoding="utf-8")
        before = processor_time()
        (wall,), _, memory = timed_process(command("sweep", str(source), "--output", str(file), "--cores", str(cores)))
        used = processor_time() - before
        return store.read(file), wall, used, memory


def _apart(found: xr.Dataset, model: str) -> float:
    """Distance in lambda_c or lambda_touch of a scene of a sweep from the scene alone, L*; inf between these two."""
    scene = Scene.of(
        {"length": LENGTH, "height": float(found.gripper_height), "eta_b": float(found.eta_b), "model": model}
    )
    alone = critical.find(scene)
    name = "lambda_c" if alone.snap else "lambda_touch"
    apart = abs(float(found[name]) - getattr(alone, name)) / scene.gravity_length
    return np.inf if isnan(apart) else apart


def facts(d: xr.Dataset) -> Facts:
    one, rod = d.sel(model="elastica"), d.sel(model="rod")
    return {
        "scenes": one.scenes,
        "none": (d.scenes - d.results).sum(),
        "apart": d.apart.max(),
        "checked": d.attrs["checked"],
        "rod_scenes": rod.scenes,
        "rod": rod.results / rod.wall,
        "elastica": one.results / one.wall,
        "cost": rod.cost,
        "elastica_cost": one.cost,
        "million": rod.cost * 1e6 / 3600.0,
        "elastica_million": one.cost * 1e6 / 3600.0,
        "assess": d.attrs["assessed_results"] / d.attrs["assessed_wall"],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("sweep_rate", "rod", "1/s", ">= 50 on the rod, >= 500 on the elastica",
            "critical points of the rod over the time of the whole command, {rod_scenes} strips on {d.attrs[cores]} "
            "cores; of the elastica {elastica:.0f}, {scenes} strips; {none} have no result, and lambda of {checked} "
            "found alone is within {apart:.0e} L*", lambda f: f.elastica >= 500.0 and f.none == 0 and f.apart < 1e-9),
        Number("sweep_cost", "cost", "s", "< 0.04 s on the rod, < 0.004 s on the elastica",
            "processor time per strip of the rod's sweep, the start of all processes included; of the elastica's "
            "{elastica_cost:.1e} s; a million strips: {million:.2g} h and {elastica_million:.2g} h",
            lambda f: f.elastica_cost < 0.004),
        Number("sweep_assess_rate", "assess", "1/s", ">= 100",
            "paths of the paper assessed by the rod in statics over the time of the whole command, {d.attrs[assessed]} "
            "strips of 0.25 to 0.9 m on {d.attrs[cores]} cores, of which {d.attrs[assessed_results]} have a result"),
    ),
}
# fmt: on

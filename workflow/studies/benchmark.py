"""Time and memory of typical uses: commands in a process of their own, and repeated calls, on one core."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import critical
from stripfold.ask.inputs import Scene
from stripfold.ask.verdict import assess_path
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.paths.table import read
from studies.common import command, dataset, timed, timed_process
from tasks.assess_data import path_of

ETA_B = 3780.0
"""Of the strip whose R-path is assessed, m^-4 s^2."""
STRIP = ("critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.09")
"""The paper's material in the middle of the range."""
LOG_ROWS, LOG_SECONDS, LOG_NOISE, LOG_TOLERANCE, LOG_SEED = 1201, 12.0, 2e-4, 1e-3, 20261123
"""Of a robot's log: rows, s, standard deviation and tolerance of the smoothing, m."""
SOLID = (*STRIP, "--accuracy", "5e-3", "--json")
ROD = (*STRIP, "--model", "rod", "--json")


def run(repeats: int) -> xr.Dataset:
    """One lambda_c of the solid, ``repeats`` times after one uncounted run."""
    walls, answers, peak = timed_process(command(*SOLID), repeats)
    found = [json.loads(answer) for answer in answers]
    values = {
        "seconds": ("repeat", [one["seconds"] for one in found]),
        "wall": ("repeat", walls),
        "relative_error": ("repeat", [one["error"] / one["lambda_c"] for one in found]),
        "memory": ((), peak),
    }
    return dataset("benchmark", values, {"command": "stripfold " + " ".join(SOLID)})


def run_cli(repeats: int) -> xr.Dataset:
    """One ``stripfold critical --model rod``, ``repeats`` times after one uncounted run: mostly the start of Python."""
    walls, answers, peak = timed_process(command(*ROD), repeats)
    found = json.loads(answers[0])
    values = {
        "wall": ("repeat", walls),
        "solving": ((), found["seconds"]),
        "error": ((), found["error"] / found["lambda_c"]),
        "memory": ((), peak),
    }
    return dataset("cli_benchmark", values, {"command": "stripfold " + " ".join(ROD)})


def run_fall(repeats: int, scene: str) -> xr.Dataset:
    """One ``stripfold simulate`` of a scene file, ``repeats`` times after one uncounted run."""
    with tempfile.TemporaryDirectory() as folder:
        result = str(Path(folder) / "result.nc")
        walls, _, peak = timed_process(command("simulate", scene, "--output", result), repeats)
    attrs = {"command": f"stripfold simulate {Path(scene).name}"}
    return dataset("fall_benchmark", {"wall": ("repeat", walls), "memory": ((), peak)}, attrs)


def run_assess(repeats: int, length: float) -> xr.Dataset:
    """One ``stripfold assess`` of an R-path, ``repeats`` times after one uncounted run; its error from a finer mesh.

    ``length`` of the strip in m.
    """
    strip = ("--length", f"{length:g}", "--eta-b", f"{ETA_B:g}")
    material = Material(ETA_B)
    unit = material.gravity_length
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "r-path.csv")
        timed_process(command("path", "r-path", *strip, "--csv", path))
        walls, answers, peak = timed_process(command("assess", path, *strip, "--fall", "--json"), repeats)
        finer = assess_path(material, length, read(path, length / unit, unit), fall=True, refinement=0.5, compare=False)
    found = json.loads(answers[0])
    error = _apart(found["critical"][0], found["touch_x"], finer) / length
    values = {"wall": ("repeat", walls), "memory": ((), peak), "error": ((), error)}
    return dataset("assess_benchmark", values, {"command": "stripfold assess r-path.csv --fall " + " ".join(strip)})


def run_log(repeats: int, length: float) -> xr.Dataset:
    """One ``stripfold assess`` of a robot's log of an R-path, without noise and with, smoothed: ``repeats`` of each.

    ``length`` of the strip in m.
    """
    strip = ("--length", f"{length:g}", "--eta-b", f"{ETA_B:g}")
    smoothing = ("--smooth", f"{LOG_TOLERANCE:g}")
    values: dict[str, Any] = {}
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name, noise, more in (("smooth", 0.0, ()), ("noisy", LOG_NOISE, smoothing)):
            path = str(Path(folder) / f"{name}.csv")
            np.savetxt(path, robot_log(length, noise), delimiter=",", header="t,x,z", comments="")
            walls, answers, peak = timed_process(command("assess", path, *strip, *more, "--json"), repeats)
            values |= {f"{name}_wall": ("repeat", walls), f"{name}_memory": ((), peak)}
            found.append(json.loads(answers[0])["critical"][0])
    apart = float(np.hypot(*(found[0][axis] - found[1][axis] for axis in "xz")))
    attrs = {"command": " ".join(("stripfold assess log.csv", *strip, *smoothing)), "noise": LOG_NOISE}
    return dataset("robot_log_benchmark", values | {"apart": ((), apart)}, attrs)


def robot_log(length: float, noise: float) -> Array:
    """An R-path as a robot logs it that starts and stops smoothly, shape (rows, 3): s and m, with noise of this sd."""
    unit = Material(ETA_B).gravity_length
    path = path_of("r-path", length / unit)
    share = np.linspace(0.0, 1.0, LOG_ROWS)
    places = np.array([unit * path.position(float(s)) for s in path.length * share**2 * (3.0 - 2.0 * share)])
    places += noise * np.random.default_rng(LOG_SEED).standard_normal(places.shape)
    return np.column_stack([LOG_SECONDS * share, places])


def run_rod(repeats: int, length: float) -> xr.Dataset:
    """One lambda_c of the rod to 1e-3 and one R-path assessed on it, without and with its fall: ``repeats`` calls each.

    Errors from finer meshes, and from the solid.  ``length`` in m of the strip whose path is assessed.
    """
    material = Material(ETA_B)
    strip: dict[str, Any] = {"length": 0.6, "height": 0.09, "eta_b": ETA_B, "model": "rod"}
    path = path_of("r-path", length / material.gravity_length)
    seconds, found = timed(partial(critical.find, Scene(**strip)), repeats)
    truth = critical.find(Scene(**strip, accuracy=1e-4)).lambda_c
    seconds_static, _ = timed(partial(assess_path, material, length, path, model="rod"), repeats)
    seconds_assess, verdict = timed(partial(assess_path, material, length, path, fall=True, model="rod"), repeats)
    apart = _apart(verdict.critical[0], verdict.touch_x, assess_path(material, length, path, fall=True))
    return dataset(
        "rod_benchmark",
        {
            "seconds": ("repeat", seconds),
            "estimated_error": ((), found.error / found.lambda_c),
            "error": ((), abs(found.lambda_c / truth - 1.0)),
            "seconds_static": ("repeat", seconds_static),
            "seconds_assess": ("repeat", seconds_assess),
            "apart": ((), apart / length),
        },
        {"scene": "length 0.6 m, eta_b 3780, height 0.09 m", "path": f"R-path, length {length:g} m, eta_b {ETA_B:g}"},
    )


def _apart(critical: Any, touch_x: float, other: Any) -> float:
    """Largest distance of the critical point and the first touch from those of another verdict, m."""
    again = other.critical[0]
    return max(float(np.hypot(critical["x"] - again["x"], critical["z"] - again["z"])), abs(touch_x - other.touch_x))

"""Time and memory of typical uses: commands in a process of their own, and repeated calls, on one core."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.ask import critical_point
from stripfold.ask.inputs import Scene
from stripfold.ask.verdict import assess_path
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from stripfold.paths.table import read
from tasks.assess_data import path_of
from verification.common import command, dataset, timed, timed_process
from verification.numbers import Facts, Number

UNITS_FALL_BENCHMARK = {"Mbyte": "memory", "s": "wall"}

UNITS_ROBOT_LOG_BENCHMARK = {"m": "apart", "Mbyte": "noisy_memory smooth_memory", "s": "noisy_wall smooth_wall"}

UNITS_ASSESS_BENCHMARK = {"Mbyte": "memory", "s": "wall"}

UNITS_ROD_BENCHMARK = {"s": "seconds seconds_assess seconds_static"}

UNITS_CLI_BENCHMARK = {"Mbyte": "memory", "s": "solving wall"}

UNITS_BENCHMARK = {"Mbyte": "memory", "s": "seconds wall"}

ETA_B = 3780.0
"""Of the strip whose R-path is assessed, m^-4 s^2."""
STRIP = ("critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.09")
"""The paper's material in the middle of the range."""
LOG_ROWS, LOG_SECONDS, LOG_NOISE, LOG_TOLERANCE, LOG_SEED = 1201, 12.0, 2e-4, 1e-3, 20261123
"""Of a robot's log: rows, s, standard deviation and tolerance of the smoothing, m."""
SOLID = (*STRIP, "--accuracy", "5e-3", "--json")
ROD = (*STRIP, "--model", "rod", "--json")


def run(repeats: int = 2) -> xr.Dataset:
    """One lambda_c of the solid, ``repeats`` times after one uncounted run."""
    walls, answers, peak = timed_process(command(*SOLID), repeats)
    found = [json.loads(answer) for answer in answers]
    values = {
        "seconds": ("repeat", [one["seconds"] for one in found]),
        "wall": ("repeat", walls),
        "relative_error": ("repeat", [one["error"] / one["lambda_c"] for one in found]),
        "memory": ((), peak),
    }
    return dataset(values, {"command": "stripfold " + " ".join(SOLID)}, units=UNITS_BENCHMARK)


def run_cli(repeats: int = 2) -> xr.Dataset:
    """One ``stripfold critical --model rod``, ``repeats`` times after one uncounted run: mostly the start of Python."""
    walls, answers, peak = timed_process(command(*ROD), repeats)
    found = json.loads(answers[0])
    values = {
        "wall": ("repeat", walls),
        "solving": ((), found["seconds"]),
        "error": ((), found["error"] / found["lambda_c"]),
        "memory": ((), peak),
    }
    return dataset(values, {"command": "stripfold " + " ".join(ROD)}, units=UNITS_CLI_BENCHMARK)


def run_fall(repeats: int = 2, scene: str = "workflow/config/collapse.yaml") -> xr.Dataset:
    """One ``stripfold simulate`` of a scene file, ``repeats`` times after one uncounted run."""
    with tempfile.TemporaryDirectory() as folder:
        result = str(Path(folder) / "result.nc")
        walls, _, peak = timed_process(command("simulate", scene, "--output", result), repeats)
    attrs = {"command": f"stripfold simulate {Path(scene).name}"}
    return dataset({"wall": ("repeat", walls), "memory": ((), peak)}, attrs, units=UNITS_FALL_BENCHMARK)


def run_assess(repeats: int = 2, length: float = 0.5) -> xr.Dataset:
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
    return dataset(
        values, {"command": "stripfold assess r-path.csv --fall " + " ".join(strip)}, units=UNITS_ASSESS_BENCHMARK
    )


def run_log(repeats: int = 2, length: float = 0.5) -> xr.Dataset:
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
    return dataset(values | {"apart": ((), apart)}, attrs, units=UNITS_ROBOT_LOG_BENCHMARK)


def robot_log(length: float, noise: float) -> Array:
    """An R-path as a robot logs it that starts and stops smoothly, shape (rows, 3): s and m, with noise of this sd."""
    unit = Material(ETA_B).gravity_length
    path = path_of("r-path", length / unit)
    share = np.linspace(0.0, 1.0, LOG_ROWS)
    places = np.array([unit * path.position(float(s)) for s in path.length * share**2 * (3.0 - 2.0 * share)])
    places += noise * np.random.default_rng(LOG_SEED).standard_normal(places.shape)
    return np.column_stack([LOG_SECONDS * share, places])


def run_rod(repeats: int = 2, length: float = 0.5) -> xr.Dataset:
    """One lambda_c of the rod to 1e-3 and one R-path assessed on it, without and with its fall: ``repeats`` calls each.

    Errors from finer meshes, and from the solid.  ``length`` in m of the strip whose path is assessed.
    """
    material = Material(ETA_B)
    strip: dict[str, Any] = {"length": 0.6, "height": 0.09, "eta_b": ETA_B, "model": "rod"}
    path = path_of("r-path", length / material.gravity_length)
    seconds, found = timed(partial(critical_point.find, Scene(**strip)), repeats)
    truth = critical_point.find(Scene(**strip, accuracy=1e-4)).lambda_c
    seconds_static, _ = timed(partial(assess_path, material, length, path, model="rod"), repeats)
    seconds_assess, verdict = timed(partial(assess_path, material, length, path, fall=True, model="rod"), repeats)
    apart = _apart(verdict.critical[0], verdict.touch_x, assess_path(material, length, path, fall=True))
    return dataset(
        {
            "seconds": ("repeat", seconds),
            "estimated_error": ((), found.error / found.lambda_c),
            "error": ((), abs(found.lambda_c / truth - 1.0)),
            "seconds_static": ("repeat", seconds_static),
            "seconds_assess": ("repeat", seconds_assess),
            "apart": ((), apart / length),
        },
        {"scene": "length 0.6 m, eta_b 3780, height 0.09 m", "path": f"R-path, length {length:g} m, eta_b {ETA_B:g}"},
        units=UNITS_ROD_BENCHMARK,
    )


def _apart(critical: Any, touch_x: float, other: Any) -> float:
    """Largest distance of the critical point and the first touch from those of another verdict, m."""
    again = other.critical[0]
    return max(float(np.hypot(critical["x"] - again["x"], critical["z"] - again["z"])), abs(touch_x - other.touch_x))


def facts_benchmark(d: xr.Dataset) -> Facts:
    return {"seconds": d.seconds.median(), "error": d.relative_error.max(), "mb": d.memory}


# fmt: off
NUMBERS_BENCHMARK = {
    facts_benchmark: (
        Number("time_solid_lambda_c", "seconds", "s", "<= 5 s, error <= 5e-3",
            "median time of one solid lambda_c with its error estimate ({error:.0e} relative), one core, new process",
            lambda f: f.error <= 5e-3),
    ),
}
# fmt: on


def facts_cli_benchmark(d: xr.Dataset) -> Facts:
    return {"seconds": d.wall.median(), "solving": d.solving, "error": d.error}


# fmt: off
NUMBERS_CLI_BENCHMARK = {
    facts_cli_benchmark: (
        Number("time_cli", "seconds", "s", "<= 1 s, error <= 1e-3",
            "median time of one `stripfold critical --model rod` ({error:.0e} relative), one core, new process; the "
            "solver takes {solving:.2g} s of it", lambda f: f.error <= 1e-3),
    ),
}
# fmt: on


def facts_rod_benchmark(d: xr.Dataset) -> Facts:
    return {
        "seconds": d.seconds.median(),
        "error": d.estimated_error,
        "static": d.seconds_static.median(),
        "assess": d.seconds_assess.median(),
        "apart": d.apart,
    }


# fmt: off
NUMBERS_ROD_BENCHMARK = {
    facts_rod_benchmark: (
        Number("time_rod_1e-3", "seconds", "s", "<= 0.02 s, error <= 1e-3",
            "median time of one lambda_c of the rod with its error estimate ({error:.0e} relative), one core, warm "
            "process", lambda f: f.error <= 1e-3),
        Number("time_assess_static_rod", "static", "s", "<= 0.15 s",
            "median time of the verdict on one R-path on the rod, from statics alone, one core, warm process"),
        Number("time_assess_rod", "assess", "s", "<= 0.8 s, difference <= 5e-3",
            "median time of one R-path assessed on the rod with its fall, one core, warm process; critical point and "
            "first touch differ from the solid's by {apart:.0e} of the length", lambda f: f.apart <= 5e-3),
    ),
}
# fmt: on


def facts_assess_benchmark(d: xr.Dataset) -> Facts:
    """Of a timed process."""
    return {"seconds": d["wall"].median(), "memory": d.memory, "error": d.get("error", np.nan)}


# fmt: off
NUMBERS_ASSESS_BENCHMARK = {
    facts_assess_benchmark: (
        Number("time_assess", "seconds", "s", "<= 4 s, difference <= 5e-3",
            "median time of one `stripfold assess` of an R-path with its fall, one core, new process; "
            "{memory:.0f} MB, difference {error:.1e} of the length from half the elements",
            lambda f: f.error <= 5e-3),
    ),
}
# fmt: on


def facts_robot_log_benchmark(d: xr.Dataset) -> Facts:
    smooth, noisy = float(d.smooth_wall.median()), float(d.noisy_wall.median())
    return {"cost": noisy / smooth, "smooth": smooth, "noisy": noisy, "mb": d.noisy_memory, "apart": 1e3 * d.apart}


# fmt: off
NUMBERS_ROBOT_LOG_BENCHMARK = {
    facts_robot_log_benchmark: (
        Number("robot_log_cost", "cost", "factor", "<= 1.5, critical points at most 1 mm apart",
            "time of one `stripfold assess --smooth` of a robot's log, 1201 rows with 0.2 mm of noise, over that of "
            "the log without noise ({noisy:.2f} s over {smooth:.2f} s, {mb:.0f} MB); critical point {apart:.2f} mm off",
            lambda f: f.apart <= 1.0),
    ),
}
# fmt: on


def facts_fall_benchmark(d: xr.Dataset) -> Facts:
    """Of a timed process."""
    return {"seconds": d["wall"].median(), "memory": d.memory, "error": d.get("error", np.nan)}


# fmt: off
NUMBERS_FALL_BENCHMARK = {
    facts_fall_benchmark: (
        Number("time_fall", "seconds", "s", "<= 2 s",
            "median time of one `stripfold simulate` (statics, fall to rest, statics again), one core, new process"),
    ),
}
# fmt: on

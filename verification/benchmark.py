"""Time and memory of typical uses: commands in a process of their own, and repeated calls, on one core."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold import paths
from stripfold.ask.assess import assess
from stripfold.ask.critical import find
from stripfold.ask.inputs import PathInputs, Scene
from stripfold.base.arrays import Array
from stripfold.base.material import Material
from tasks.assess_data import path_of
from verification.common import command, dataset, timed, timed_process
from verification.numbers import Facts, Number

ETA_B = 3780.0
"""Of all strips, m^-4 s^2."""
STRIP = ("--length", "0.6", "--eta-b", "3780", "--height", "0.09")
"""The paper's material in the middle of the range."""
LOG_ROWS, LOG_SECONDS, LOG_NOISE, LOG_TOLERANCE, LOG_SEED = 1201, 12.0, 2e-4, 1e-3, 20261123
"""Of a robot's log: rows, s, standard deviation and tolerance of the smoothing, m."""
UNITS = {
    "s": "solid cli cli_solving fall assess log noisy_log rod rod_static rod_assess",
    "Mbyte": "assess_memory noisy_log_memory",
    "m": "log_apart",
}


def run(repeats: int = 1, length: float = 0.5, scene: str = "workflow/config/collapse.yaml") -> xr.Dataset:
    """Seconds of each use, ``repeats`` times after an uncounted run, and its error from a finer mesh or another model.

    ``length``: of the strip whose R-path is assessed, m; ``scene``: of the simulated fall.
    """
    seconds, values = {}, {}
    seconds["solid"], answers, _ = timed_process(command("critical", *STRIP, "--accuracy", "5e-3", "--json"), repeats)
    values["solid_error"] = _error(json.loads(answers[0]))
    seconds["cli"], answers, _ = timed_process(command("critical", *STRIP, "--model", "rod", "--json"), repeats)
    values |= {"cli_solving": json.loads(answers[0])["seconds"], "cli_error": _error(json.loads(answers[0]))}

    asked = partial(PathInputs, length=length, eta_b=ETA_B)
    strip = ("--length", f"{length:g}", "--eta-b", f"{ETA_B:g}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seconds["fall"], *_ = timed_process(command("simulate", scene, "--output", str(folder / "fall.nc")), repeats)

        table = folder / "r-path.csv"
        timed_process(command("path", "r-path", *strip, "--csv", str(table)))
        assess_it = command("assess", str(table), *strip, "--fall", "--json")
        seconds["assess"], answers, values["assess_memory"] = timed_process(assess_it, repeats)
        path, found = paths.read(table, asked()), json.loads(answers[0])
        finer = assess(asked(fall=True), path, refinement=0.5, compare=False)
        values["assess_error"] = _apart(found["critical"][0], found["touch_x"], finer) / length

        critical = []
        for kind, noise, more in (("log", 0.0, ()), ("noisy_log", LOG_NOISE, ("--smooth", f"{LOG_TOLERANCE:g}"))):
            log = folder / f"{kind}.csv"
            np.savetxt(log, robot_log(length, noise), delimiter=",", header="t,x,z", comments="")
            call = command("assess", str(log), *strip, *more, "--json")
            seconds[kind], answers, values[f"{kind}_memory"] = timed_process(call, repeats)
            critical.append(json.loads(answers[0])["critical"][0])
        values["log_apart"] = float(np.hypot(*(critical[0][axis] - critical[1][axis] for axis in "xz")))

    rod: dict[str, Any] = {"length": 0.6, "height": 0.09, "eta_b": ETA_B, "model": "rod"}
    path = paths.r_path(asked())
    seconds["rod"], point = timed(partial(find, Scene(**rod)), repeats)
    values["rod_error"] = point.error / point.lambda_c
    seconds["rod_static"], _ = timed(partial(assess, asked(model="rod"), path), repeats)
    seconds["rod_assess"], verdict = timed(partial(assess, asked(model="rod", fall=True), path), repeats)
    values["rod_apart"] = _apart(verdict.critical[0], verdict.touch_x, assess(asked(fall=True), path)) / length
    listed = {name: ("repeat", found) for name, found in seconds.items()}
    return dataset(listed | {name: ((), value) for name, value in values.items()}, units=UNITS)


def robot_log(length: float, noise: float) -> Array:
    """An R-path as a robot logs it that starts and stops smoothly, shape (rows, 3): s and m, with noise of this sd."""
    unit = Material(ETA_B).gravity_length
    path = path_of("r-path", length / unit)
    share = np.linspace(0.0, 1.0, LOG_ROWS)
    places = np.array([unit * path.position(float(s)) for s in path.length * share**2 * (3.0 - 2.0 * share)])
    places += noise * np.random.default_rng(LOG_SEED).standard_normal(places.shape)
    return np.column_stack([LOG_SECONDS * share, places])


def _error(found: dict[str, float]) -> float:
    return found["error"] / found["lambda_c"]


def _apart(critical: Any, touch_x: float, other: Any) -> float:
    """Largest distance of the critical point and the first touch from those of another verdict, m."""
    again = other.critical[0]
    return max(float(np.hypot(critical["x"] - again["x"], critical["z"] - again["z"])), abs(touch_x - other.touch_x))


def facts(d: xr.Dataset) -> Facts:
    medians = {str(name): d[name].median() for name in d if d[name].dims}
    return (
        medians
        | {str(name): d[name] for name in d if not d[name].dims}
        | {
            "cost": medians["noisy_log"] / medians["log"],
            "millimetres": 1e3 * d.log_apart,
        }
    )


# fmt: off
NUMBERS = {
    facts: (
        Number("time_solid_lambda_c", "solid", "s", "<= 5 s, error <= 5e-3",
            "median time of one solid lambda_c with its error estimate ({solid_error:.0e} relative), one core, new "
            "process", lambda f: f.solid_error <= 5e-3),
        Number("time_cli", "cli", "s", "<= 1 s, error <= 1e-3",
            "median time of one `stripfold critical --model rod` ({cli_error:.0e} relative), one core, new process; "
            "the solver takes {cli_solving:.2g} s of it", lambda f: f.cli_error <= 1e-3),
        Number("time_rod_1e-3", "rod", "s", "<= 0.02 s, error <= 1e-3",
            "median time of one lambda_c of the rod with its error estimate ({rod_error:.0e} relative), one core, warm "
            "process", lambda f: f.rod_error <= 1e-3),
        Number("time_assess_static_rod", "rod_static", "s", "<= 0.15 s",
            "median time of the verdict on one R-path on the rod, from statics alone, one core, warm process"),
        Number("time_assess_rod", "rod_assess", "s", "<= 0.8 s, difference <= 5e-3",
            "median time of one R-path assessed on the rod with its fall, one core, warm process; critical point and "
            "first touch differ from the solid's by {rod_apart:.0e} of the length", lambda f: f.rod_apart <= 5e-3),
        Number("time_assess", "assess", "s", "<= 4 s, difference <= 5e-3",
            "median time of one `stripfold assess` of an R-path with its fall, one core, new process; "
            "{assess_memory:.0f} MB, difference {assess_error:.1e} of the length from half the elements",
            lambda f: f.assess_error <= 5e-3),
        Number("robot_log_cost", "cost", "factor", "<= 1.5, critical points at most 1 mm apart",
            "time of one `stripfold assess --smooth` of a robot's log, 1201 rows with 0.2 mm of noise, over that of "
            "the log without noise ({noisy_log:.2f} s over {log:.2f} s, {noisy_log_memory:.0f} MB); critical point "
            "{millimetres:.2f} mm off", lambda f: f.millimetres <= 1.0),
        Number("time_fall", "fall", "s", "<= 2 s",
            "median time of one `stripfold simulate` (statics, fall to rest, statics again), one core, new process"),
    ),
}
# fmt: on

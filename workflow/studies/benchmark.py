"""Time and memory of what a user starts: each run in a process of its own, on one core."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from time import perf_counter
from typing import TypeVar

import numpy as np
import xarray as xr

from stripfold.errors import StripfoldError

T = TypeVar("T")

ETA_B = 3780.0
"""Of the strip whose R-path is assessed, m^-4 s^2."""
COMMAND = ("critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.09", "--accuracy", "5e-3", "--json")
"""What is timed: the paper's material in the middle of the range, to a relative error of 5e-3."""


def run(repeats: int) -> xr.Dataset:
    """One lambda_c of the solid, ``repeats`` times after one uncounted run."""
    walls, answers, peak = _timed(COMMAND, repeats)
    found = [json.loads(answer) for answer in answers]
    return xr.Dataset(
        {
            "seconds": ("repeat", [a["seconds"] for a in found], {"units": "s", "long_name": "time of the solve"}),
            "wall": ("repeat", walls, {"units": "s", "long_name": "time of the whole process"}),
            "relative_error": (
                "repeat",
                [a["error"] / a["lambda_c"] for a in found],
                {"units": "1", "long_name": "estimated relative error of lambda_c"},
            ),
            "memory": ((), peak, {"units": "MB", "long_name": "peak memory of the process"}),
        },
        attrs={"command": "stripfold " + " ".join(COMMAND)},
    )


def run_fall(repeats: int, scene: str) -> xr.Dataset:
    """One ``stripfold simulate`` of a scene file, ``repeats`` times after one uncounted run."""
    with tempfile.TemporaryDirectory() as folder:
        walls, _, peak = _timed(("simulate", scene, "--output", str(Path(folder) / "result.nc")), repeats)
    return xr.Dataset(
        {
            "wall": ("repeat", walls, {"units": "s", "long_name": "time of the whole process"}),
            "memory": ((), peak, {"units": "MB", "long_name": "peak memory of the process"}),
        },
        attrs={"command": f"stripfold simulate {Path(scene).name}"},
    )


def run_assess(repeats: int, length: float) -> xr.Dataset:
    """One ``stripfold assess`` of an R-path, ``repeats`` times after one uncounted run; its error from a finer mesh.

    ``length`` of the strip in m.
    """
    strip = ("--length", f"{length:g}", "--eta-b", f"{ETA_B:g}")
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "r-path.csv")
        _timed(("path", "r-path", *strip, "--csv", path), 0)
        walls, answers, peak = _timed(("assess", path, *strip, "--json"), repeats)
        # Only now: what this process has in memory counts in a child's peak.
        from stripfold.analysis.verdict import assess_path
        from stripfold.material import Material
        from stripfold.paths.table import read

        material = Material(ETA_B)
        unit = material.gravity_length
        found = json.loads(answers[0])
        finer = assess_path(material, length, read(path, length / unit, unit), refinement=0.5)
    first, again = found["critical"][0], finer.critical[0]
    error = max(
        float(np.hypot(first["x"] - again["x"], first["z"] - again["z"])),
        abs(found["first_touch_x"] - finer.first_touch_x),
    )
    return xr.Dataset(
        {
            "wall": ("repeat", walls, {"units": "s", "long_name": "time of the whole process"}),
            "memory": ((), peak, {"units": "MB", "long_name": "peak memory of the process"}),
            "error": (
                (),
                error / length,
                {"units": "1", "long_name": "change of critical point and first touch on half the elements / length"},
            ),
        },
        attrs={"command": "stripfold assess r-path.csv " + " ".join(strip)},
    )


def run_rod(repeats: int, length: float) -> xr.Dataset:
    """One lambda_c of the rod to 1e-3 and one R-path assessed on it: ``repeats`` calls each in this process.

    Each after an uncounted call, as a user has it who asks for many: imports and caches of the machine are warm.
    Errors from finer meshes.  ``length`` in m of the strip whose path is assessed.
    """
    from stripfold.analysis import critical_point as critical
    from stripfold.analysis.verdict import assess_path
    from stripfold.inputs import Scene
    from stripfold.material import Material
    from stripfold.paths.rpath import path_of

    material = Material(ETA_B)
    unit = material.gravity_length
    scene = Scene(length=0.6, height=0.09, eta_b=material.eta_b, model="rod")
    finer = Scene(length=0.6, height=0.09, eta_b=material.eta_b, model="rod", accuracy=1e-4)
    seconds, found = calls(lambda: critical.find(scene), repeats)
    truth = critical.find(finer).lambda_c
    path = path_of("r-path", length / unit)
    seconds_assess, verdict = calls(lambda: assess_path(material, length, path, model="rod"), repeats)
    solid = assess_path(material, length, path)
    first, again = verdict.critical[0], solid.critical[0]
    apart = max(
        float(np.hypot(first["x"] - again["x"], first["z"] - again["z"])),
        abs(verdict.first_touch_x - solid.first_touch_x),
    )
    return xr.Dataset(
        {
            "seconds": ("repeat", seconds, {"units": "s", "long_name": "time of one lambda_c to 1e-3"}),
            "estimated_error": ((), found.error / found.lambda_c, {"units": "1", "long_name": "its estimated error"}),
            "error": (
                (),
                abs(found.lambda_c / truth - 1.0),
                {"units": "1", "long_name": "its relative distance from lambda_c to 1e-4"},
            ),
            "seconds_assess": (
                "repeat",
                seconds_assess,
                {"units": "s", "long_name": "time of one R-path assessed, with its fall"},
            ),
            "apart": (
                (),
                apart / length,
                {"units": "1", "long_name": "critical point and first touch from those of the solid / length"},
            ),
        },
        attrs={
            "scene": "length 0.6 m, eta_b 3780, height 0.09 m",
            "path": f"R-path, length {length:g} m, eta_b {ETA_B:g}",
        },
    )


def peak_memory(command: Sequence[str]) -> float:
    """Peak memory in MB of one process with a command of the command line."""
    return peak_of(f"from stripfold.cli import main\nassert main({list(command)!r}) == 0")


def peak_of(code: str) -> float:
    """Peak memory in MB of a Python process that runs this code and no more."""
    # Of the process as it is: what `getrusage` tells has the peak of the one that started it in it.
    told = f"{code}\nprint(*(line for line in open('/proc/self/status') if line.startswith('VmHWM')))"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=False)
    if done.returncode:
        raise StripfoldError(f"the process whose memory is measured failed: {done.stderr.strip().splitlines()[-1]}")
    return float(np.round(int(done.stdout.split()[-2]) * 1024 / 1e6, 1))


def calls(call: Callable[[], T], repeats: int) -> tuple[list[float], T]:
    """Seconds of each counted call, and what the last one gave."""
    result, seconds = call(), []
    for _ in range(repeats):
        began = perf_counter()
        result = call()
        seconds.append(perf_counter() - began)
    return seconds, result


def _timed(command: Sequence[str], repeats: int) -> tuple[list[float], list[str], float]:
    """Seconds of each counted run, what it printed, and the peak memory of all in MB.

    After an uncounted one; a single run is no measurement, and needs none before it.
    """
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    walls, answers = [], []
    uncounted = 0 if repeats == 1 else 1
    for _ in range(uncounted + repeats):
        began = perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "stripfold", *command], capture_output=True, text=True, env=environment, check=False
        )
        walls.append(perf_counter() - began)
        if done.returncode:
            raise StripfoldError(f"the benchmark's command failed: {done.stderr.strip()}")
        answers.append(done.stdout)
    # The largest child so far: all of them run the same command.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e6
    return walls[uncounted:], answers[uncounted:], float(np.round(peak, 1))

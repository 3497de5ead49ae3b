"""Time and memory of what a user starts: each run in a process of its own, on one core."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr

from ..errors import StripfoldError

STRIP = ("--length", "0.5", "--eta-b", "3780")
"""The strip whose R-path is assessed."""
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


def run_assess(repeats: int) -> xr.Dataset:
    """One ``stripfold assess`` of an R-path, ``repeats`` times after one uncounted run; its error from a finer mesh."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "r-path.csv")
        _timed(("path", "r-path", *STRIP, "--csv", path), 0)
        walls, answers, peak = _timed(("assess", path, *STRIP, "--json"), repeats)
        # Only now: what this process has in memory counts in a child's peak.
        from ..material import Material
        from ..paths import read
        from .verdict import reach

        material = Material(float(STRIP[3]))
        unit, length = material.gravity_length, float(STRIP[1])
        found = json.loads(answers[0])
        finer = reach(material, length, read(path, length / unit, unit), refinement=0.5)
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
        attrs={"command": "stripfold assess r-path.csv " + " ".join(STRIP)},
    )


def _timed(command: Sequence[str], repeats: int) -> tuple[list[float], list[str], float]:
    """Seconds of each counted run, what it printed, and the peak memory of all in MB."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    walls, answers = [], []
    for _ in range(repeats + 1):
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
    return walls[1:], answers[1:], float(np.round(peak, 1))

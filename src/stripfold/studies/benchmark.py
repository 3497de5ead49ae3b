"""Time and memory of one lambda_c of the solid, each run in a process of its own as a user would start it."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from time import perf_counter

import numpy as np
import xarray as xr

from ..errors import StripfoldError

COMMAND = ("critical", "--length", "0.6", "--eta-b", "3780", "--height", "0.09", "--accuracy", "5e-3", "--json")
"""What is timed: the paper's material in the middle of the range, to a relative error of 5e-3."""


def run(repeats: int) -> xr.Dataset:
    """Run the command line ``repeats`` times after one uncounted run, on one core."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "stripfold", *COMMAND]
    rows = []
    for _ in range(repeats + 1):
        began = perf_counter()
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        wall = perf_counter() - began
        if done.returncode:
            raise StripfoldError(f"the benchmark's command failed: {done.stderr.strip()}")
        answer = json.loads(done.stdout)
        rows.append((answer["seconds"], wall, answer["error"] / answer["lambda_c"]))
    # The largest child so far: all of them run the same command.
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e6
    seconds, walls, errors = np.array(rows[1:]).T
    return xr.Dataset(
        {
            "seconds": ("repeat", seconds, {"units": "s", "long_name": "time of the solve"}),
            "wall": ("repeat", walls, {"units": "s", "long_name": "time of the whole process"}),
            "relative_error": ("repeat", errors, {"units": "1", "long_name": "estimated relative error of lambda_c"}),
            "memory": ((), peak, {"units": "MB", "long_name": "peak memory of the process"}),
        },
        attrs={"command": "stripfold " + " ".join(COMMAND)},
    )

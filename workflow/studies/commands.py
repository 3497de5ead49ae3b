"""All commands, each several times in new processes: is what they print and write the same each time?"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import cv2
import xarray as xr

from studies.common import LONGEST, ONE_CORE, Progress, dataset, pooled
from studies.eta_pictures import SCALE, drawn, looks

_STRIP = "--length 0.5 --eta-b 3780"
# In an order in which each finds what those before have written.
COMMANDS = (
    f"critical {_STRIP} --height 0.09 --accuracy 5e-3 --plot critical.png",
    f"critical {_STRIP} --height 0.09 --model auto --eta-b-uncertainty 20% --second-gripper auto",
    "sweep grid.yaml --cores 2",
    f"eta --image fold.png --scale {SCALE} --method fold --picture fit.png",
    "simulate scene.yaml --plot curve.png",
    "film scene.nc",
    f"path r-path {_STRIP} --csv path.csv --plot path.png",
    f"plan {_STRIP} --layers-may-slide --csv plan.csv --json plan.json",
    f"map {_STRIP} --output map.nc --plot map.png",
    f"assess path.csv {_STRIP} --model rod --fall --plot assessed.png",
    "record filmed.yaml",
    "calibrate filmed/calibration/camera --board chessboard --columns 8 --rows 5 --square 0.024",
    "measure filmed",
    "new scene --output new.yaml",
    "doctor",
    "completion bash",
)
INPUTS = {
    "grid.yaml": "{length: 0.6, model: rod, height: [0.06, 0.09], eta_b: [2000, 3780]}",
    "scene.yaml": "{length: 0.5, height: 0.09, eta_b: 3780, model: rod}",
    "filmed.yaml": "{length: 0.45, speed: 0.01, filming: {size: [320, 240]}}",
}
_FOLD = next(looks(1, [0.08], seed=3))
# The only thing that may differ.
_RUN_TIME = re.compile(r"^time +[0-9.]+ s$", re.M)


class Outcome(NamedTuple):
    """What a command printed, its exit code, and digests of the files that it wrote."""

    said: str
    code: int
    files: dict[str, str]


def run(repeats: int, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """All commands ``repeats`` times, over ``command``."""
    with tempfile.TemporaryDirectory() as folder:
        everything = pooled(partial(_once, Path(folder)), range(repeats), threads)
    rows = []
    for command, *outcomes in zip(COMMANDS, *everything, strict=True):
        first = outcomes[0]
        rows.append({"files": len(first.files), "differs": differences(outcomes)})
        if progress:
            progress(f"{command}: {rows[-1]['differs'] or 'always the same'}")
    values = {name: ("command", [row[name] for row in rows]) for name in rows[0]}
    return dataset("commands", {"command": ("command", list(COMMANDS)), **values}, {"repeats": repeats})


def differences(outcomes: list[Outcome]) -> str:
    """What differs between the runs of a command, or that it failed; empty if nothing does."""
    first = outcomes[0]
    if first.code:
        return f"failed: {first.said.strip()}"
    items = set(first.files.items())
    found = {name for one in outcomes for name, _ in items.symmetric_difference(one.files.items())}
    printed = ["what is printed"] if any(one.said != first.said or one.code for one in outcomes) else []
    return ", ".join([*printed, *sorted(found)])


def _once(parent: Path, number: int) -> list[Outcome]:
    folder = parent / str(number)
    folder.mkdir()
    return run_all(folder, [sys.executable, "-m", "stripfold"], os.environ | ONE_CORE, LONGEST)


def run_all(folder: Path, program: list[str], environment: Mapping[str, str], longest: int) -> list[Outcome]:
    """All commands in an empty folder.

    ``folder``: where they run; ``program``: words with which a command begins; ``environment``: variables of the
    processes; ``longest``: seconds that a command may take.
    """
    for name, text in INPUTS.items():
        (folder / name).write_text(text, encoding="utf-8")
    cv2.imwrite(str(folder / "fold.png"), drawn(_FOLD))
    outcomes = []
    for command in COMMANDS:
        before, line = _files(folder), [*program, *command.split()]
        done = subprocess.run(
            line, cwd=folder, env=environment, capture_output=True, text=True, timeout=longest, check=False
        )
        written = {name: digest for name, digest in _files(folder).items() if before.get(name) != digest}
        outcomes.append(Outcome(_RUN_TIME.sub("", done.stdout + done.stderr), done.returncode, written))
    return outcomes


def _files(folder: Path) -> dict[str, str]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}

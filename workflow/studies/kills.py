"""`make all` killed again and again: does it go on by itself, and are its results those of an undisturbed run?

The chain is the small one without studies.  A start lasts a random time, by the exponential law, and all of its
processes get SIGKILL or SIGTERM then.  A chain that is complete before all kills are done is compared, and begun anew.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path
from time import monotonic, perf_counter, sleep
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
import yaml

from stripfold.base.errors import InvalidInputError
from stripfold.files import store
from studies.common import Progress, table
from studies.slurm_run import untimed

KILLS, SEED = 50, 20263411
MEAN = 0.09
"""Mean time to a kill, as a share of the time of the undisturbed run."""
LONGEST = 120.0
"""Seconds in which a run has to end after SIGTERM."""
SIGNALS = (signal.SIGKILL, signal.SIGTERM)
MADE = ("results", "figures")
"""Folders of what the chain makes."""
APART = ("benchmarks", "logs")
"""Folders in them of run times, and of texts with what a run did."""
HALF_WRITTEN = ".stripfold-*"
_STARTED = re.compile(r"^Job \d+: (\w+)", re.M)
_FINISHED = re.compile(r"^Finished jobid: \d+ \(Rule: (\w+)\)$", re.M)


class Start(NamedTuple):
    """How a start of the chain ended.

    ``code`` is its exit code, None where it was killed; ``seconds`` its time; ``running`` the rules whose jobs were
    under way; ``left`` how many half-written files are left; ``said`` the last lines that it printed.
    """

    code: int | None
    seconds: float
    running: str
    left: int
    said: str


def run(clone: Path, cores: int, progress: Progress | None = None, kills: int = KILLS, seed: int = SEED) -> xr.Dataset:
    """Kill the chain in a clone, ``kills`` times.

    ``clone``: a fresh clone; its configuration is replaced.  ``cores``: number of cores.

    Dataset over ``kill``: the moment, the signal, what was running, whether the next start went on by itself, the files
    that differed in the end from those of the undisturbed run, and the half-written files left.
    """
    say = progress or (lambda _: None)
    configure(clone)
    command = ["make", "all", f"CORES={cores}"]
    subprocess.run(["make", "env"], cwd=clone, check=True, stdout=subprocess.DEVNULL)
    undisturbed = start(command, clone)
    if undisturbed.code:
        raise RuntimeError(f"the undisturbed run failed: {undisturbed.said}")
    wanted = contents(clone)
    say(f"{len(wanted)} files in {undisturbed.seconds:.0f} s")
    begin_anew(clone)
    random = np.random.default_rng(seed)
    rows: list[dict[str, Any]] = []
    first = 0
    while True:
        number = random.choice(len(SIGNALS))
        moment = random.exponential(MEAN * undisturbed.seconds)
        done = start(command, clone, moment, SIGNALS[number]) if len(rows) < kills else start(command, clone)
        if len(rows) > first:
            rows[-1]["went_on"] = float(not done.code)
        if done.code is None:
            rows.append(
                {"moment": done.seconds, "signal": SIGNALS[number].name, "running": done.running}
                | {"went_on": 0.0, "left": done.left, "differs": "not complete"}
            )
            say(f"{len(rows)}: {rows[-1]}")
            continue
        differs = done.said if done.code else differences(wanted, contents(clone))
        for row in rows[first:]:
            row["differs"] = differs
        say(f"complete after {len(rows) - first} kills: {differs or 'the same'}")
        if done.code or len(rows) >= kills:
            break
        first = len(rows)
        begin_anew(clone)
    attrs = {"seed": seed, "files": len(wanted), "wall": undisturbed.seconds}
    return table("kills", "kill", rows, attrs)


def configure(clone: Path) -> None:
    """Make the small configuration without studies that of `make all`."""
    folder = clone / "workflow" / "config"
    config = yaml.safe_load((folder / "quick.yaml").read_text(encoding="utf-8"))
    config["studies"] = dict.fromkeys(config["studies"])
    (folder / "paper.yaml").write_text(yaml.safe_dump(config, allow_unicode=True), encoding="utf-8")


def begin_anew(clone: Path) -> None:
    """Remove everything that was made, also what Snakemake knows about it."""
    shutil.rmtree(clone / ".snakemake", ignore_errors=True)
    for git in (["clean", "-xdfq"], ["checkout", "--quiet"]):
        subprocess.run(["git", *git, "--", *MADE], cwd=clone, check=True)


def start(
    command: list[str], folder: Path, moment: float | None = None, number: signal.Signals = signal.SIGKILL
) -> Start:
    """Run a command in a folder, and send a signal to all of its processes at a ``moment``, s, if it runs then."""
    printed = folder / "printed"
    began = perf_counter()
    with printed.open("wb") as log:
        process = subprocess.Popen(command, cwd=folder, stdout=log, stderr=subprocess.STDOUT, start_new_session=True)
        try:
            code: int | None = process.wait(moment)
        except subprocess.TimeoutExpired:
            code = None
        seconds = perf_counter() - began
        text = printed.read_text(encoding="utf-8", errors="replace")
        if code is None:
            end(process, number)
    left = sum(1 for made in MADE for _ in (folder / made).rglob(HALF_WRITTEN))
    return Start(code, seconds, under_way(text), left, " | ".join(text.splitlines()[-5:])[-500:])


def end(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    """Send a signal to the group of processes that one leads, and wait until none of them is left.

    Raises RuntimeError: some are left after :data:`LONGEST`; they have been killed.
    """
    os.killpg(process.pid, number)
    until = monotonic() + LONGEST
    while monotonic() < until:
        process.poll()  # what has ended stays in its group until it is waited for
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return
        sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    raise RuntimeError(f"the run did not end within {LONGEST:g} s after {number.name}")


def under_way(printed: str) -> str:
    """The rules whose jobs were started and have not finished, by what Snakemake printed."""
    waiting = _STARTED.findall(printed)
    for name in _FINISHED.findall(printed):
        waiting.remove(name)
    return ", ".join(sorted(waiting)) or "no job"


def contents(folder: Path) -> dict[str, str]:
    """Digests of all files that the chain makes, run times apart: bytes, and the content of netCDF files."""
    paths = (path for made in MADE for path in sorted((folder / made).rglob("*")) if path.is_file())
    found = {path.relative_to(folder): path for path in paths}
    return {str(name): _digest(path) for name, path in found.items() if name.parts[1] not in APART}


def _digest(path: Path) -> str:
    whole = path.read_bytes()
    if path.suffix == ".nc":
        try:
            data = untimed(store.read(path))
            data.attrs.pop("seconds", None)
            whole = json.dumps(data.to_dict(), sort_keys=True, default=str).encode()
        except InvalidInputError:  # damaged
            pass
    return hashlib.sha256(whole).hexdigest()


def differences(wanted: dict[str, str], found: dict[str, str]) -> str:
    """Names of the files that are not the same, or only on one side."""
    return ", ".join(sorted({name for name, _ in wanted.items() ^ found.items()}))

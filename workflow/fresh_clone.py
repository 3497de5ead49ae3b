"""Whole runs in a fresh clone of what is committed: timed from cold, the checks, killed; and the clone's wheel.

``python workflow/fresh_clone.py cold_run|ci_run|kills|wheels CORES`` stores what it finds in ``results/studies``.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import xarray as xr

from evidence import ATTRIBUTE, ROOT, evidence
from stripfold.files import store
from studies import STUDIES, cold_run, kills, wheels

name, cores = sys.argv[1], int(sys.argv[2])
study = STUDIES[name]
# Before the run: what is committed meanwhile is not what ran.
found = evidence(study.call, {}, [], study.files)
commands = {"cold_run": ["snakemake", "all", "--cores", str(cores)], "ci_run": ["bash", ".ci/run"]}


def timed(clone: Path) -> xr.Dataset:
    """Time a whole run or the checks."""
    environment = os.environ | ({"PYTHONPATH": str(clone / "src")} if name == "cold_run" else {})
    began = perf_counter()
    with (clone / "printed").open("w+", encoding="utf-8") as printed:
        subprocess.run(commands[name], cwd=clone, env=environment, check=True, stdout=printed)
        wall = perf_counter() - began
        printed.seek(0)
        sections = printed.read()
    if name == "cold_run":
        return cold_run.of_benchmarks(clone / "results" / "benchmarks", wall, cores)
    return cold_run.of_sections(sections, wall, cores)


# Beside this clone, so that what lies beside it is found.
with tempfile.TemporaryDirectory(dir=ROOT.parent) as folder, tempfile.TemporaryDirectory() as outside:
    clone = Path(folder)
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
    if name == "wheels":
        data = wheels.run(clone, Path(outside), cores, print)
    elif name == "kills":
        data = kills.run(clone, cores, print)
    else:
        data = timed(clone)
    stamped = data.assign_attrs({ATTRIBUTE: json.dumps(found, sort_keys=True)})
    store.write(stamped, ROOT / f"results/studies/{name}.nc", title=study.title, config={"cores": cores})

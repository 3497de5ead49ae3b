"""All commands by the wheel in clean environments, with the lowest versions that it allows and with the newest."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import xarray as xr
from packaging.requirements import Requirement

from stripfold.extras import MODULES
from studies.commands import COMMANDS, Outcome, run_all
from studies.common import ONE_CORE, dataset

ENVIRONMENTS = {"lowest": "lowest-direct", "newest": "highest"}
"""Name, and uv's word for the versions of the direct dependencies."""
COMPILING = 1200
"""Seconds that a command may take: the first compiles the kernels."""


def run(clone: Path, folder: Path) -> xr.Dataset:
    """Build the wheel of a clone, install it in each environment, and run all commands there, in a new ``folder``.

    Dataset over ``environment`` and ``command``: why a command did not run, empty where it did; the attributes name the
    versions of what was installed.
    """
    # Nothing of this checkout may be found.
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    line = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder)]
    subprocess.run([sys.executable, *line, str(clone)], check=True, env=clean)
    (wheel,) = folder.glob("*.whl")
    needs = dependencies(wheel)
    tools = folder / "tools"
    subprocess.run([sys.executable, "-m", "venv", str(tools)], check=True, env=clean)
    subprocess.run([str(tools / "bin/python"), "-m", "pip", "install", "--quiet", "uv"], check=True, env=clean)
    failed, versions = [], {}
    for name, resolution in ENVIRONMENTS.items():
        place = folder / name
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(place)], check=True, env=clean)
        install = ["pip", "install", "--quiet", "--python", str(place / "bin/python"), "--resolution", resolution]
        # Named beside the wheel: as its dependencies they would not be direct ones, and get the newest versions.
        uv = [str(tools / "bin/uv"), *install, str(wheel), *map(str, needs)]
        subprocess.run(uv, check=True, env=clean, cwd=folder)
        versions[name] = installed(place, [need.name for need in needs])
        (folder / f"{name}-runs").mkdir()
        outcomes = run_all(folder / f"{name}-runs", [str(place / "bin/stripfold")], clean | ONE_CORE, COMPILING)
        failed.append([reason(outcome) for outcome in outcomes])
    values = {
        "failed": (("environment", "command"), failed),
        "environment": ("environment", list(ENVIRONMENTS)),
        "command": ("command", list(COMMANDS)),
    }
    return dataset("wheels", values, versions)


def reason(outcome: Outcome) -> str:
    """Why a command did not run; empty where it did."""
    return (outcome.said.strip() or f"exit code {outcome.code}") if outcome.code else ""


def dependencies(wheel: Path) -> list[Requirement]:
    """What a wheel needs, with the optional parts that commands have, whose needs are direct ones, too."""
    (found,) = distributions(path=[str(wheel)])
    needs = [Requirement(line) for line in found.requires or []]
    extras = ("", *MODULES)
    wanted = [n for n in needs if n.marker is None or any(n.marker.evaluate({"extra": extra}) for extra in extras)]
    # Without the markers, which name the extra.
    return [Requirement(f"{need.name}{need.specifier}") for need in wanted if need.name != "stripfold"]


def installed(place: Path, names: list[str]) -> str:
    """Versions of packages in an environment."""
    (packages,) = place.glob("lib/python*/site-packages")
    there = {_plain(found.name): found.version for found in distributions(path=[str(packages)])}
    return ", ".join(f"{name} {there[_plain(name)]}" for name in names)


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")

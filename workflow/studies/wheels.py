"""All commands by the wheel in clean environments: each Python, with the lowest versions and with the newest."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import partial
from importlib.metadata import distributions
from pathlib import Path

import xarray as xr
from packaging.requirements import Requirement

from stripfold.base.extras import MODULES
from studies.commands import COMMANDS, Outcome, run_all
from studies.common import ONE_CORE, Progress, dataset, pooled

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
RESOLUTIONS = {"lowest": "lowest-direct", "newest": "highest"}
"""Name, and uv's word for the versions of the direct dependencies: of those that have a wheel for the Python."""
COMPILING = 1200
"""Seconds that a command may take: the first compiles the kernels."""


def run(clone: Path, folder: Path, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Build the wheel of a clone, install it in each environment, and run all commands there, in a new ``folder``.

    Dataset over ``environment`` and ``command``: why a command did not run, empty where it did; and the versions of
    what was installed, over ``environment``.  The attribute ``absent`` names the Pythons that are not there.
    """
    # Nothing of this checkout may be found.
    clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    line = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder)]
    subprocess.run([sys.executable, *line, str(clone)], check=True, env=clean)
    (wheel,) = folder.glob("*.whl")
    tools = folder / "tools"
    subprocess.run([sys.executable, "-m", "venv", str(tools)], check=True, env=clean)
    subprocess.run([str(tools / "bin/python"), "-m", "pip", "install", "--quiet", "uv"], check=True, env=clean)
    pythons = {version: python for version in PYTHONS if (python := interpreter(version))}
    names = [f"{version} {resolution}" for version in pythons for resolution in RESOLUTIONS]
    found = pooled(partial(_environment, wheel, tools / "bin/uv", pythons, clean), names, threads, progress)
    values = {
        "failed": (("environment", "command"), [failed for _, _, failed in found]),
        "versions": ("environment", [versions for _, versions, _ in found]),
        "environment": ("environment", names),
        "command": ("command", list(COMMANDS)),
    }
    return dataset("wheels", values, {"absent": ", ".join(version for version in PYTHONS if version not in pythons)})


def interpreter(version: str) -> str:
    """A Python of this version that runs, on the path or of pyenv; empty if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    folders = [*map(Path, os.get_exec_path()), *sorted(pyenv.glob(f"{version}.*/bin"))]
    for python in (folder / f"python{version}" for folder in folders):
        # pyenv puts scripts on the path that run only where their version is chosen.
        if python.is_file() and not subprocess.run([python, "-c", ""], capture_output=True, check=False).returncode:
            return str(python)
    return ""


def _environment(
    wheel: Path, uv: Path, pythons: dict[str, str], clean: dict[str, str], name: str
) -> tuple[str, str, list[str]]:
    """Name of an environment, the versions of what a wheel needs there, and why each command did not run there."""
    place, needs, (version, resolution) = wheel.parent / name.replace(" ", "-"), dependencies(wheel), name.split()
    subprocess.run([pythons[version], "-m", "venv", "--without-pip", str(place)], check=True, env=clean)
    # Named beside the wheel: as its dependencies they would not be direct ones, and get the newest versions.
    install = ["--python", str(place / "bin/python"), "--only-binary", ":all:", "--resolution", RESOLUTIONS[resolution]]
    line = [str(uv), "pip", "install", "--quiet", *install, str(wheel), *map(str, needs)]
    subprocess.run(line, check=True, env=clean, cwd=wheel.parent)
    runs = place / "runs"
    runs.mkdir()
    outcomes = run_all(runs, [str(place / "bin/stripfold")], clean | ONE_CORE, COMPILING)
    return name, installed(place, [need.name for need in needs]), [reason(outcome) for outcome in outcomes]


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

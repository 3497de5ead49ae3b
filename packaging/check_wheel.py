"""Run the commands by the wheel, in clean environments with the lowest and with the newest versions of what it needs.

    python packaging/check_wheel.py [FOLDER]

The wheel of what is checked out is installed for each Python that is promised and found here, once with the lowest
versions that pyproject.toml allows and once with the newest ones; each command is run there and printed with its exit
code.  The exit code is 1 where one did not run.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
RESOLUTIONS = {"lowest": "lowest-direct", "newest": "highest"}
"""uv's words for the versions of the direct dependencies."""
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
EXTRAS = ("", "completion", "plot", "vision")
STRIP = "--length 0.5 --eta-b 3780"
# In an order in which each finds what those before have written.
COMMANDS = (
    "doctor",
    f"critical {STRIP} --height 0.09 --accuracy 5e-3 --plot critical.png",
    f"critical {STRIP} --height 0.09 --model rod --second-gripper auto",
    "sweep grid.yaml --cores 2",
    "eta --fold-height 0.0272",
    "simulate scene.yaml --plot curve.png",
    "film scene.nc",
    f"path r-path {STRIP} --csv path.csv --plot path.png",
    f"plan {STRIP} --layers-may-slide --csv plan.csv --json plan.json --report plan.html",
    f"map {STRIP} --output map.nc --plot map.png",
    f"assess path.csv {STRIP} --model rod --fall --plot assessed.png",
    "record filmed.yaml",
    "calibrate filmed/calibration/camera --board chessboard --columns 8 --rows 5 --square 0.024",
    "measure filmed",
    "new scene --output new.yaml",
    "completion bash",
)
INPUTS = {
    "grid.yaml": "{length: 0.6, model: rod, height: [0.06, 0.09], eta_b: [2000, 3780]}",
    "scene.yaml": "{length: 0.5, height: 0.09, eta_b: 3780, model: rod}",
    "filmed.yaml": "{length: 0.45, speed: 0.01, filming: {size: [320, 240]}}",
}
# Nothing of this checkout may be found.
CLEAN = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}


def run(*line: str | Path, cwd: Path) -> None:
    subprocess.run([str(word) for word in line], check=True, env=CLEAN, cwd=cwd)


def dependencies(wheel: Path, python: str) -> list[str]:
    """List what the wheel needs, with its optional parts.

    They are named beside the wheel: as its dependencies they would not be direct ones, and get the newest versions.
    """
    (found,) = distributions(path=[str(wheel)])
    needs = [Requirement(line) for line in found.requires or []]
    wanted = [
        n
        for n in needs
        if n.marker is None or any(n.marker.evaluate({"extra": extra, "python_version": python}) for extra in EXTRAS)
    ]
    return [f"{need.name}{need.specifier}" for need in wanted if need.name != "stripfold"]


def check(place: Path, wheel: Path, uv: Path, python: str, resolution: str) -> list[str]:
    """Install the wheel in a new environment and run all commands; those that did not run."""
    run(uv, "venv", "--quiet", "--python", python, place, cwd=wheel.parent)
    versions = ("--only-binary", ":all:", "--resolution", resolution)
    line = ("pip", "install", "--quiet", "--python", place / "bin/python", *versions)
    run(uv, *line, wheel, *dependencies(wheel, python), cwd=wheel.parent)
    run(uv, "pip", "freeze", "--python", place / "bin/python", cwd=place)
    runs = place / "runs"
    runs.mkdir()
    for name, text in INPUTS.items():
        (runs / name).write_text(text)
    failed = []
    for command in COMMANDS:
        done = subprocess.run(
            [str(place / "bin/stripfold"), *command.split()], cwd=runs, env=CLEAN, capture_output=True, text=True
        )
        print(f"{done.returncode}  stripfold {command}", flush=True)
        if done.returncode:
            print(done.stderr, file=sys.stderr)
            failed.append(command)
    return failed


def main(folder: Path) -> int:
    """Check both ends of the allowed versions in a folder."""
    line = ("pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder)
    run(sys.executable, "-m", *line, ROOT, cwd=folder)
    (wheel,) = folder.glob("stripfold-*.whl")
    run(sys.executable, "-m", "venv", folder / "tools", cwd=folder)
    run(folder / "tools/bin/python", "-m", "pip", "install", "--quiet", "uv", cwd=folder)
    uv, failed, ran = folder / "tools/bin/uv", 0, 0
    for python in PYTHONS:
        found = subprocess.run([uv, "python", "find", "--no-python-downloads", python], env=CLEAN, capture_output=True)
        if found.returncode:
            print(f"-- Python {python} is not here")
            continue
        for name, resolution in RESOLUTIONS.items():
            print(f"-- Python {python}, {name} versions, {wheel.name}", flush=True)
            failed += len(check(folder / f"{python}-{name}", wheel, uv, python, resolution))
            ran += len(COMMANDS)
    print(f"{failed} of {ran} commands did not run")
    return int(failed > 0)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        sys.exit(main(Path(sys.argv[1]) if sys.argv[1:] else Path(made)))

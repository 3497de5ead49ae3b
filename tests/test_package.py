"""The package as it is installed: whole, without its extras where it can be, and with imports that only run down."""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
import zipfile
from importlib import util
from pathlib import Path

import pytest
import yaml

from stripfold import cli
from stripfold.base import errors
from stripfold.base.errors import InvalidInputError, MissingExtraError
from stripfold.film import video

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
def test_every_file_of_the_package_is_in_the_wheel(tmp_path: Path):
    line = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", str(tmp_path)]
    # From a copy: a build leaves files beside the sources.
    files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    copy = tmp_path / "copy"
    for name in filter(None, files):
        if name.startswith("src/") or "/" not in name:
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (copy / name).write_bytes((ROOT / name).read_bytes())
    commit = committed(copy, "v9.8.7")
    subprocess.run([sys.executable, *line, str(copy)], check=True, cwd=tmp_path)
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.name.startswith("stripfold-9.8.7-")
    with zipfile.ZipFile(wheel) as found:
        there = {name for name in found.namelist() if name.startswith("stripfold/")}
        assert found.read("stripfold/commit.txt").decode() == f"{commit}\n"
    expected = {name.removeprefix("src/") for name in files if name.startswith("src/stripfold/")}
    assert there == expected | {"stripfold/commit.txt"}


def committed(folder: Path, tag: str = "") -> str:
    """Commit all of a folder, as a repository of its own; the commit."""
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    for line in (["init", "-q"], ["add", "."], [*who, "commit", "-qm", "all", "--allow-empty"], ["tag", tag])[
        : 3 + bool(tag)
    ]:
        subprocess.run(["git", "-C", str(folder), *line], check=True)
    head = subprocess.run(["git", "-C", str(folder), "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    return head.stdout.strip()


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    found = util.find_spec
    monkeypatch.setattr(errors, "find_spec", lambda name: None if name == "av" else found(name))
    with pytest.raises(MissingExtraError, match=r"stripfold\[vision\]"):
        errors.require("vision")
    assert cli.main(["film", "result.nc"]) == 2
    assert 'pip install "stripfold[vision]"' in capsys.readouterr().err
    monkeypatch.setattr(errors, "find_spec", lambda name: None if name == "matplotlib" else found(name))
    line = ["critical", "--model", "elastica", "--length", "0.6", "--eta-b", "3780", "--height", "0.09"]
    assert cli.main([*line, "--plot", "p.png"]) == 2
    assert 'pip install "stripfold[plot]"' in capsys.readouterr().err


def test_what_needs_no_extra():
    """In a process in which the optional modules cannot be imported."""
    blocked = [module for modules in errors.MODULES.values() for module in modules]
    names = ("ask.strip", "ask.sweep", "cli", "ask.collapse", "film.eta")
    code = f"import sys; sys.modules |= dict.fromkeys({[*blocked, 'snakemake']!r})\n"
    code += "\n".join(f"import stripfold.{name}" for name in names)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_other_packages_need_the_same():
    """The conda recipe has the bounds of pyproject.toml; some packages have another name there."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    recipe = yaml.safe_load((ROOT / "packaging/recipe.yaml").read_text())
    names = {"matplotlib": "matplotlib-base", "opencv-python-headless": "py-opencv", "netCDF4": "netcdf4"}

    def there(required: list[str]) -> set[str]:
        pairs = [text.split(">=") for text in required if "[" not in text]
        return {f"{names.get(name, name)} >={bound}" for name, bound in pairs}

    extras_ = project["optional-dependencies"]
    assert set(recipe["requirements"]["run"]) == there(project["dependencies"]) | {
        f"python {project['requires-python']}"
    }
    assert set(recipe["requirements"]["run_constraints"]) == there(
        [line for name in errors.MODULES for line in extras_[name]]
    )
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"]
    assert recipe["context"]["version"] == cited


def test_every_module_can_be_imported_on_other_systems_than_linux():
    """In a process without the modules that Windows lacks."""
    code = """
import importlib, pkgutil, signal, sys
sys.modules |= dict.fromkeys(("fcntl", "grp", "pwd", "resource", "termios"))
del signal.SIGKILL
import stripfold
for module in pkgutil.walk_packages(stripfold.__path__, "stripfold."):
    if module.name != "stripfold.__main__":
        importlib.import_module(module.name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_film_elsewhere_than_on_linux_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (tmp_path / "film.mp4").write_bytes(b"film")
    monkeypatch.setattr("sys.platform", "win32")
    with pytest.raises(InvalidInputError, match="Linux"):
        video.read(tmp_path / "film.mp4")


SOURCE = Path(__file__).parents[1] / "src" / "stripfold"
SOLVERS = {"base", "files", "kernels", "elastica", "solve", "paths", "strip", "follow"}
BELOW = {
    "base": set[str](),
    "files": {"base"},
    "kernels": {"base"},
    "elastica": {"base"},
    "solve": {"base", "kernels"},
    "paths": {"base", "files", "elastica", "draw"},
    "strip": {"base", "kernels", "solve", "paths"},
    "follow": SOLVERS - {"files", "follow"},
    "draw": {"base", "files"},
    "ask": SOLVERS | {"draw"},
    "film": {"base", "files", "kernels", "elastica", "draw"},
    "synthetic": SOLVERS | {"film", "ask"},
}
"""What each folder may import; the command line and the top of the package may import all.  Figures know arrays and
files only: they stand low, and a path can draw itself."""


def arrows(source: Path) -> set[tuple[str, str]]:
    """Return pairs of folders of which a file in the first imports the second."""
    found = set()
    for file in source.rglob("*.py"):
        here = file.relative_to(source).parts[0]
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if here in BELOW else ():
            names = [item.name for item in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [f"{node.module}.{item.name}" for item in node.names]
            found |= {(here, name.split(".")[1] if "." in name else "") for name in names if name[:9] == "stripfold"}
    return {(one, other) for one, other in found if one != other}


def upwards(source: Path) -> list[tuple[str, str]]:
    return sorted((one, other) for one, other in arrows(source) if other not in BELOW[one])


def test_imports_run_down() -> None:
    assert upwards(SOURCE) == []


@pytest.mark.parametrize(
    ("line", "found"),
    [("import stripfold", ""), ("from stripfold import follow", "follow"), ("import stripfold.ask.map", "ask")],
)
def test_an_import_that_runs_up_is_found(tmp_path: Path, line: str, found: str) -> None:
    (tmp_path / "draw").mkdir()
    (tmp_path / "draw" / "figure.py").write_text(f"def f():\n    {line}\n", encoding="utf-8")
    assert upwards(tmp_path) == [("draw", found)]

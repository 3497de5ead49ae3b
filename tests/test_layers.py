"""Imports run down: each part of the package imports only parts below it, and no two import each other."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

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

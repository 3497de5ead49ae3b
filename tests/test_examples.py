"""Every example and notebook runs, alone and in a folder of its own, and stays short."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import subprocess
import sys
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from sessions import compare

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))
QUICK = {"critical_point", "model_choice", "why_it_snaps"}
"""The others take seconds each, and other tests hold their numbers."""
QUIET = {"MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def in_turn(paths: list[Path]) -> list[Any]:
    """Cases by the name of the file; most are slow tests."""
    return [pytest.param(path, id=path.stem, marks=[] if path.stem in QUICK else [pytest.mark.slow]) for path in paths]


def test_there_are_ten_short_ones():
    assert len(EXAMPLES) == 10
    for path in EXAMPLES:
        assert 20 <= len(path.read_text(encoding="utf-8").splitlines()) <= 60, path.name


@pytest.mark.parametrize("path", in_turn(EXAMPLES))
def test_it_runs(path: Path, tmp_path: Path):
    if path.stem == "dry_run":
        pytest.importorskip("mujoco")  # of the other programs' environment
    given = os.environ | QUIET
    done = subprocess.run([sys.executable, str(path)], cwd=tmp_path, env=given, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert done.stderr == ""


@pytest.mark.parametrize("path", in_turn(NOTEBOOKS))
def test_a_notebook_shows_what_its_cells_print(path: Path, tmp_path: Path):
    copy = Path(shutil.copy(path, tmp_path))
    line = [sys.executable, str(ROOT / "workflow/notebooks.py"), copy.name]
    done = subprocess.run(line, cwd=tmp_path, env=os.environ | QUIET, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(tmp_path) == [copy.name]
    pairs = zip_longest(cells(copy), cells(path))
    for now, stored in pairs:
        assert now["source"] == stored["source"]
        for output, shown in zip_longest(now.get("outputs", []), stored.get("outputs", []), fillvalue={}):
            where = f"{path.name}: python workflow/notebooks.py examples/{path.name}\n{''.join(now['source'])}"
            compare(text(output), text(shown), where, 1e-4)
            assert ("image/png" in output.get("data", {})) == ("image/png" in shown.get("data", {})), where


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_small(path: Path):
    outputs = [output.get("data", {}) for cell in cells(path) for output in cell.get("outputs", [])]
    pictures = [base64.b64decode(data["image/png"]) for data in outputs if "image/png" in data]
    assert pictures
    assert max(map(len, pictures)) < 6000
    assert path.stat().st_size < 20_000


def test_all_notebooks_are_shown_and_their_links_lead_somewhere():
    assert len(NOTEBOOKS) == 3
    site = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for path in NOTEBOOKS:
        assert f"- examples/{path.stem}.md" in site
        words = "".join("".join(cell["source"]) for cell in cells(path) if cell["cell_type"] == "markdown")
        links = re.findall(r"\]\(([^)#]+)\)", words)
        assert links
        assert all((path.parent / link).exists() for link in links)


def cells(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return found


def text(output: dict[str, Any]) -> str:
    return "".join(output.get("text", output.get("data", {}).get("text/plain", [])))

"""What is shown runs: the blocks of README and docs, page by page, and every example and notebook, alone.

All in folders of their own; examples stay short.
"""

from __future__ import annotations

import base64
import doctest
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from sessions import compare, run_session

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


@dataclass(frozen=True)
class Block:
    """A block of a page: where it begins, "python" or "console", and its lines."""

    page: str
    line: int
    language: str
    text: str


def pages() -> list[Path]:
    """The README and the pages of docs that are written by hand."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path) -> list[Block]:
    """The blocks of a page marked as ``python``, or as ``console``: commands after "$ ", and what they print.

    Blocks marked as ``sh`` and those without a mark are not run.
    """
    text = page.read_text(encoding="utf-8")
    return [
        Block(page.name, text.count("\n", 0, found.start()) + 1, found[1], found[2])
        for found in re.finditer(r"^```(python|console)\n(.*?)^```$", text, re.M | re.S)
    ]


PAGES = [page for page in pages() if blocks(page)]


def in_turn_page(page: Path) -> Any:
    """A case; what the pages on plans and robots show is like what README and tutorial do, and takes long."""
    return pytest.param(page, id=page.stem, marks=[pytest.mark.slow] if page.stem in ("plan", "robot") else [])


@pytest.mark.parametrize("page", [in_turn_page(page) for page in PAGES])
def test_a_pages_examples_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").symlink_to(ROOT / "results")
    names: dict[str, object] = {}
    for block in blocks(page):
        if block.language == "python":
            run_python(block, names)
        else:
            run_session(block.text, f"{block.page}, after line {block.line}", capsys)


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("python", "import stripfold\nstripfold.folded"),
        ("python", ">>> 1 + 1\n3\n"),
        ("console", "$ stripfold eta --fold-height 0.0272\neta_b        3784.57 m^-4 s^2\n...\n"),
        ("console", "$ stripfold eta --fold-height 0.0272\n"),
        ("console", "$ stripfold eta --fold-height 0.0272\n...\nL*           0.0300023 m\n"),
        ("console", "$ stripfold eta --fold-height 27.2\n...\n"),
        ("console", "$ stripfold eta --fold-height 27.2\n...\n$ echo $?\n0\n"),
    ],
)
def test_a_broken_one_is_found(language: str, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    block = Block("page.md", 1, language, text)
    with pytest.raises((AssertionError, AttributeError)):
        run_python(block, {}) if language == "python" else run_session(
            block.text, f"{block.page}, after line {block.line}", capsys
        )


def run_python(block: Block, names: dict[str, object]) -> None:
    """A program, or a session with ">>>"; blocks of a page share their names."""
    where = f"{block.page}, line {block.line}"
    if ">>>" not in block.text:
        exec(compile("\n" * block.line + block.text, block.page, "exec"), names)
        return
    session = doctest.DocTestParser().get_doctest(block.text, names, where, block.page, block.line)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(session, clear_globs=False).failed == 0, where
    names |= session.globs

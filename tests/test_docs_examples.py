"""What the README and the pages of docs show runs, and prints what they say: block after block, a folder per page."""

from __future__ import annotations

import doctest
import re
from dataclasses import dataclass
from pathlib import Path

import pytest

from sessions import run_session

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Example:
    """A block of a page: where it begins, "python" or "console", and its lines."""

    page: str
    line: int
    language: str
    text: str


def pages() -> list[Path]:
    """The README and the pages of docs that are written by hand."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def examples(page: Path) -> list[Example]:
    """The blocks of a page marked as ``python``, or as ``console``: commands after "$ ", and what they print.

    Blocks marked as ``sh`` and those without a mark are not run.
    """
    text = page.read_text(encoding="utf-8")
    return [
        Example(page.name, text.count("\n", 0, found.start()) + 1, found[1], found[2])
        for found in re.finditer(r"^```(python|console)\n(.*?)^```$", text, re.M | re.S)
    ]


PAGES = [page for page in pages() if examples(page)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_pages_examples_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").symlink_to(ROOT / "results")
    names: dict[str, object] = {}
    for example in examples(page):
        if example.language == "python":
            run_python(example, names)
        else:
            run_session(example.text, f"{example.page}, after line {example.line}", capsys)


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
    example = Example("page.md", 1, language, text)
    with pytest.raises((AssertionError, AttributeError)):
        run_python(example, {}) if language == "python" else run_session(
            example.text, f"{example.page}, after line {example.line}", capsys
        )


def run_python(example: Example, names: dict[str, object]) -> None:
    """A program, or a session with ">>>"; blocks of a page share their names."""
    where = f"{example.page}, line {example.line}"
    if ">>>" not in example.text:
        exec(compile("\n" * example.line + example.text, example.page, "exec"), names)
        return
    session = doctest.DocTestParser().get_doctest(example.text, names, where, example.page, example.line)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(session, clear_globs=False).failed == 0, where
    names |= session.globs

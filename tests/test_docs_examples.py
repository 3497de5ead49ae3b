"""What the README and the pages of docs show runs, and prints what they say: block after block, a folder per page."""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import pytest

from stripfold.cli import main

ROOT = Path(__file__).resolve().parents[1]
MADE = "examples.md"
"""Shows the programs of `examples`, which have a test of their own."""
NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


@dataclass(frozen=True)
class Example:
    """A block of a page: where it begins, "python" or "console", and its lines."""

    page: str
    line: int
    language: str
    text: str


def pages() -> list[Path]:
    """The README and the pages of docs that are written by hand."""
    return [ROOT / "README.md", *(page for page in sorted((ROOT / "docs").glob("*.md")) if page.name != MADE)]


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
            run_commands(example, capsys)


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
        run_python(example, {}) if language == "python" else run_commands(example, capsys)


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


def run_commands(example: Example, capsys: pytest.CaptureFixture[str]) -> None:
    """Each command with what it prints; one that fails is followed by "echo $?", or is an error."""
    status = 0
    for command, shown in session_of(example.text):
        where = f"{example.page}, after line {example.line}: {command}"
        if command == "echo $?":
            assert shown.split() == [str(status)], where
            status = 0
            continue
        assert status == 0, f"{example.page}, after line {example.line}: exit code {status} before {command}"
        status, said = run_one(command, capsys)
        compare(said, shown, where)
    assert status == 0, f"{example.page}, after line {example.line}: exit code {status} at the end\n{said}"


def session_of(text: str) -> Iterator[tuple[str, str]]:
    """Commands, without comments at their ends and line continuations, and what is shown below them."""
    for part in re.split(r"^\$ ", text, flags=re.M)[1:]:
        command, _, shown = part.replace("\\\n", " ").partition("\n")
        yield re.sub(r"\s+# .*$", "", command).strip(), shown


def run_one(command: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit code and output; a command of the package in this process, which spares its start."""
    words = shlex.split(command)
    if words[0] == "stripfold" and not {"|", ">"} & set(words):
        capsys.readouterr()
        status = main(words[1:])
        said, complaint = capsys.readouterr()
        return status, said + complaint if status else said
    given = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, shell=True, env=given, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout + (done.stderr if done.returncode else "")


def compare(said: str, shown: str, where: str) -> None:
    """Words exactly, but for where lines are broken; numbers to 1e-4, other versions of the libraries round otherwise.

    A line "..." stands for any lines; times are not compared, and estimates of errors have one to a few digits only.
    """
    pattern, lines = shown.splitlines(), said.splitlines()
    if "..." in pattern:
        first = pattern.index("...")
        last = len(pattern) - first - 1
        assert len(lines) >= first + last, f"{where}\n{said}"
        lines[first : len(lines) - last] = []
        del pattern[first]
    for line, expected in zip_longest(lines, pattern, fillvalue=""):
        assert NUMBER.sub("#", line) == NUMBER.sub("#", expected), f"{where}\n{said}"
        if line.startswith("time "):
            continue
        near = 0.1 if line.strip().startswith("error") else 1e-4
        values, quoted = ([float(x) for x in NUMBER.findall(text)] for text in (line, expected))
        assert values == pytest.approx(quoted, rel=near), f"{where}\n{line}\n{expected}"

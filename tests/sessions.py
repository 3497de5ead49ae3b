"""Sessions with the command line: commands after "$ ", and what they print below them."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path

import pytest

from stripfold.cli import main

NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")
VARYING = re.compile(r'"seconds": [0-9.e-]+, |, "stripfold_version": "[^"]*"')


def run_session(text: str, place: str, capsys: pytest.CaptureFixture[str], usual: float = 1e-4) -> None:
    """Each command with what it prints; one that fails is followed by "echo $?", or is an error."""
    status = 0
    for command, shown in session_of(text):
        where = f"{place}: {command}"
        if command == "echo $?":
            assert shown.split() == [str(status)], where
            status = 0
            continue
        assert status == 0, f"{place}: exit code {status} before {command}"
        status, said = run_one(command, capsys)
        compare(said, shown, where, usual)
    assert status == 0, f"{place}: exit code {status} at the end\n{said}"


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
        try:
            status = main(words[1:])
        except SystemExit as error:  # of argparse
            status = int(error.code or 0)
        said, complaint = capsys.readouterr()
        return status, said + complaint if status else said
    given = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, shell=True, env=given, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stdout + (done.stderr if done.returncode else "")


def compare(said: str, shown: str, where: str, usual: float) -> None:
    """Words exactly, but for where lines are broken; numbers to ``usual``, as other versions of the libraries round.

    A line "..." stands for any lines; times and versions are not compared, and estimates of errors have one to a few
    digits only.
    """
    said, shown = (VARYING.sub("", text) for text in (said, shown))
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
        near = 0.1 if line.strip().startswith(("error", "mesh", "there")) else usual
        values, quoted = ([float(x) for x in NUMBER.findall(text)] for text in (line, expected))
        assert values == pytest.approx(quoted, rel=near), f"{where}\n{line}\n{expected}"

"""What each command prints: the words of transcripts.txt, and its numbers to 1e-3."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import made_up
from sessions import run_session

TEXT = (Path(__file__).parent / "transcripts.txt").read_text(encoding="utf-8")
SESSIONS = {name: text for name, text in re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", TEXT, re.M | re.S)}


@pytest.mark.parametrize("name", SESSIONS)
def test_transcript(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    for file, text in made_up.INPUTS.items():
        (tmp_path / file).write_text(text)
    run_session(SESSIONS[name], f"transcript {name}", capsys, 1e-3)

"""Names that a library, a terminal or the system may take for something else than names."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import yaml

from stripfold.cli import main
from test_film_measure import ENTRIES


@pytest.mark.parametrize(
    "command", ["sweep grid.yaml --output o.nc", "film o.nc --output f.mp4", "film r.nc --output o.mp4"]
)
def test_a_name_that_is_not_utf8_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("grid.yaml").write_text("{length: 0.6, eta_b: 3780, height: 0.09, model: elastica}")
    name = os.fsdecode(b"\xff")
    Path(f"{name}.nc").touch()
    before = sorted(os.listdir())
    assert main(command.replace("o.", f"{name}.").split()) == 2
    assert "a path in UTF-8" in capsys.readouterr().err
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize(
    ("command", "code", "shown"),
    [
        ("path triangular --length 0.5 --eta-b 3780 --csv E.csv", 0, "written      \\x1b[31m\\nE.csv"),  # a result
        ("path triangular --length 0.5 --eta-b 3780 --csv no/E.csv", 2, "\\x1b[31m"),  # a value
        ("sweep E.yaml", 2, "\\x1b[31m E = 1 cannot be used"),  # a key
        ("sweep E.nc", 2, "\\x1b[31m"),  # an input that is missing
        ("sweep E.yaml E", 2, "unrecognized arguments: \\x1b[31m E"),
        ("measure E", 2, "\\x1b[31m"),
    ],
)
def test_no_name_commands_the_terminal(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
    code: int,
    shown: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    name = "\x1b[31m\nE"
    Path(f"{name}.yaml").write_text(yaml.safe_dump({name: 1}))
    try:
        found = main([word.replace("E", name) for word in command.split()])
    except SystemExit as ended:
        found = ended.code
    out, err = capsys.readouterr()
    assert found == code
    assert shown in out + err
    assert "\x1b" not in out + err


STRIP = "--length 0.5 --eta-b 3780"


@pytest.mark.parametrize(
    "command",
    [
        "film N",
        "sweep N",
        "measure N",
        f"assess N {STRIP}",
        f"assess path.csv {STRIP} --columns N,x,z",
        f"assess path.csv {STRIP} --columns {'1' * 5000},x,z",
        f"assess path.csv {STRIP} --film N.mp4",
        f"map {STRIP} --plot N.png",
        f"plan {STRIP} --json N.json",
        "measure .",
    ],
)
def test_a_name_that_cannot_be_one_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("path.csv").write_text("t,x,z\n0,-0.25,0\n1,0.25,0\n")
    described = ENTRIES | {"video": "a\0b"}
    Path("recording.yaml").write_text(yaml.safe_dump(described))
    assert main(command.replace("N", "a\0b").split(" ")) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert " cannot be used; allowed: " in err
    assert len(err) < 1000

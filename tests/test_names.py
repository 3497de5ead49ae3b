"""Names that a library, a terminal or the system may take for something else than names."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from test_vision_recording import ENTRIES

import made_up
from stripfold.base.validation import read_yaml
from stripfold.cli import main
from stripfold.draw import film
from stripfold.draw.save import save_as
from stripfold.draw.style import figure
from stripfold.files import schema, store
from stripfold.files.tables import read_table
from stripfold.film import video
from stripfold.synthetic.scene import Filming
from stripfold.synthetic.video import encode

HOSTILE = {
    "protocol": "a:b",
    "address": "http:",
    "chained address": "a::b",
    "option": "-y",
    "home": "~",
    "number": "%d",
    "braces": "{1}",
    "glob": "[a]*?",
    "quotes": "a'b\"c",
    "lines": "a\nb",
    "not ASCII": "Gewebe_é_布",
    "long": "a" * 200,
    "blanks": " a b",
    "shell": "$a`b`",
    "escape": "\x1b[31m",
}


def netcdf(name: str) -> None:
    store.write(schema.dataset({"lambda_c": ((), 0.3)}), f"{name}.nc", title="made up")
    assert float(store.read(f"{name}.nc").lambda_c) == 0.3


def drawn_film(name: str) -> None:
    film.film(made_up.collapse(), f"{name}.mp4")
    with video.read(f"{name}.mp4") as frames:
        assert len(list(frames)) > 1


def recorded_film(name: str) -> None:
    filming = Filming(size=(64, 64))
    encode(Path(f"{name}.mkv"), [np.zeros((64, 64), np.uint8)] * 2, [0, 33], filming, False)
    with video.read(f"{name}.mkv") as frames:
        assert len(list(frames)) == 2


def frames(name: str) -> None:
    Path(name).mkdir()
    Image.new("L", (64, 64)).save(Path(name, f"{Path(name).name}.png"))
    Path(f"{name}.csv").write_text("frame,t\n0,0\n")
    with video.read(name, f"{name}.csv") as frames:
        assert len(list(frames)) == 1


def drawing(name: str) -> None:
    save_as(figure(1.0), f"{name}.png")


def tables(name: str) -> None:
    Path(f"{name}.csv").write_text("t,x,z\n0,0,0\n")
    assert read_table("path", Path(f"{name}.csv"), "t,x,z", (1, 1)).numbers().shape == (1, 3)
    store.write_text("a: 1", f"{name}.yaml")
    assert read_yaml(f"{name}.yaml", "file", "a: 1") == {"a": 1}


@pytest.mark.parametrize("name", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize("use", [netcdf, drawn_film, recorded_film, frames, drawing, tables])
def test_a_relative_name_is_a_name_to_all_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, use: Callable[[str], None], name: str
) -> None:
    monkeypatch.setattr(film, "FPS", 1)
    monkeypatch.chdir(tmp_path)
    Path(name).mkdir()
    use(f"{name}/{name}")
    assert os.listdir() == [name]


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

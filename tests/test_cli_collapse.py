"""`stripfold simulate` and `stripfold film`: files written whole or not at all, errors in one line."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from stripfold.cli import main
from stripfold.files import store

SCENE = "length: 0.3\nheight: 0.054\neta_b: 3780.0\ndisturbance: 0.01\nair: 5.0\nuntil: touch\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a scene in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "strip.yaml").write_text(SCENE)
    return tmp_path


@pytest.mark.slow
def test_simulate_and_film(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "strip.yaml", "--plot", "strip.png"]) == 0
    out = capsys.readouterr().out
    data = store.read(here / "strip.nc", require=["phase", "x", "z", "closing", "touch_time"])
    said = dict(line.split(maxsplit=1) for line in out.splitlines())
    assert said["lambda_c"].startswith(f"{float(data['lambda_c']):.6g} m ")
    assert said["touch"] == f"after {float(data['touch_time']):.4g} s at x = {float(data['touch_x']):.4g} m"
    assert said["rest"] == "-"
    assert np.isnan(float(data["settle_time"]))
    assert list(dict.fromkeys(data["phase"].values)) == ["before", "fall"]
    assert data.attrs["end"] == "first touch"
    assert '"until": "touch"' in data.attrs["config"]
    assert main(["film", "strip.nc", "--output", "release.mp4", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["written"], said["inputs"]) == ("release.mp4", {"result": "strip.nc"})
    assert (here / "release.mp4").stat().st_size > 10_000
    assert sorted(os.listdir(here)) == ["release.mp4", "strip.nc", "strip.png", "strip.yaml"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["simulate", "nowhere.yaml"], "nowhere.yaml"),
        (["simulate", "strip.yaml", "--output", "strip.txt"], "ends in .nc"),
        (["simulate", "strip.yaml", "--output", "no/such/strip.nc"], "existing folder"),
        (["simulate", "strip.yaml", "--plot", "strip.pdf"], "ends in .png"),
        (["film", "nowhere.nc"], "nowhere.nc"),
        (["film", "strip.yaml"], "netCDF"),
        (["film", "strip.nc", "--output", "film.gif"], "ends in .mp4"),
    ],
)
def test_bad_input(here: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], says: str) -> None:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert says in captured.err
    assert os.listdir(here) == ["strip.yaml"]


def test_a_scene_that_is_too_short(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "strip.yaml").write_text(SCENE.replace("0.3", "0.1"))
    assert main(["simulate", "strip.yaml"]) == 2
    assert "length = 0.1" in capsys.readouterr().err

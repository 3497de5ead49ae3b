"""`stripfold new`: each file that it writes is read by its commands as it is, and says the true defaults."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import Any

import pytest
import yaml

from stripfold.ask.inputs import Scene, Simulation
from stripfold.cli import main
from stripfold.film import recording
from stripfold.synthetic import scene as synthetic

ROOT = Path(__file__).resolve().parents[1]
FILMED = "filming: {size: [160, 120], frame_rate: 5.0, views: 4}\nspeed: 0.03\nmotion: {before: 0.008, after: 0.3}\n"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(kind: str, name: str) -> str:
    assert main(["new", kind, "--output", name]) == 0
    return Path(name).read_text(encoding="utf-8")


def test_its_files_are_read_by_their_commands(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = written("scene", "scene.yaml")
    Path("fast.yaml").write_text(scene + "model: rod\nuntil: touch\n", encoding="utf-8")
    assert main(["simulate", "fast.yaml"]) == 0
    Path("filmed.yaml").write_text(scene + FILMED, encoding="utf-8")
    assert main(["record", "filmed.yaml", "--quiet"]) == 0
    description = written("recording", "new.yaml").replace("speed: 0.002", "speed: 0.03")
    (here / "filmed" / "recording.yaml").write_text(description, encoding="utf-8")
    assert recording.read("filmed").entries.strip.length == 0.45
    Path("fast.yaml").write_text(written("grid", "grid.yaml").replace("rod ", "elastica "), encoding="utf-8")
    capsys.readouterr()
    assert main(["sweep", "fast.yaml", "--cores", "1"]) == 0
    assert "cases        8" in capsys.readouterr().out


def optional(text: str) -> dict[str, Any]:
    return dict(yaml.safe_load("\n".join(re.findall(r"^ *#: (.*)$", text, re.M))))


def test_what_may_be_left_out_is_the_default(here: Path) -> None:
    scene = written("scene", "scene.yaml")
    given = yaml.safe_load(scene)
    _, simulated, filmed = re.split(r"^# For .* only.*$", scene, flags=re.M)
    assert Simulation(**given, **optional(simulated)).as_config() == Simulation(**given).as_config()
    assert synthetic.Scene(**given, **optional(filmed)).as_config() == synthetic.Scene(**given).as_config()
    for key, value in optional(written("grid", "grid.yaml")).items():
        assert Scene.model_fields[key].default == value
    text = written("recording", "recording.yaml")
    whole = yaml.safe_load(text.replace("#: ", ""))
    assert recording.Entries(**whole).strip.rho_a == 0.2
    shown = (ROOT / "docs/measuring.md").read_text(encoding="utf-8")
    assert textwrap.indent(text.split("\n\n", 1)[1], "    ") in shown


def test_nothing_is_overwritten(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.yaml").write_text("mine", encoding="utf-8")
    assert main(["new", "scene", "--output", "scene.yaml"]) == 2
    assert "a file that is not there yet" in capsys.readouterr().err
    assert Path("scene.yaml").read_text(encoding="utf-8") == "mine"
    assert main(["new", "grid"]) == 0
    assert "length: 0.6" in capsys.readouterr().out


def test_a_collapse_is_asked_for_by_a_file_or_by_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--length", "0.3", "--eta-b", "3780", "--height", "0.054", "--model", "rod"]
    assert main(["simulate", *options, "--output", "options.nc"]) == 0
    said = capsys.readouterr().out
    Path("scene.yaml").write_text("{length: 0.3, eta_b: 3780, height: 0.054, model: rod}", encoding="utf-8")
    assert main(["simulate", "scene.yaml", "--output", "options.nc"]) == 0
    assert capsys.readouterr().out == said
    for arguments, says in (
        (["scene.yaml", "--length", "0.3"], "length = 0.3 cannot be used; allowed: a scene, or options"),
        ([], "scene is missing; allowed: SCENE.yaml, or --length"),
        (options[:-4], "height is missing"),
    ):
        assert main(["simulate", *arguments]) == 2
        assert says in capsys.readouterr().err

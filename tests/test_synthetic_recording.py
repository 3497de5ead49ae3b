"""Synthetic recordings: their motions, folders and scenes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from stripfold.base.errors import InvalidInputError
from stripfold.film.recording import Entries
from stripfold.synthetic import shapes
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor

SMALL = {
    "filming": {"size": [320, 240], "frame_rate": 20.0, "dropped": 0.06, "doubled": 0.1, "log_offset": 12.5},
    "speed": 0.02,
    "motion": {"before": 0.008, "after": 0.5},
    "seed": 3,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scene = Scene(**SMALL)
    path = tmp_path_factory.mktemp("synthetic") / "small"
    write_recording(history_of(scene), scene, path)
    return path


def test_a_folder_can_be_read_and_says_that_it_is_synthetic(folder: Path) -> None:
    config = yaml.safe_load((folder / "recording.yaml").read_text(encoding="utf-8"))
    Entries.of(config)
    assert config["synthetic"] is True
    assert "synthetic" in config["title"]
    named = [config["video"], config["robot_log"], config["plane"]["image"], config["robot"]["grid"]]
    assert all((folder / name).is_file() for name in named)
    assert len(list((folder / config["camera"]["images"]).glob("*.png"))) == 10
    grid = (folder / config["robot"]["grid"]).read_text(encoding="utf-8").splitlines()
    assert grid[0] == "image,x,z"
    assert all((folder / "calibration" / row.split(",")[0]).is_file() for row in grid[1:])
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    assert truth["synthetic"] is True
    assert sorted(path.name for path in folder.parent.iterdir()) == ["small"]  # no temporary folders


def test_the_same_seed_gives_the_same_recording(folder: Path, tmp_path: Path) -> None:
    scene = Scene(**SMALL)
    history = history_of(scene)
    write_recording(history, scene, tmp_path / "again", folder / "calibration")
    for name in ("video.mkv", "robot.csv", "truth.json", "recording.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes(), name
    pictures = [
        Sensor(Renderer(one, history.curve[0]), 1.0, np.random.default_rng(1)).exposed(history, 0.5)
        for one in (scene, Scene(**{**SMALL, "seed": 4}))
    ]
    assert not np.array_equal(*pictures)


def test_an_existing_folder_is_left_alone(folder: Path) -> None:
    scene = Scene(**SMALL)
    with pytest.raises(InvalidInputError, match="not there yet"):
        write_recording(shapes.history(scene), scene, folder)

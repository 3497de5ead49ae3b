"""Synthetic recordings: their motions, folders and scenes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import odeint

from stripfold import cli
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.files import store
from stripfold.film.recording import Entries
from stripfold.synthetic import shapes
from stripfold.synthetic.laws import solve
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene, ShapesMotion
from stripfold.synthetic.sensor import Sensor


@pytest.mark.parametrize(
    ("law", "inertia"), [("parabolic", 0.07), ("parabolic", 0.0), ("cubic", 0.05), ("power", 0.05)]
)
def test_motion_laws_against_another_integrator(law: str, inertia: float) -> None:
    motion = ShapesMotion(law=law, before=0.01, after=0.6, inertia=inertia, drag=0.1, cubic=0.4, exponent=0.42)
    found = solve(motion, 0.3, 0.03, 0.01)
    assert found.onset is not None
    assert found.touch is not None
    # lambda by hand: at rest for 0.3 s, a cosine ramp of 0.2 s, then the speed.
    assert float(np.interp(found.onset, found.t, found.advance)) == pytest.approx(0.3, abs=1e-7)
    assert found.onset == pytest.approx(0.3 + 0.1 + 1.0, abs=1e-9)

    def advance(t: float) -> float:
        share = min(max((t - 0.3) / 0.2, 0.0), 1.0)
        ramp = 0.1 * (share - np.sin(np.pi * share) / np.pi)
        return 0.29 + 0.01 * (ramp + max(t - 0.5, 0.0))

    def rates(y: Array, t: float) -> list[float]:
        mu = (0.3 - advance(t)) / 0.03
        push = {
            "parabolic": y[0] ** 2 - 0.36 * mu,
            "cubic": y[0] ** 2 + 0.4 * y[0] ** 3 - 0.36 * mu,
            "power": abs(y[0]) ** (1 / 0.42) - 0.6 ** (1 / 0.42) * mu,
        }[law]
        if inertia == 0.0:
            return [push / 0.1, 0.0]
        return [y[1], (push - 0.1 * y[1]) / inertia**2]

    if law == "parabolic":
        assert found.q[0] == pytest.approx(-0.6 * np.sqrt(1 / 3))
    if law == "power":
        assert found.q[0] == pytest.approx(-0.6 * (1 / 3) ** 0.42)
    assert rates(np.array([found.q[0], 0.0]), 0.0)[1 if inertia else 0] == pytest.approx(0.0, abs=1e-8)
    before = found.t < found.touch
    again = odeint(rates, [found.q[0], 0.0], found.t[before], rtol=1e-9, atol=1e-11, hmax=0.01)
    np.testing.assert_allclose(found.q[before], again[:, 0], atol=2e-5)
    assert np.all(found.q[~before] == 1.0)
    assert found.q[before][-1] > 0.9
    assert found.advance[-1] - found.advance[-2] == pytest.approx(0.0, abs=1e-9)  # stopped


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


def test_truth_of_a_folder(folder: Path) -> None:
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    data = store.read(folder / "truth.nc")
    advance, t = data["advance"].values, data["time"].values
    events = truth["events"]
    assert events["onset"]["lambda"] == pytest.approx(truth["lambda_c"], abs=1e-6)
    for moment in events.values():
        assert moment["lambda"] == pytest.approx(np.interp(moment["t"], t, advance), abs=1e-9)
    assert events["onset"]["t"] < events["fall"]["t"] < events["fastest"]["t"] <= events["touch"]["t"]
    assert data["curve"].shape == (len(t), 100, 2)
    speed = np.linalg.norm(np.gradient(data["curve"].values.astype(float), t, axis=0), axis=2).max(axis=1) - 0.02
    top, start = (np.interp(events[name]["t"], t, speed) for name in ("fastest", "fall"))
    assert top == pytest.approx(speed[t <= events["touch"]["t"]].max(), rel=0.01)
    assert start == pytest.approx(0.25 * top, rel=0.1)
    log = np.loadtxt(folder / "robot.csv", delimiter=",", skiprows=1)
    assert np.abs(log[:, 1] - np.interp(log[:, 0] - 12.5, t, data["gripper"].values[:, 0])).max() < 1e-4
    assert log[:, 1].std() > 1e-3


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


@pytest.mark.parametrize(
    ("given", "key", "says"),
    [
        ({"film": {}}, "film", "did you mean filming"),
        ({"filming": {"frame_rte": 30}}, "filming.frame_rte", "did you mean frame_rate"),
        ({"filming": {"frame_rate": "fast"}}, "filming.frame_rate", "a number"),
        ({"filming": {"frame_rate": float("nan")}}, "filming.frame_rate", "a number"),
        ({"filming": {"size": [320]}}, "filming.size", "a list of 2"),
        ({"filming": {"size": [321, 240]}}, "filming.size", "even"),
        ({"filming": {"size": [1e9, 240]}}, "filming.size[0]", "whole"),
        ({"filming": {"codec": "h264"}}, "filming.codec", "ffv1, mjpeg, mpeg4"),
        ({"filming": {"codec": "mpeg4", "container": "mkv"}}, "filming.container", "mp4"),
        ({"filming": {"codec": "mjpeg", "container": "avi", "jitter": 0.1}}, "filming.container", "timestamps"),
        ({"filming": [1]}, "filming", "keys and values"),
        ({"length": -1}, "length", "from 0.05"),
        ({"height": 0.5}, "height", "L"),
        ({"strip": {"length": 0.4}}, "strip.length", "write length: 0.4"),
        ({"gripper": {"speed": 0.4}}, "gripper.speed", "speed beside gripper, not in it"),
        ({"gripper": {"marker": 3.5}}, "gripper.marker", "whole"),
        ({"generator": "magic"}, "generator", "shapes, dynamics"),
        ({"motion": 3}, "motion", "keys and values"),
        ({"seed": -1}, "seed", "from 0"),
    ],
)
def test_bad_scenes(given: dict[str, object], key: str, says: str) -> None:
    with pytest.raises(InvalidInputError, match=says) as caught:
        Scene(**given)
    assert caught.value.key == key


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    given = {"filming": {"size": [160, 120], "frame_rate": 5.0, "views": 4}, "speed": 0.03}
    Path("own.yaml").write_text(yaml.safe_dump({**given, "motion": {"before": 0.008, "after": 0.3}}), encoding="utf-8")
    assert cli.main(["record", "own.yaml"]) == 0
    said = capsys.readouterr().out
    assert "synthetic" in said
    assert "of the drawn motion" in said
    assert (tmp_path / "own/recording.yaml").is_file()
    assert cli.main(["record", "own.yaml"]) == 2
    assert "not there yet" in capsys.readouterr().err
    assert cli.main(["record", "own.yaml", "--output", "again", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    truth = json.loads(Path("again/truth.json").read_text(encoding="utf-8"))
    assert said["lambda_c"] == pytest.approx(truth["lambda_c"])
    assert said["written"] == "again"
    assert said["inputs"]["motion"]["before"] == 0.008
    assert said["units"]["duration"] == "s"
    assert said["stripfold_version"]
    assert cli.main(["record", "own.yaml", "--output", "no/such/folder"]) == 2
    assert cli.main(["record", "none.yaml"]) == 2

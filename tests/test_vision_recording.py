"""The folder of a recording: what is taken, and what each thing that is wrong with it is called."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
import yaml

from stripfold.base.errors import InvalidInputError
from stripfold.base.validation import MOST_BYTES
from stripfold.cli import main
from stripfold.film import recording

ENTRIES: dict[str, Any] = {
    "title": "a made-up strip",
    "strip": {"length": 0.3, "eta_b": 3780.0},
    "gripper": {
        "height": 0.09,
        "speed": 0.005,
        "flat_end": 0.1,
        "marker": {"dictionary": "4x4_50", "id": 3, "size": 0.02, "offset": [0.0, -0.02]},
    },
    "video": "video.mkv",
    "camera": {"images": "camera", "board": {"type": "chessboard", "columns": 9, "rows": 6, "square": 0.025}},
    "plane": {
        "image": "plane.png",
        "board": {
            "type": "charuco",
            "columns": 5,
            "rows": 7,
            "square": 0.04,
            "marker": 0.02,
            "dictionary": "6x6_250",
        },
    },
    "robot": {"grid": "stops/robot.csv"},
}


def entries_with(path: str, value: Any) -> dict[str, Any]:
    """A copy with one entry changed, or removed where the value is None."""
    changed = deepcopy(ENTRIES)
    *parents, key = path.split(".")
    at = changed
    for parent in parents:
        at = at[parent]
    if value is None:
        del at[key]
    else:
        at[key] = value
    return changed


def write(folder: Path, entries: Any) -> Path:
    """A folder with all the files that the entries above name; their content does not matter here."""
    (folder / "camera").mkdir(parents=True)
    (folder / "stops").mkdir()
    for name in ("video.mkv", "plane.png", "stops/robot.csv"):
        (folder / name).touch()
    (folder / recording.NAME).write_text(yaml.safe_dump(entries), encoding="utf-8")
    return folder


def test_folder_is_read_with_defaults(tmp_path: Path) -> None:
    found = recording.read(write(tmp_path / "one", ENTRIES))
    assert found.entries.synthetic is False
    assert found.entries.gripper.direction == 1
    assert found.entries.camera.rolling_shutter == 0.0
    assert found.video == tmp_path / "one" / "video.mkv"
    assert found.robot_log is None
    assert found.timestamps is None


@pytest.mark.parametrize(
    ("path", "value", "key", "words"),
    [
        ("gripper.hight", 0.1, "gripper.hight", "did you mean height"),
        ("gripper.flat_end", 1e300, "gripper.flat_end", "from -1000 to 1000 m"),
        ("gripper.height", -0.1, "gripper.height", "greater than 0 m"),
        ("gripper.height", 12.0, "gripper.height", "less than strip.length = 0.3 m; the unit is m: is a decimal"),
        ("gripper.height", float("nan"), "gripper.height", "a number"),
        ("gripper.height", "9e-2", "gripper.height", "unless it has a point"),
        ("gripper.direction", 0, "gripper.direction", "one of 1, -1"),
        ("gripper.marker", None, "gripper.marker", "is missing"),
        ("gripper.template", {"box": [1, 2, 30, 40], "offset": [0.0, 0.0]}, "gripper.marker", "not both"),
        ("gripper.marker.offset", [0.0], "gripper.marker.offset", "2 entries"),
        ("gripper.marker.offset", [0.0, -32.0], "gripper.marker.offset[1]", "from -1 to 1 m"),
        ("gripper.marker.dictionary", "7x7", "gripper.marker.dictionary", "apriltag_36h11"),
        ("strip.eta_b", 0.1, "strip.eta_b", "it is 0.0894 L*"),
        ("strip.eta_b_interval", [4000.0, 5000.0], "strip.eta_b_interval", "around eta_b = 3780"),
        ("strip.friction_moment", 0.01, "strip.rho_a", "is missing"),
        ("strip.hysteresis", 0.01, "strip.hysteresis", "is now called friction_moment (M_0, N)"),
        ("strip.eta_b", None, "strip.eta_b", "is missing"),
        ("camera.images", None, "camera.images", "give intrinsics instead"),
        ("camera.intrinsics", "plane.png", "camera.intrinsics", "nothing together with images"),
        ("plane.board.marker", None, "plane.board.marker", "is missing"),
        ("camera.board.marker", 0.02, "camera.board.marker", "of a ChArUco board only"),
        ("plane.board.type", "circles", "plane.board.type", "chessboard, charuco"),
        ("video", "film.mp4", "video", "an existing file"),
        ("video", "../film.mp4", "video", "inside the recording"),
        ("video", "/film.mp4", "video", "inside the recording"),
        ("video", "camera", "timestamps", "beside a folder of frames"),
    ],
)
def test_error_names_the_entry(tmp_path: Path, path: str, value: Any, key: str, words: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        recording.read(write(tmp_path / "one", entries_with(path, value)))
    assert caught.value.key == key
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "keys and values"),
        (b"[1, 2]", "keys and values"),
        (b"title: [", "readable YAML"),
        (b"\xff\xfe\x00\x80", "readable YAML"),
        (b"#" * (MOST_BYTES + 1), "at most"),
        (b"title: a\nvideo: b\ntitle: c\n", "title is in lines 1 and 3"),
        (b"strip: {length: 0.42, length: 0.36}\n", "length is in lines 1 and 1"),
    ],
)
def test_unreadable_recording_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    folder = write(tmp_path / "one", ENTRIES)
    (folder / recording.NAME).write_bytes(content)
    with pytest.raises(InvalidInputError, match=words):
        recording.read(folder)


@pytest.mark.parametrize(
    "name",
    [
        recording.NAME,
        recording.ManualOnset.file_name,
        "video.mkv",
        "camera/1.png",
        "stops/robot.csv",
        "plane.png",
        "result",
    ],
)
def test_a_link_out_of_the_folder_is_refused_and_not_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    folder = write(tmp_path / "one", ENTRIES)
    other = write(tmp_path / "other", ENTRIES) / name
    secret = "key: [secret" if name.endswith(".yaml") else "secret"
    other.mkdir() if name == "result" else other.write_text(secret)
    (folder / name).unlink(missing_ok=True)
    (folder / name).symlink_to(other)
    assert main(["measure", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "a path inside the recording's folder, and no link out of it" in said
    assert "secret" not in said


def test_an_error_names_the_place_and_does_not_show_the_line(tmp_path: Path) -> None:
    (tmp_path / recording.NAME).write_text("title: secret\nstrip: [secret\n")
    with pytest.raises(InvalidInputError, match=r"expected ',' or '\]'.* in line 3, column 1") as error:
        recording.read(tmp_path)
    assert "secret" not in str(error.value)


def test_folder_without_a_recording_is_refused(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(InvalidInputError, match=r"a folder with a recording\.yaml"):
            recording.read(folder)


@pytest.mark.parametrize(("key", "value"), [("event_time", 1e300), ("sd", 1e300), ("sd", 0.0)])
def test_impossible_onset_by_hand(tmp_path: Path, key: str, value: float) -> None:
    folder = write(tmp_path / "one", ENTRIES)
    onset = {"event_time": 1.5, "sd": 0.01, "reason": "seen"} | {key: value}
    (folder / recording.ManualOnset.file_name).write_text(yaml.safe_dump(onset), encoding="utf-8")
    with pytest.raises(InvalidInputError) as caught:
        recording.read(folder)
    assert caught.value.key == f"manual_onset.yaml.{key}"

"""Odd and damaged arguments and files: every command ends with a result or with one line that names what is wrong."""

from __future__ import annotations

import contextlib
import io
import os
import re
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import cv2
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import drawn_strips as drawn
import made_up
from stripfold.cli import main

STRIP = "--length 0.5 --eta-b 3780"
CALLS = (
    f"critical {STRIP} --height 0.09 --model elastica",
    "eta --fold-height 0.0272",
    "eta --loop heart --length 0.2 --height 0.05",
    "eta --kes-b 0.05 --kes-2hb 0.03 --gsm 150",
    f"path triangular {STRIP}",
    f"path r-path {STRIP} --csv path.csv",
    f"plan {STRIP} --margin 0.01",
    "new grid --output new.yaml",
)
"""Quick calls that succeed; one word of them is then replaced."""
WORDS = (
    "",
    "nan",
    "inf",
    "-1",
    "0",
    "1e400",
    "0,5",
    "60 cm",
    "20%",
    "--",
    "-",
    "..",
    "/",
    "\x00",
    "\ud800",
    "ß²",
    "9" * 500,
)
VALUES = (
    None,
    True,
    "",
    "nan",
    float("nan"),
    float("inf"),
    -1,
    0,
    1e300,
    10**400,
    [],
    {},
    [1, 2],
    "0.5",
    "../x",
    "\x00",
)
GRID = {"length": 0.6, "model": "elastica", "height": [0.06, 0.09], "eta_b": {"from": 2000.0, "to": 4000.0, "count": 3}}
FILMED = {
    "length": 0.45, "eta_b": 3780.0, "height": 0.1, "speed": 0.01, "gripper": {"offset": [0.0, -0.03]},
    "filming": {"size": [64, 64], "frame_rate": 2.0, "codec": "mjpeg"}, "motion": {"law": "cubic", "before": 0.005},
}  # fmt: skip
RECORDING = {
    "strip": {"length": 0.45, "eta_b": 3780.0}, "video": "film.mkv", "robot": {"grid": "grid.csv"},
    "gripper": {"height": 0.1, "speed": 0.02, "flat_end": -0.2,
                "marker": {"dictionary": "4x4_50", "id": 7, "size": 0.02, "offset": [0.0, -0.03]}},
    "camera": {"images": "camera", "board": {"type": "chessboard", "columns": 8, "rows": 5, "square": 0.024}},
    "plane": {"image": "plane.png", "board": {"type": "chessboard", "columns": 8, "rows": 5, "square": 0.024}},
}  # fmt: skip
TREES = {"grid.yaml": GRID, "filmed.yaml": FILMED, "recording.yaml": RECORDING}
LINES = {
    "grid.yaml": "sweep grid.yaml --cores 1 --output o.nc",
    "filmed.yaml": "record filmed.yaml --output filmed",
    "recording.yaml": "measure .",
    "scene.yaml": "simulate scene.yaml --output o.nc",
    "path.csv": f"assess path.csv {STRIP} --model rod --columns t,x,z",
    "fold.png": "eta --image fold.png --scale 1e-4 --method fold",
    "scene.nc": "film scene.nc --output film.mp4",
    "camera": "calibrate camera --board chessboard --columns 8 --rows 5 --square 0.024",
}
"""The command that reads a file."""
few = settings(max_examples=25, derandomize=True, deadline=None, suppress_health_check=list(HealthCheck), database=None)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, bytes]:
    """Files of each kind before they are damaged."""
    folder = tmp_path_factory.mktemp("sound")
    assert main(["path", "triangular", *STRIP.split(), "--csv", str(folder / "path.csv"), "--quiet"]) == 0
    cv2.imwrite(str(folder / "fold.png"), drawn.picture(drawn.coverage(drawn.folded(60.0), 3.0, (320, 260))))
    made_up.collapse(after=False).to_netcdf(folder / "scene.nc")
    (folder / "scene.yaml").write_text(made_up.INPUTS["scene.yaml"])
    for name, tree in TREES.items():
        (folder / name).write_text(yaml.safe_dump(tree))
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def check(words: list[str]) -> None:
    """Run a command: a result of finite numbers, or an exit code and one error without a traceback."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as error:  # of argparse
            code = int(error.code or 0)
    said, complaint = out.getvalue(), err.getvalue()
    assert 0 <= code <= 6, (words, code, complaint)
    if code == 0:
        assert not re.search(r"\b(nan|inf)\b", said), (words, said)
    else:
        errors = [line for line in complaint.splitlines() if re.match(r"stripfold( \w+)?: error: \S", line)]
        assert len(errors) == 1, (words, complaint)
        assert code != 1, complaint


@pytest.fixture(autouse=True)
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@few
@given(data=st.data())
def test_arguments(data: st.DataObject):
    words = data.draw(st.sampled_from(CALLS)).split()
    at = data.draw(st.integers(1, len(words) - 1))
    words[at] = data.draw(st.sampled_from(WORDS) | st.text(max_size=8))
    if data.draw(st.booleans()):
        words += [data.draw(st.sampled_from(("--json", "--height", "--nu", "--csv", "--plot", words[-1])))]
    check(words)


@few
@given(data=st.data(), name=st.sampled_from(sorted(TREES)))
def test_values_in_yaml(data: st.DataObject, name: str, there: Path):
    tree: Any = deepcopy(TREES[name])
    at = tree
    while True:
        key = data.draw(st.sampled_from(list(at) if isinstance(at, dict) else range(len(at))))
        if not (isinstance(at[key], dict | list) and at[key] and data.draw(st.integers(0, 3))):
            break
        at = at[key]
    change = data.draw(st.sampled_from(("value", "remove", "rename")))
    if change == "value" or isinstance(at, list):
        at[key] = data.draw(st.sampled_from(VALUES) | st.text(max_size=6) | st.floats())
    else:
        value = at.pop(key)
        if change == "rename":
            at[f"{key}x"] = value
    (there / name).write_text(yaml.safe_dump(tree), encoding="utf-8", errors="surrogatepass")
    check(LINES[name].split())


@few
@given(data=st.data(), name=st.sampled_from(sorted(set(LINES) - {"camera"})))
def test_damaged_files(sound: Mapping[str, bytes], data: st.DataObject, name: str, there: Path):
    """Cut off, with bytes changed, or of other content altogether."""
    content = bytearray(sound[name])
    match data.draw(st.sampled_from(("cut", "changed", "other", "kind"))):
        case "cut":
            del content[data.draw(st.integers(0, len(content) - 1)) :]
        case "changed":
            for _ in range(data.draw(st.integers(1, 30))):
                content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        case "other":
            content = bytearray(data.draw(st.binary(max_size=200)))
        case "kind":
            content = bytearray(sound[data.draw(st.sampled_from(sorted(set(sound) - {name})))])
    (there / name).write_bytes(content)
    check(LINES[name].split())


@few
@given(content=st.binary(max_size=100))
def test_pictures_of_a_board(content: bytes, there: Path):
    (there / "camera").mkdir(exist_ok=True)
    (there / "camera" / "1.png").write_bytes(b"\x89PNG\r\n\x1a\n" + content)
    check(LINES["camera"].split())


@pytest.mark.parametrize("name", LINES)
def test_what_is_no_file(name: str, there: Path):
    """Neither a folder, a pipe nor nothing at all is waited for."""
    check(LINES[name].split())
    os.mkfifo(there / name)
    check(LINES[name].split())
    (there / name).unlink()
    (there / name).mkdir()
    check(LINES[name].split())

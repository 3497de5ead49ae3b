"""Poses for a robot, read back from each format: by its parser, or for URScript by a small interpreter."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

import stripfold as sf
from stripfold.base.arrays import Array
from stripfold.cli import main

BASE = (0.4, -0.1, 0.012, 90.0)
SPEED, ACCELERATION, JERK, TOOL = 0.1, 0.5, 5.0, 0.1


@pytest.fixture(scope="module")
def plan() -> sf.FoldingPlan:
    limits = {"acceleration": ACCELERATION, "jerk": JERK}
    return sf.Strip(length=0.26, eta_b=3770).plan(eta_b_uncertainty=0.0, tool=TOOL, cores=1, **limits)


def matrices(quaternions: Array) -> Array:
    """Rotations from (x, y, z, w), by the textbook's formula."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def rodrigues(vectors: Array) -> Array:
    """Rotations from rotation vectors."""
    found = []
    for vector in vectors:
        angle = np.linalg.norm(vector)
        x, y, z = vector / angle if angle else vector
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        found.append(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
    return np.array(found)


def from_csv(text: str) -> tuple[Array, Array, Array]:
    rows = np.loadtxt(text.splitlines(), delimiter=",", skiprows=2)
    return rows[:, 0], rows[:, 1:4], matrices(rows[:, 4:])


def from_json(text: str) -> tuple[Array, Array, Array]:
    found = json.loads(text)
    rows = np.array([found[name] for name in ("t", "x", "y", "z", "qx", "qy", "qz", "qw")]).T
    return rows[:, 0], rows[:, 1:4], matrices(rows[:, 4:])


def from_ros(text: str) -> tuple[Array, Array, Array]:
    """A trajectory_msgs/msg/MultiDOFJointTrajectory: its fields are those of the message's definition."""
    message = yaml.safe_load(text)
    assert set(message) == {"header", "joint_names", "points"}
    assert len(message["joint_names"]) == 1
    t, places, quaternions = [], [], []
    for point in message["points"]:
        assert set(point) == {"transforms", "time_from_start"}
        (transform,) = point["transforms"]
        places.append([transform["translation"][name] for name in "xyz"])
        quaternions.append([transform["rotation"][name] for name in "xyzw"])
        since = point["time_from_start"]
        assert isinstance(since["sec"], int)
        assert 0 <= since["nanosec"] < 10**9
        t.append(since["sec"] + 1e-9 * since["nanosec"])
    return np.array(t), np.array(places), matrices(np.array(quaternions))


def from_urscript(text: str) -> tuple[Array, Array, Array]:
    """What ``movel`` commands do, one after the other."""
    _, head, *moves, end = text.splitlines()
    assert (head, end) == ("def fold():", "end")
    t, poses, blends = [0.0], [], []
    for number, line in enumerate(moves):
        found = re.fullmatch(r"  movel\(p\[(.*?)\](?:, t=(\S+), r=(\S+))?\)", line)
        assert found is not None
        poses.append([float(value) for value in found[1].split(",")])
        if number:
            t.append(t[-1] + float(found[2]))
            blends.append(float(found[3]))
    apart = np.linalg.norm(np.diff(np.array(poses)[:, :3], axis=0), axis=1)
    # Two blends do not meet, and the path ends where it should.
    assert (np.array(blends)[:-1] + np.array(blends)[1:] < apart[1:]).all()
    assert blends[-1] == 0.0 < max(blends)
    return np.array(t), np.array(poses)[:, :3], rodrigues(np.array(poses)[:, 3:])


FORMATS = {"script": from_urscript, "yaml": from_ros, "json": from_json, "csv": from_csv}


@pytest.mark.parametrize(("ending", "read"), FORMATS.items(), ids=FORMATS)
def test_read_back(
    ending: str, read: Callable[[str], tuple[Array, Array, Array]], plan: sf.FoldingPlan, tmp_path: Path
) -> None:
    """The grasp lies where the plan says, the fingers point as it says, and the tool keeps the limits."""
    file = tmp_path / f"path.{ending}"
    plan.export(file, BASE)
    t, places, rotations = read(file.read_text(encoding="utf-8"))
    planned, x, z, angle = plan.waypoints.T
    np.testing.assert_allclose(t, planned, atol=1e-6 if ending == "script" else 1e-9)
    # Folding along y of the robot: x of the plan is its y.
    fingers = np.column_stack([0.0 * x, np.cos(np.deg2rad(angle)), -np.sin(np.deg2rad(angle))])
    np.testing.assert_allclose(rotations[:, :, 2], fingers, atol=1e-9)
    np.testing.assert_allclose(rotations[:, :, 1], np.tile([-1.0, 0.0, 0.0], (len(x), 1)), atol=1e-9)
    grasp = places + TOOL * fingers
    there = np.column_stack([np.full_like(x, BASE[0]), BASE[1] + x, BASE[2] + z])
    np.testing.assert_allclose(grasp, there, atol=1e-9)
    speed = np.linalg.norm(np.diff(grasp, axis=0), axis=1) / np.diff(t)
    assert speed.max() < SPEED * (1.0 + 1e-6)
    middle = 0.5 * (t[1:] + t[:-1])
    assert np.abs(np.diff(speed) / np.diff(middle)).max() < 1.1 * ACCELERATION
    along, way = t, np.append(0.0, np.cumsum(np.linalg.norm(np.diff(grasp, axis=0), axis=1)))
    for order in (1, 2, 3):  # divided differences: means of the derivative, but for its factorial
        way = np.diff(way) / (along[order:] - along[:-order])
    assert np.abs(6.0 * way).max() < 1.1 * JERK


def test_by_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["plan", "--length", "0.26", "--eta-b", "3770", "--eta-b-uncertainty", "0", "--cores", "1", "--export"]
    assert main([*command, str(tmp_path / "a.txt")]) == 2
    assert "a name that ends in .script, .yaml, .json, .csv" in capsys.readouterr().err
    for base in ("1,2,3", "0,0,0,x", "0,0,nan,0", "1000,0,0,0"):
        assert main([*command, str(tmp_path / "a.csv"), f"--base={base}"]) == 2
        assert "base" in capsys.readouterr().err
    assert main([*command[:-1], "--base=0,0,0,0"]) == 2
    assert not any(tmp_path.iterdir())
    assert main([*command, str(tmp_path / "a.script"), "--base=-0.4,0,0.1,0", "--tool", "0.05"]) == 0
    assert "a.script" in capsys.readouterr().out
    assert (tmp_path / "a.script").read_text(encoding="utf-8").startswith("# stripfold")

"""A planned path as poses of a robot's tool: URScript, a ROS 2 message, JSON or CSV (docs/robot.md)."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arguments import file_name
from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.files import store
from stripfold.paths.curve import turns
from stripfold.paths.table import CORNER

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

BLEND = 0.3
"""Radius of a blend over the distance to the nearer neighbour: less than a half, in which two would meet."""
LARGEST = 100.0
"""Largest distance of the robot's base, m."""
COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


@dataclass(frozen=True, eq=False)
class ToolPath:
    """Poses of a tool over time in the frame of a robot's base.

    ``t``: s, shape (n,), from 0 on.  ``places``: of the tool centre point, m, shape (n, 3).  ``rotations``: n of them,
    of the tool's axes: z along the fingers towards the strip, y across the strip.  ``corners``: shape (n,): whether the
    tool rests there.  ``title``: what it is, in a line.
    """

    t: Array
    places: Array
    rotations: Rotation
    corners: Mask
    title: str

    @classmethod
    def of(cls, waypoints: Array, base: Sequence[float], tool: float, title: str) -> ToolPath:
        """Make it from waypoints of a plan, shape (n, 4).

        ``base``: x, y and z of the middle of the flat strip in the frame of the robot's base, m, and the yaw of the
        direction of folding, degrees.  ``tool``: distance of the tool centre point behind the grasp, m.  Errors
        are those of :func:`base_of`.
        """
        from scipy.spatial.transform import Rotation

        *middle, degrees = base_of(base)
        t, x, z, angle = waypoints.T
        yaw = Rotation.from_euler("z", degrees, degrees=True)
        # At 0 degrees the fingers point along x, at 90 down.
        rotations = yaw * Rotation.from_euler("y", angle[:, None] + 90.0, degrees=True)
        grasp = middle + yaw.apply(np.column_stack([x, np.zeros_like(x), z]))
        fingers = rotations.apply([0.0, 0.0, 1.0])
        corners = np.pad(turns(waypoints[:, 1:3]) > CORNER, 1, constant_values=True)
        return cls(t, grasp - tool * fingers, rotations, corners, title)

    def rows(self) -> Array:
        """Time, place and quaternion, shape (n, 8), in the order of :data:`COLUMNS`."""
        return np.column_stack([self.t, self.places, self.rotations.as_quat()])

    def as_csv(self) -> str:
        """A table with a header."""
        lines = [f"# {self.title}", ",".join(COLUMNS)]
        return "\n".join(lines + [",".join(f"{value:.12g}" for value in row) for row in self.rows()]) + "\n"

    def as_json(self) -> str:
        """An object with a list for each of :data:`COLUMNS`."""
        columns = dict(zip(COLUMNS, self.rows().T.tolist(), strict=True))
        return json.dumps({"title": self.title, "units": {"t": "s", "x": "m", "y": "m", "z": "m"}, **columns}) + "\n"

    def as_ros(self) -> str:
        """The YAML of a ROS 2 message trajectory_msgs/msg/MultiDOFJointTrajectory."""
        lines = [f"# {self.title}", "header: {frame_id: base_link}", "joint_names: [tool]", "points:"]
        for t, x, y, z, *quaternion in self.rows().tolist():
            turned = ", ".join(f"{name}: {value:.12f}" for name, value in zip("xyzw", quaternion, strict=True))
            seconds, nanoseconds = divmod(round(1e9 * t), 10**9)
            lines += [
                "- transforms:",
                f"  - translation: {{x: {x:.12f}, y: {y:.12f}, z: {z:.12f}}}",
                f"    rotation: {{{turned}}}",
                f"  time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}",
            ]
        return "\n".join(lines) + "\n"

    def as_urscript(self) -> str:
        """A program for a Universal Robots controller: ``movel`` through all poses in their times, blended."""
        apart = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        blend = np.where(self.corners, 0.0, BLEND * np.minimum(np.append(apart, 0.0), np.append(0.0, apart)))
        lines = [f"# {self.title}", "def fold():"]
        places = np.column_stack([self.places, self.rotations.as_rotvec()])
        for i, place in enumerate(places):
            pose = ", ".join(f"{value:.12f}" for value in place)
            # To the start at the controller's own speed.
            timed = f", t={self.t[i] - self.t[i - 1]:.9f}, r={blend[i]:.6f}" if i else ""
            lines.append(f"  movel(p[{pose}]{timed})")
        return "\n".join([*lines, "end", ""])


FORMATS: dict[str, Callable[[ToolPath], str]] = {
    ".script": ToolPath.as_urscript,
    ".yaml": ToolPath.as_ros,
    ".json": ToolPath.as_json,
    ".csv": ToolPath.as_csv,
}


def base_of(given: str | Sequence[float]) -> tuple[float, ...]:
    """Four numbers, or a text with commas between them; raises InvalidInputError: not these, or too large ones."""
    try:
        values = tuple(float(value) for value in (given.split(",") if isinstance(given, str) else given))
    except (TypeError, ValueError):
        values = ()
    if len(values) != 4 or not np.isfinite(values).all() or max(map(abs, values[:3])) > LARGEST:
        raise InvalidInputError("base", given, f"x,y,z in m, at most {LARGEST:g}, and yaw in degrees, as 0.4,-0.1,0,90")
    return values


def checked_name(file: str | os.PathLike[str]) -> Path:
    """The name of a file with an ending that says its format; raises InvalidInputError: another ending."""
    target = file_name("export", file)
    if target.suffix not in FORMATS:
        raise InvalidInputError("export", str(file), f"a name that ends in {', '.join(FORMATS)}")
    return target


def write(path: ToolPath, file: str | os.PathLike[str]) -> None:
    """Write poses in the format that the name's ending says; errors are those of :func:`checked_name`."""
    target = checked_name(file)
    store.write_text(FORMATS[target.suffix](path), target)

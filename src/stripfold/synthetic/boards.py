"""The calibration of a synthetic filming: boards and robot stops, seen by the same camera as the strip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Filming
from stripfold.synthetic.sensor import Light, Sensor
from stripfold.synthetic.view import Rays, View, as_vector, plane_homography

COLUMNS, ROWS = 9, 6
"""Squares of a board."""
_TEXELS = 48
_MARGIN = 0.6
"""White around the squares, in squares."""
_MARKER = 0.78
"""Side of a marker of a ChArUco board, in squares."""


@dataclass(frozen=True, eq=False)
class Board:
    """A board: "chessboard" or "charuco", its squares' side in m; its origin is the squares' first corner.

    Its first axis goes to the right, its second down, as on a print.
    """

    kind: str
    square: float

    @classmethod
    def of(cls, filming: Filming) -> Board:
        """The board of a filming: about two thirds as wide as what is seen of the folding plane."""
        return cls(filming.board, round(0.075 * filming.field, 3))

    def as_config(self) -> dict[str, Any]:
        """As it stands in recording.yaml; a chessboard is told by its inner corners."""
        if self.kind == "chessboard":
            return {"type": self.kind, "columns": COLUMNS - 1, "rows": ROWS - 1, "square": self.square}
        marker = {"marker": _MARKER * self.square, "dictionary": "4x4_50"}
        return {"type": self.kind, "columns": COLUMNS, "rows": ROWS, "square": self.square, **marker}

    @cached_property
    def corners(self) -> Array:
        """Shape ((COLUMNS - 1) * (ROWS - 1), 3): inner corners, row by row, m."""
        column, row = np.meshgrid(np.arange(1, COLUMNS), np.arange(1, ROWS))
        return self.square * np.stack([column.ravel(), row.ravel(), 0.0 * row.ravel()], axis=1)

    @cached_property
    def outline(self) -> Array:
        """Shape (4, 3): corners of the sheet, m."""
        x = np.array([-_MARGIN, COLUMNS + _MARGIN])
        y = np.array([-_MARGIN, ROWS + _MARGIN])
        return self.square * np.array([[x[0], y[0], 0], [x[1], y[0], 0], [x[1], y[1], 0], [x[0], y[1], 0]])

    @cached_property
    def print(self) -> NDArray[np.float32]:
        """The squares without the margin, :data:`_TEXELS` texels per square; 255 is white."""
        if self.kind == "charuco":
            dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
            board = cv2.aruco.CharucoBoard((COLUMNS, ROWS), self.square, _MARKER * self.square, dictionary)
            drawn = board.generateImage((COLUMNS * _TEXELS, ROWS * _TEXELS), marginSize=0)
            return np.asarray(drawn, dtype=np.float32)
        row, column = np.indices((ROWS, COLUMNS))
        dark = (row + column) % 2 == 0
        return np.asarray(np.kron(np.where(dark, 0.0, 255.0), np.ones((_TEXELS, _TEXELS))), dtype=np.float32)

    def seen(self, rays: Rays, rotation: Array, translation: Array, background: Light) -> Light:
        """The board before a background, shape (height, width); its pose in the camera's frame, shapes (3, 3), (3,)."""
        u, v = rays.on_plane(plane_homography(rotation, translation))
        x, y = u / np.float32(self.square), v / np.float32(self.square)
        with np.errstate(invalid="ignore"):
            sheet = (x > -_MARGIN) & (x < COLUMNS + _MARGIN) & (y > -_MARGIN) & (y < ROWS + _MARGIN)
        columns, rows = (np.nan_to_num(value * _TEXELS - 0.5, nan=-1e6).astype(np.float32) for value in (x, y))
        grey = cv2.remap(self.print, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=255.0)
        # No print is quite black or white.
        ink = np.where(sheet, 14.0 + 0.88 * grey, 0.0).astype(np.float32)
        share = rays.averaged(sheet.astype(np.float32))
        return np.asarray(rays.averaged(ink) + (1.0 - share) * background, dtype=np.float32)


class Calibration:
    """The pictures of a calibration, and their truth.

    Parameters
    ----------
    renderer
        Draws the scene; its view is what is calibrated.
    rng
        For poses and noise.
    """

    def __init__(self, renderer: Renderer, rng: np.random.Generator) -> None:
        self.renderer, self._rng = renderer, rng
        filming = renderer.scene.filming
        self.board = Board.of(filming)
        self._sensor = Sensor(renderer, 1.0, rng)
        # Memory: 16 samples of 8 bytes per pixel, less for large pictures.
        self._rays = Rays(renderer.view.camera, 4 if filming.size[0] <= 640 else 2)

    def poses(self) -> list[tuple[Array, Array]]:
        """Poses of the board for the intrinsics: spread over the picture, tilted, wholly visible."""
        camera, rng = self.renderer.view.camera, self._rng
        filming = self.renderer.scene.filming
        size = np.array(camera.size, dtype=float)
        spots = np.array(
            [[0.5, 0.5], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.0], [0.5, 1.0], [0, 0.5], [1, 0.5]]
        )
        middle = self.board.square * np.array([COLUMNS / 2, ROWS / 2, 0.0])
        found: list[tuple[Array, Array]] = []
        reach = 0.5
        while len(found) < filming.views:
            axis = rng.uniform(0.0, 2.0 * np.pi)
            lean = np.radians(rng.uniform(15.0, 38.0)) * np.array([np.cos(axis), np.sin(axis), 0.0])
            turn = np.array([0.0, 0.0, np.radians(rng.uniform(-20.0, 20.0))])
            rotation = np.asarray(cv2.Rodrigues(lean)[0] @ cv2.Rodrigues(turn)[0])
            spot = (0.5 + reach * 2.0 * (spots[len(found) % len(spots)] - 0.5) * rng.uniform(0.8, 1.0)) * size
            depth = filming.distance * rng.uniform(0.8, 1.2)
            ray = np.append(camera.undistort(spot[None])[0], 1.0) @ np.linalg.inv(camera.matrix).T
            translation = depth * ray - rotation @ middle
            sheet = camera.project(self.board.outline, as_vector(rotation), translation)
            if np.all(sheet > 3.0) and np.all(sheet < size - 4.0):
                found.append((rotation, translation))
                reach = 0.5
            else:
                reach *= 0.997  # closer to the middle, until it fits
        return found

    def plane_pose(self) -> tuple[Array, Array]:
        """Pose of the board held upright in the folding plane, a little turned, before the camera's target."""
        view, filming = self.renderer.view, self.renderer.scene.filming
        turn = np.radians(self._rng.uniform(-3.0, 3.0))
        right = np.array([self.renderer.depth * np.cos(turn), 0.0, np.sin(turn)])
        down = np.array([self.renderer.depth * np.sin(turn), 0.0, -np.cos(turn)])
        axes = np.column_stack([right, down, np.cross(right, down)])
        middle = self.board.square * np.array([COLUMNS / 2, ROWS / 2, 0.0])
        origin = np.array([filming.target[0], 0.0, filming.target[1]]) - axes @ middle
        return view.matrix @ axes, view.matrix @ origin + view.translation

    def picture(self, rotation: Array, translation: Array) -> NDArray[np.uint8]:
        """The board in a pose, as the camera delivers it."""
        background = self.renderer.background.astype(np.float32)
        seen = self.board.seen(self._rays, rotation, translation, background)
        edge = np.linspace(self.board.outline, np.roll(self.board.outline, -1, axis=0), 20, axis=1).reshape(-1, 3)
        free = self.renderer.view.camera.project(edge, as_vector(rotation), translation)
        return self._sensor.delivered(seen, None, free)

    def stops(self) -> Array:
        """Shape (9, 2): where the marker's centre is in the pictures of the robot's stops, x and z, m."""
        filming = self.renderer.scene.filming
        tall = filming.field * filming.size[1] / filming.size[0]
        x = filming.target[0] + 0.34 * filming.field * np.array([-1.0, 0.0, 1.0])
        z = filming.target[1] + 0.31 * tall * np.array([-0.6, 0.2, 1.0])
        return np.stack([grid.ravel() for grid in np.meshgrid(x, z)], axis=1)

    def write(self, folder: Path) -> Mapping[str, Any]:
        """Write ``camera/``, ``plane.png``, ``stops/`` and ``robot.csv``; the truth of it."""
        scene = self.renderer.scene
        poses, plane, stops = self.poses(), self.plane_pose(), self.stops()
        (folder / "camera").mkdir(parents=True)
        (folder / "stops").mkdir()
        for i, pose in enumerate(poses):
            cv2.imwrite(str(folder / "camera" / f"board-{i + 1:02d}.png"), self.picture(*pose))
        cv2.imwrite(str(folder / "plane.png"), self.picture(*plane))
        said = stops + scene.filming.stop_noise * self._rng.standard_normal(stops.shape)
        lines = ["image,x,z"]
        for i, (place, told) in enumerate(zip(stops, said, strict=True)):
            seen = self.renderer.picture(None, place + scene.gripper.offset).astype(np.float32)
            cv2.imwrite(str(folder / "stops" / f"stop-{i + 1}.png"), self._sensor.delivered(seen, None))
            lines.append(f"stops/stop-{i + 1}.png,{told[0]:.6f},{told[1]:.6f}")
        (folder / "robot.csv").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        return truth_of(self.renderer.view)


def truth_of(view: View) -> dict[str, Any]:
    """The camera and its pose in the robot's frame, as plain lists."""
    return {
        "matrix": view.camera.matrix.tolist(),
        "distortion": view.camera.distortion.tolist(),
        "rotation": view.rotation.tolist(),
        "translation": view.translation.tolist(),
    }

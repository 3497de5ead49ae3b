"""The calibration of a synthetic camera: pictures of boards and of robot stops, seen by the camera of the film."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from stripfold.base.arrays import Array, Picture
from stripfold.film.boards import Board
from stripfold.synthetic.render import DICTIONARY, Renderer, divided
from stripfold.synthetic.scene import Filming
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.view import rotation_vector

Pose = tuple[Array, Array]
"""Rotation matrix and translation, m, of a board in the camera frame."""

SQUARES = (9, 6)
"""Columns and rows of a board."""
PAPER, INK = 0.935, 0.055
"""Greys of the board: no print is quite black or white."""
_POSES = np.array([[0.0, 15.0, -20.0, 0.8, 0.8], [2.0 * np.pi, 38.0, 20.0, 1.0, 1.2]])
"""Range of poses: direction of the tilt, rad; tilt and turn, degrees; shares of the reach and of the distance."""
_TRIES = 200
STOP_NOISE = 5e-5
"""Standard deviation of a place that the robot reports at a stop, m."""
_MARGIN = 0.6
"""White around the squares, in squares."""


def board_of(filming: Filming) -> Board:
    """The board of a filming: two thirds as wide as the picture in the folding plane."""
    (columns, rows), square = SQUARES, round(0.075 * filming.field, 3)
    if filming.board == "chessboard":
        return Board(type="chessboard", columns=columns - 1, rows=rows - 1, square=square)
    return Board(type="charuco", columns=columns, rows=rows, square=square, marker=0.78 * square, dictionary=DICTIONARY)


class Calibration:
    """The pictures of a calibration of the renderer's view; ``rng`` is for poses and noise.

    The origin of a board is the outer corner of its first square, its first axis to the right, its second down.
    """

    def __init__(self, renderer: Renderer, rng: np.random.Generator) -> None:
        self.renderer, self._rng = renderer, rng
        filming = renderer.scene.filming
        self.board = board_of(filming)
        size = np.array([*SQUARES, 0.0])
        self._middle = 0.5 * self.board.square * size
        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        self.outline = self._middle + self.board.square * corners * (0.5 * size + _MARGIN)
        """Shape (4, 3): corners of the sheet, m."""
        self._sensor = Sensor(renderer, 1.0, rng)

    @cached_property
    def _black(self) -> Array:
        """Shape (n, k, 3): outlines of all that is black on the board, m."""
        if self.board.type == "charuco":
            return np.concatenate([_squares(one[None, :2], one[2]) for one in self.board.black])
        squares = [(x, y) for y in range(SQUARES[1]) for x in range(SQUARES[0]) if (x + y) % 2 == 0]
        return _squares(np.array(squares) * self.board.square, self.board.square)

    def picture(self, pose: Pose) -> Picture:
        """The board in a pose, as the camera delivers it."""
        canvas = self.renderer.canvas
        canvas.clear()
        sheet = self._seen(divided(self.outline[None], 20), pose)
        canvas.polygons((sheet, PAPER), (self._seen(self._black, pose), INK))
        return self._sensor.delivered(canvas.picture, None, sheet[0])

    def _seen(self, places: Array, pose: Pose) -> Array:
        """Pixels, shape (..., 2), of places on the board, shape (..., 3), m."""
        pixels = self.renderer.view.camera.project(places.reshape(-1, 3), rotation_vector(pose[0]), pose[1])
        return pixels.reshape(*places.shape[:-1], 2)

    def poses(self) -> list[Pose]:
        """Poses of the board for the intrinsics: spread over the picture, tilted, wholly visible."""
        camera, rng, filming = self.renderer.view.camera, self._rng, self.renderer.scene.filming
        size = np.array(camera.size, dtype=float)
        spots = np.array([[0, 0], [-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [0, 1], [-1, 0], [1, 0]])
        found: list[Pose] = []
        tried = 0
        while len(found) < filming.views:
            before = rng.bit_generator.state
            axis, lean, turn, away, depth = rng.uniform(_POSES[0], _POSES[1], (_TRIES, 5)).T
            tilted = np.radians(lean)[:, None] * np.column_stack([np.cos(axis), np.sin(axis), 0.0 * axis])
            turned = np.radians(turn)[:, None] * np.array([0.0, 0.0, 1.0])
            rotation = (Rotation.from_rotvec(tilted) * Rotation.from_rotvec(turned)).as_matrix()
            # Closer to the middle, until it fits.
            reach = 0.5 * 0.997 ** (tried + np.arange(_TRIES)) * away
            spot = (0.5 + reach[:, None] * spots[len(found) % len(spots)]) * size
            translation = (filming.distance * depth)[:, None] * camera.rays(spot) - rotation @ self._middle
            corners = self.outline @ rotation.swapaxes(1, 2) + translation[:, None]
            sheet = camera.project(corners, np.zeros(3), np.zeros(3)).reshape(corners.shape[0], -1, 2)
            fits = np.flatnonzero(np.all((sheet > 3.0) & (sheet < size - 4.0), axis=(1, 2)))
            tried += _TRIES
            if len(fits):
                found.append((rotation[fits[0]], translation[fits[0]]))
                tried = 0
                # As if it had been the last that was tried.
                rng.bit_generator.state = before
                rng.random((fits[0] + 1, 5))
        return found

    def plane_pose(self) -> Pose:
        """Pose of the board held upright in the folding plane, slightly turned, at the camera's target."""
        view, (x, z), depth = self.renderer.view, self.renderer.scene.filming.target, self.renderer.depth
        turn = np.radians(self._rng.uniform(-3.0, 3.0))
        right = np.array([depth * np.cos(turn), 0.0, np.sin(turn)])
        down = np.array([depth * np.sin(turn), 0.0, -np.cos(turn)])
        axes = np.column_stack([right, down, np.cross(right, down)])
        origin = np.array([x, 0.0, z]) - axes @ self._middle
        return view.matrix @ axes, view.matrix @ origin + view.translation

    def stops(self) -> Array:
        """Shape (9, 2): x and z of the marker's centre at the robot's stops, m."""
        filming = self.renderer.scene.filming
        tall = filming.field * filming.size[1] / filming.size[0]
        x = filming.target[0] + 0.34 * filming.field * np.array([-1.0, 0.0, 1.0])
        z = filming.target[1] + 0.31 * tall * np.array([-0.6, 0.2, 1.0])
        return np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)

    def write(self, folder: Path) -> None:
        """Write ``camera/``, ``plane.png``, ``stops/`` and ``robot.csv``."""
        scene = self.renderer.scene
        poses, plane, stops = self.poses(), self.plane_pose(), self.stops()
        for name in ("camera", "stops"):
            (folder / name).mkdir(parents=True)
        for i, pose in enumerate(poses, 1):
            _write(folder / "camera" / f"board-{i:02d}.png", self.picture(pose))
        _write(folder / "plane.png", self.picture(plane))
        reported = stops * [scene.gripper.direction, 1.0] + STOP_NOISE * self._rng.standard_normal(stops.shape)
        lines = ["image,x,z"]
        for i, (place, (x, z)) in enumerate(zip(stops, reported, strict=True), 1):
            name = f"stops/stop-{i}.png"
            seen = self.renderer.picture(None, place + scene.gripper.offset)
            _write(folder / name, self._sensor.delivered(seen, None))
            lines.append(f"{name},{x:.6f},{z:.6f}")
        (folder / "robot.csv").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _write(path: Path, picture: Picture) -> None:
    """Of a full disk OpenCV would only say that it failed."""
    path.write_bytes(cv2.imencode(path.suffix, picture)[1].tobytes())


def _squares(corner: Array, side: float) -> Array:
    """Squares with their first corners at places of shape (n, 2), m, as polygons in the plane of the board."""
    corners = corner[:, None] + side * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return divided(np.pad(corners, ((0, 0), (0, 0), (0, 1))), 4)

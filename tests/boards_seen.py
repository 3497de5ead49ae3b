"""A known camera and its pictures of boards and markers, as corners with known noise or rendered."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from stripfold.base.arrays import Array
from stripfold.film.boards import Board, Corners, dictionary
from stripfold.film.calibration import Stops, View
from stripfold.film.camera import Camera
from stripfold.film.recording import Entries
from stripfold.synthetic.view import Rays

SIZE = (640, 480)
LENS = Camera(
    np.array([[610.0, 0.0, 324.0], [0.0, 608.0, 236.0], [0.0, 0.0, 1.0]]),
    np.array([-0.21, 0.07, 0.0008, -0.0005, 0.02]),
    SIZE,
)
RAYS = Rays(LENS, 2)
CHESS = Board(type="chessboard", columns=9, rows=6, square=0.025)
CHARUCO = Board(type="charuco", columns=7, rows=5, square=0.03, marker=0.022, dictionary="5x5_100")
SIDE = 0.03
"""Of the gripper's marker, m."""
# The folding plane: its frame's pose for the camera, and where the robot has the plane's origin; x to the right, z up.
PLANE_TURN, PLANE_SHIFT = np.array([-0.12, 0.05, 0.01]), np.array([-0.3, -0.2, 0.95])
ROBOT_ORIGIN = np.array([0.1, 0.42])
INK, PAPER = 25, 225


def pixels_of(places: Array, camera: Camera = LENS) -> Array:
    """Where the camera sees the robot's places, shape (n, 2), m."""
    plane = (np.reshape(places, (-1, 2)) - ROBOT_ORIGIN) * [1.0, -1.0]
    return camera.project(np.column_stack([plane, np.zeros(len(plane))]), PLANE_TURN, PLANE_SHIFT)


def poses(n: int, random: np.random.Generator, middle: Array) -> list[tuple[Array, Array]]:
    """Poses of a board, its middle in every part of the picture."""
    found = []
    for i in range(n):
        turn = random.uniform(-0.5, 0.5, 3)
        away = random.uniform(0.35, 0.6)
        x, y = (i % 3 - 1) * 0.16 * away, (i // 3 % 3 - 1) * 0.13 * away
        found.append((turn, np.array([x, y, away]) - cv2.Rodrigues(turn)[0] @ middle))
    return found


def views(n: int, noise: float, random: np.random.Generator, board: Board = CHESS) -> list[View]:
    """Views of a board whose corners are off by ``noise``, pixels, each way."""
    points = board.points
    found = []
    for i, (turn, shift) in enumerate(poses(n, random, points.mean(axis=0))):
        seen = LENS.project(points, turn, shift)
        found.append(
            View(f"{i:02d}.png", Corners(np.arange(len(points)), points, seen + random.normal(0, noise, seen.shape)))
        )
    return found


def plane_board(noise: float, random: np.random.Generator, board: Board = CHESS) -> Corners:
    """The board in the folding plane, somewhere in its middle, turned a little."""
    points = board.points * [2.0, 2.0, 1.0]
    held = points[:, :2] @ np.array([[np.cos(0.1), np.sin(0.1)], [-np.sin(0.1), np.cos(0.1)]]) + [0.1, 0.07]
    seen = LENS.project(np.column_stack([held, np.zeros(len(held))]), PLANE_TURN, PLANE_SHIFT)
    return Corners(np.arange(len(points)), points, seen + random.normal(0, noise, seen.shape))


def grid() -> Array:
    """Places, shape (9, 2), m, of the robot's stops."""
    return np.stack(np.meshgrid([0.18, 0.4, 0.62], [0.1, 0.22, 0.36]), axis=-1).reshape(-1, 2)


def square(place: Array) -> Array:
    """Corners, shape (4, 2), m, of the marker at a place: clockwise from its upper left in the picture."""
    return np.asarray(place + SIDE / 2.0 * np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]]))


def stops(noise: float, slack: float, random: np.random.Generator) -> Stops:
    """The robot's stops: corners off by ``noise``, pixels, reported places by ``slack``, m."""
    corners = np.array([pixels_of(square(place)) for place in grid()])
    corners += random.normal(0, noise, corners.shape)
    places = grid() + random.normal(0, slack, grid().shape)
    return Stops([f"{i}.png" for i in range(len(places))], corners, places, np.zeros((len(places), 60, 80), np.uint8))


def render(paper: Array, per_metre: float, turn: Array, shift: Array, random: np.random.Generator, blur: float = 0.7):
    """A picture of a flat drawing on a light ground; the corner of its first pixel is the origin of the posed frame."""
    x, y = (per_metre * value - np.float32(0.5) for value in RAYS.on_plane(cv2.Rodrigues(turn)[0], shift))
    seen = cv2.remap(paper.astype(np.float32), x, y, cv2.INTER_LINEAR, borderValue=PAPER)
    seen = cv2.GaussianBlur(RAYS.averaged(seen).astype(np.float64), (0, 0), blur) + random.normal(0.0, 1.5, SIZE[::-1])
    return np.clip(seen, 0, 255).astype(np.uint8)


def drawing(board: Board, per_metre: float, legacy: bool = False) -> tuple[Array, Array]:
    """A board's drawing and where its first corner is on it, shape (2,), m; ``legacy``: of a ChArUco's old pattern."""
    n = round(board.square * per_metre)
    if board.type == "charuco":
        charuco = board.charuco
        charuco.setLegacyPattern(legacy)
        paper = charuco.generateImage((board.columns * n, board.rows * n), marginSize=0)
        return np.where(paper > 127, PAPER, INK).astype(np.uint8), np.full(2, board.square)
    y, x = np.mgrid[0 : (board.rows + 3) * n, 0 : (board.columns + 3) * n]
    paper = np.where((x // n + y // n) % 2 == 0, INK, PAPER)
    edge = (x < n) | (y < n) | (x >= (board.columns + 2) * n) | (y >= (board.rows + 2) * n)
    return np.where(edge, PAPER, paper).astype(np.uint8), np.full(2, 2 * board.square)


def board_picture(
    board: Board, turn: Array, shift: Array, random: np.random.Generator, blur: float = 0.7, legacy: bool = False
):
    """A picture of a board, its first corner at the origin of the posed frame."""
    paper, first = drawing(board, 1600.0, legacy)
    origin = shift - cv2.Rodrigues(turn)[0] @ [*first, 0.0]
    return render(paper, 1600.0, turn, origin, random, blur)


def marker_picture(name: str, identity: int, place: Array, random: np.random.Generator):
    """A picture of the gripper's marker at a place of the robot, m."""
    cells = dictionary(name).markerSize + 2
    drawn = cv2.aruco.generateImageMarker(dictionary(name), identity, 24 * cells)
    paper = np.pad(np.where(drawn > 127, PAPER, INK).astype(np.uint8), 24, constant_values=PAPER)
    per_metre = 24 * cells / SIDE
    upper_left = (place - ROBOT_ORIGIN + np.array([-SIDE, SIDE]) / 2.0) * [1.0, -1.0] - 24 / per_metre
    shift = PLANE_SHIFT + cv2.Rodrigues(PLANE_TURN)[0] @ [*upper_left, 0.0]
    return render(paper, per_metre, PLANE_TURN, shift, random)


def write_intrinsics(path: Path, **changes: object) -> Path:
    """The camera in a file written by OpenCV, with other entries, or without those that are None."""
    entries: dict[str, object] = {"image_width": SIZE[0], "image_height": SIZE[1]}
    entries |= {"camera_matrix": LENS.matrix, "distortion_coefficients": LENS.distortion}
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in (entries | changes).items():
        if value is not None:
            storage.write(key, value)
    storage.release()
    return path


def write_folder(folder: Path, random: np.random.Generator) -> Entries:
    """Render the calibration of a recording; returns the entries of its recording.yaml."""
    for part in ("camera", "grid"):
        (folder / part).mkdir()
    for i, pose in enumerate(poses(9, random, CHESS.points.mean(axis=0))):
        cv2.imwrite(str(folder / "camera" / f"{i}.png"), board_picture(CHESS, *pose, random))
    write_intrinsics(folder / "camera.yml")
    held = Board(type="charuco", columns=7, rows=5, square=0.05, marker=0.037, dictionary="5x5_100")
    shift = PLANE_SHIFT + cv2.Rodrigues(PLANE_TURN)[0] @ [0.12, 0.08, 0.0]
    cv2.imwrite(str(folder / "plane.png"), board_picture(held, PLANE_TURN, shift, random))
    rows = ["image,x,z"]
    for i, place in enumerate(grid()):
        cv2.imwrite(str(folder / "grid" / f"{i}.png"), marker_picture("4x4_50", 7, place, random))
        rows.append(f"{i}.png,{place[0]},{place[1]}")
    (folder / "grid" / "robot.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    marker = {"dictionary": "4x4_50", "id": 7, "size": SIDE, "offset": [0.0, 0.0]}
    chess = {"type": "chessboard", "columns": 9, "rows": 6, "square": 0.025}
    return Entries(
        title="calibration",
        strip={"length": 0.3, "eta_b": 3780.0},
        gripper={"height": 0.1, "speed": 0.005, "flat_end": 0.0, "marker": marker},
        video="none",
        camera={"images": "camera", "board": chess},
        plane={"image": "plane.png", "board": held},
        robot={"grid": "grid/robot.csv"},
    )

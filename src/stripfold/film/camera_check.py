"""The calibration of a camera from a folder of pictures, reported: each picture, the numbers, accepted or refused."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, get_args

import cv2
import numpy as np

from stripfold.base.arrays import Picture
from stripfold.base.errors import CalibrationError
from stripfold.files import store
from stripfold.film import calibration
from stripfold.film.boards import Board, Dictionary, detect, dictionary, reduced
from stripfold.film.calibration import Intrinsics, View
from stripfold.film.pictures import picture_files, read_calibration_picture

MIN_MARKERS = 4
"""Markers of a dictionary in a picture from which it shows a ChArUco board."""
MIN_FIT = 3
"""Views from which a camera is fitted, to report the error of each, accepted or not."""


class Seen(NamedTuple):
    """One picture: its name, whether the board was found and, in words, what it shows otherwise.

    ``rms`` is the reprojection error of its corners, pixels, nan where there is none.
    """

    name: str
    found: bool
    words: str
    rms: float


@dataclass(frozen=True, eq=False)
class CameraCheck:
    """What a folder of pictures says of a camera: the ``camera``, or why it is refused."""

    pictures: tuple[Seen, ...]
    coverage: float
    rms: float
    camera: Intrinsics | CalibrationError

    def rows(self) -> list[tuple[str, str]]:
        """Names and values in words."""
        views = sum(seen.found for seen in self.pictures)
        shown = [
            ("result", "accepted" if isinstance(self.camera, Intrinsics) else "refused"),
            ("views", f"{views} of {len(self.pictures)} pictures  (at least {calibration.MIN_VIEWS})"),
            ("covered", f"{self.coverage:.1%} of the picture  (at least {calibration.MIN_COVERAGE:.0%})"),
        ]
        if np.isfinite(self.rms):
            shown.append(("error", f"{self.rms:.3f} px  (reprojection, RMS; at most {calibration.MAX_RMS:g})"))
        if isinstance(self.camera, Intrinsics):
            sd = self.camera.inflation * np.sqrt(np.diag(self.camera.covariance))
            values = zip(calibration.PARAMETERS, calibration.parameters(self.camera.camera), sd, strict=True)
            shown += [(name, f"{value:.6g} ± {error:.2g}") for name, value, error in values]
            shown.append(
                ("two halves", f"{self.camera.split_half:.3f} px  (difference of cameras from half the views)")
            )
        for seen in self.pictures:
            shown.append((seen.name, f"{seen.rms:.3f} px" if np.isfinite(seen.rms) else seen.words or "found"))
        return shown

    def to_dict(self) -> dict[str, Any]:
        """The numbers by name; lengths in pixels."""
        found = self.camera if isinstance(self.camera, Intrinsics) else None
        camera = None if found is None else found.camera
        return {
            "accepted": found is not None,
            "reason": "" if found is not None else str(self.camera),
            "coverage": self.coverage,
            "rms": self.rms,
            "camera_matrix": None if camera is None else camera.matrix.tolist(),
            "distortion_coefficients": None if camera is None else camera.distortion.tolist(),
            "image_size": None if camera is None else list(camera.size),
            "split_half": None if found is None else found.split_half,
            "pictures": [seen._asdict() for seen in self.pictures],
        }

    def write(self, path: Path) -> None:
        """The intrinsics as OpenCV writes them, which a recording's ``camera.intrinsics`` reads.

        Raises CalibrationError: the camera is refused.
        """
        if isinstance(self.camera, CalibrationError):
            raise self.camera
        camera = self.camera.camera
        storage = cv2.FileStorage("camera.yaml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        storage.write("image_width", camera.size[0])
        storage.write("image_height", camera.size[1])
        storage.write("camera_matrix", camera.matrix)
        storage.write("distortion_coefficients", camera.distortion)
        storage.write("avg_reprojection_error", self.rms)
        store.write_text(storage.releaseAndGetString(), path)


def check(folder: Path, board: Board) -> CameraCheck:
    """Calibrate a camera with the pictures of a board in a folder.

    Raises InvalidInputError: no such folder, or a picture that cannot be read.
    """
    pictures = [(path.name, read_calibration_picture(path)) for path in picture_files(folder, calibration.MAX_VIEWS)]
    shapes = [picture.shape for _, picture in pictures]
    height, width = max(set(shapes), key=shapes.count)
    size = width, height
    words: dict[str, str] = {}
    views: list[View] = []
    latest, larger = -1, []
    for name, picture in pictures:
        if picture.shape != (height, width):
            other = f"{picture.shape[1]} x {picture.shape[0]} pixels, the others have {width} x {height}"
            words[name] = f"from another camera, or with other settings: {other}"
            continue
        corners, numbers = detect(picture, board), _markers(picture)
        latest = max([latest, *numbers.get(board.dictionary or "", [])])
        words[name] = _other_markers(numbers, board) or ("" if corners else _shown(picture, board))
        if corners is not None and not words[name]:
            views.append(View(name, corners))
            larger += _larger(picture, board)
    errors: dict[str, float] = {}
    rms = float("nan")
    camera: Intrinsics | CalibrationError
    try:
        if len(views) >= MIN_FIT:
            whole = calibration.fit_camera(views, size)
            rms = whole.rms
            errors = {view.name: float(error) for view, error in zip(views, whole.view_rms, strict=True)}
        camera = calibration.calibrate_camera(views, size)
    except CalibrationError as error:
        camera = error
    wrong = ""
    if board.type == "charuco" and views and latest < board.columns * board.rows // 2 - board.columns // 2:
        wrong = f"no marker after {latest} is in any picture: another board than {board.columns} x {board.rows} squares"
    others = [text for text in words.values() if text.startswith("another board")]
    # In single pictures a row too many is taken from what is beside the board.
    for told, fewest in ((others, len(views)), (larger, 0.5 * len(views))):
        if len(told) > fewest:
            wrong = f"the pictures show {max(told, key=told.count)}"
    if wrong:
        camera = CalibrationError(
            folder.name, wrong, "pictures of the described board", "count again, or describe the board that is shown"
        )
    covered = calibration.coverage(views, size) if views else 0.0
    pictured = tuple(Seen(name, not text, text, errors.get(name, float("nan"))) for name, text in words.items())
    return CameraCheck(pictured, covered, rms, camera)


def _shown(picture: Picture, board: Board) -> str:
    """What a picture in which the board was not found shows instead, in words."""
    small = reduced(picture)
    mirrored = np.ascontiguousarray(small[:, ::-1])
    # A chessboard is its own mirror image.
    if board.type == "charuco" and detect(mirrored, board) is not None:
        return "mirrored: switch that off in the camera"
    if board.dictionary in (numbers := _markers(small)):
        if len(numbers[board.dictionary]) >= 2 * MIN_MARKERS:
            return f"another board: its markers do not lie as on one of {board.columns} x {board.rows} squares"
        return "too few corners of the board: cut by the border, covered or blurred"
    grid = _chessboard(small)
    if grid is None:
        return "no board: out of focus, too far away, or not in the picture"
    columns, rows, at_border = grid
    smaller = sorted((columns, rows)) < sorted((board.columns, board.rows))
    if board.type == "chessboard" and at_border and smaller:
        return f"cut by the border: {columns} x {rows} inner corners are seen"
    return f"another board: chessboard with {columns} x {rows} inner corners"


def _larger(picture: Picture, board: Board) -> list[str]:
    """In words, the larger chessboard of which a picture shows the described one as a part, if it does."""
    grid = _chessboard(reduced(picture)) if board.type == "chessboard" else None
    described = max(board.columns, board.rows), min(board.columns, board.rows)
    if grid is None or grid[:2] == described or grid[0] < described[0] or grid[1] < described[1]:
        return []
    return [f"another board: chessboard with {grid[0]} x {grid[1]} inner corners"]


def _markers(picture: Picture) -> dict[str, list[int]]:
    """Numbers of the markers in a picture by dictionary; fewer than :data:`MIN_MARKERS` do not count."""
    found = {}
    for name in get_args(Dictionary):
        _, numbers, _ = cv2.aruco.ArucoDetector(dictionary(name)).detectMarkers(picture)
        if numbers is not None and len(numbers) >= MIN_MARKERS:
            found[name] = np.ravel(numbers).tolist()
    return found


def _other_markers(numbers: dict[str, list[int]], board: Board) -> str:
    """What the markers in a picture say against a board, in words; empty for nothing."""
    for name, found in numbers.items():
        if board.type == "chessboard":
            return f"another board: ChArUco, with markers of {name}"
        if name != board.dictionary:
            return f"another board: its markers are of {name}"
        if max(found) >= board.columns * board.rows // 2:
            return f"another board: marker {max(found)} is not on one of {board.columns} x {board.rows} squares"
    return ""


def _chessboard(picture: Picture) -> tuple[int, int, bool] | None:
    """Inner corners of the largest chessboard in a picture, the more first, and whether it touches the border."""
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners, meta = cv2.findChessboardCornersSBWithMeta(picture, (3, 3), flags)
    if not found:
        return None
    rows, columns = np.asarray(meta).shape[:2]
    points = np.asarray(corners, dtype=np.float64).reshape(rows, columns, 2)
    step = max(float(np.linalg.norm(np.diff(points, axis=axis), axis=2).max()) for axis in (0, 1))
    least = min(float(points.min()), *(np.array(picture.shape[::-1]) - 1.0 - points.max(axis=(0, 1))))
    return max(rows, columns), min(rows, columns), least < 2.0 * step

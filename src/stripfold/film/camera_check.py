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
OTHER = "another board"


class Seen(NamedTuple):
    """One picture: name, whether the board was found, what it shows otherwise, RMS error of its corners, pixels."""

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
    words: dict[str, str] = {}
    views: list[View] = []
    others, latest = [], -1
    for name, picture in pictures:
        if picture.shape != (height, width):
            other = f"{picture.shape[1]} x {picture.shape[0]} pixels, the others have {width} x {height}"
            words[name] = f"from another camera, or with other settings: {other}"
            continue
        corners = detect(picture, board)
        instead, number = _instead(picture, board, corners is not None)
        latest = max(latest, number)
        if instead.startswith(OTHER):
            others.append(instead)
        words[name] = "" if corners else instead
        if corners is not None:
            views.append(View(name, corners))
    errors: dict[str, float] = {}
    rms = float("nan")
    camera: Intrinsics | CalibrationError
    try:
        if len(views) >= MIN_FIT:
            whole = calibration.fit_camera(views, (width, height))
            rms = whole.rms
            errors = {view.name: float(error) for view, error in zip(views, whole.view_rms, strict=True)}
        camera = calibration.calibrate_camera(views, (width, height))
    except CalibrationError as error:
        camera = error
    wrong, last = "", board.columns * board.rows // 2 - 1
    # In single pictures a row too many is taken from what is beside the board.
    if 2 * len(others) > len(words):
        wrong = f"the pictures show {max(others, key=others.count)}"
    if board.type == "charuco" and latest >= 0 and not last - board.columns // 2 < latest <= last:
        squares = f"{board.columns} x {board.rows} squares"
        wrong = f"the last marker in any picture is {latest}, on a board of {squares} it is {last}"
    if wrong:
        advice = "count again, or describe the board that is shown"
        camera = CalibrationError(folder.name, wrong, "pictures of the described board", advice)
    covered = calibration.coverage(views, (width, height)) if views else 0.0
    seen = tuple(Seen(name, not text, text, errors.get(name, float("nan"))) for name, text in words.items())
    return CameraCheck(seen, covered, rms, camera)


def _instead(picture: Picture, board: Board, found: bool) -> tuple[str, int]:
    """What a picture shows instead of a board, empty for nothing, and the last marker of the board's dictionary."""
    small = reduced(picture)
    markers = {}
    for name in get_args(Dictionary):
        _, numbers, _ = cv2.aruco.ArucoDetector(dictionary(name)).detectMarkers(small)
        if numbers is not None and len(numbers) >= MIN_MARKERS:
            markers[name] = np.ravel(numbers).tolist()
    if own := markers.get(board.dictionary or ""):
        if len(own) >= 2 * MIN_MARKERS and not found:
            return f"{OTHER}: its markers do not lie as on one of {board.columns} x {board.rows} squares", max(own)
        return "too few corners of the board: cut by the border, covered or blurred", max(own)
    if markers:
        return f"{OTHER}: ChArUco, its markers are of {next(iter(markers))}", -1
    # A chessboard is its own mirror image.
    if board.type == "charuco" and detect(np.ascontiguousarray(small[:, ::-1]), board) is not None:
        return "mirrored: switch that off in the camera", -1
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    seen, corners, meta = cv2.findChessboardCornersSBWithMeta(small, (3, 3), flags)
    if not seen:
        return "no board: out of focus, too far away, or not in the picture", -1
    points = np.asarray(corners, dtype=np.float64).reshape(*np.shape(meta)[:2], 2)
    shown, described = sorted(points.shape[:2]), sorted((board.columns, board.rows))
    smaller = shown[0] < described[0] or shown[1] < described[1]
    text = f"{shown[1]} x {shown[0]} inner corners"
    if board.type == "chessboard":
        step = max(float(np.linalg.norm(np.diff(points, axis=axis), axis=2).max()) for axis in (0, 1))
        at_border = min(points.min(), (np.array(small.shape[::-1]) - 1.0 - points.max(axis=(0, 1))).min()) < 2.0 * step
        # A part of the board may be seen as a smaller one.
        if shown == described or (smaller and (found or at_border)):
            return f"cut by the border: {text} are seen", -1
    return f"{OTHER}: chessboard with {text}", -1

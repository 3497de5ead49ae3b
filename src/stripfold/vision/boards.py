"""Boards of known geometry, chessboards and ChArUco boards, and where a picture shows their corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from stripfold.arrays import Array, Picture
from stripfold.errors import InvalidInputError

DICTIONARIES = {
    "4x4_50": cv2.aruco.DICT_4X4_50,
    "5x5_100": cv2.aruco.DICT_5X5_100,
    "6x6_250": cv2.aruco.DICT_6X6_250,
    "apriltag_36h11": cv2.aruco.DICT_APRILTAG_36h11,
}
CHESSBOARD, CHARUCO = "chessboard", "charuco"
FEWEST = 8
"""Corners that a picture of a ChArUco board must show, two or more off each line: fewer hardly tell its pose."""
SEARCH = 1600
"""Longest side of the picture in which corners are sought, pixels: larger ones are searched smaller, refined whole."""
WINDOW = 0.3
"""Half-window of the refinement, as a share of the distance between corners.

From 0.4 on the window reaches edges of the next corner; towards 0.1 it holds too few pixels.
"""


class Refinement(NamedTuple):
    """How corners are refined: half-window in pixels, and when a corner is done: iterations, or pixels of a change."""

    half_window: int
    iterations: int = 100
    change: float = 1e-4

    def of(self, image: Picture, pixels: Array) -> Array:
        """Corners, shape (n, 2), to a fraction of a pixel, from where they were roughly found."""
        refined = np.asarray(pixels, dtype=np.float32).reshape(-1, 1, 2)
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, self.iterations, self.change)
        # A copy: OpenCV refines in place, and the caller keeps what was found.
        refined = cv2.cornerSubPix(image, refined.copy(), (self.half_window, self.half_window), (-1, -1), stop)
        return np.asarray(refined, dtype=np.float64).reshape(-1, 2)


class Corners(NamedTuple):
    """Corners of a board that were found in a picture.

    Attributes
    ----------
    ids
        Shape (n,): which corners of the board.
    object_points
        Shape (n, 3): where they are on the board, m; the third is 0.
    pixels
        Shape (n, 2): where the picture shows them.
    """

    ids: np.ndarray
    object_points: Array
    pixels: Array


@dataclass(frozen=True)
class Board:
    """A board as a recording describes it.

    Attributes
    ----------
    kind
        "chessboard" or "charuco".
    columns, rows
        Inner corners of a chessboard, squares of a ChArUco board.
    square, marker
        Sides of a square and of a ChArUco board's marker, m.
    dictionary
        Name of the ChArUco board's dictionary.
    """

    kind: str
    columns: int
    rows: int
    square: float
    marker: float = 0.0
    dictionary: str = ""

    @classmethod
    def of(cls, mapping: Mapping[str, Any]) -> Board:
        """The board of a recording, valid by the schema.

        Raises
        ------
        InvalidInputError
            Markers that are as large as their squares, or more of them than the dictionary has.
        """
        found = cls(
            mapping["type"],
            mapping["columns"],
            mapping["rows"],
            mapping["square"],
            mapping.get("marker", 0.0),
            mapping.get("dictionary", ""),
        )
        if found.kind == CHARUCO:
            if not found.marker < found.square:
                raise InvalidInputError("marker", found.marker, f"less than the square, {found.square:g} m")
            has = len(dictionary(found.dictionary).bytesList)
            needs = found.columns * found.rows // 2
            if needs > has:
                raise InvalidInputError("dictionary", found.dictionary, f"a dictionary with {needs} markers or more")
        return found

    @property
    def window(self) -> float:
        """Half-window of the refinement, as a share of the distance between corners: free of the markers' edges."""
        gap = (self.square - self.marker) / (2.0 * self.square)
        return min(WINDOW, gap) if self.kind == CHARUCO else WINDOW

    @property
    def points(self) -> Array:
        """Shape (n, 3): all corners, m."""
        inner = (self.columns, self.rows) if self.kind == CHESSBOARD else (self.columns - 1, self.rows - 1)
        points = np.zeros((inner[0] * inner[1], 3))
        points[:, :2] = np.mgrid[0 : inner[0], 0 : inner[1]].T.reshape(-1, 2) * self.square
        return points


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of markers with the name that recordings use."""
    return cv2.aruco.getPredefinedDictionary(DICTIONARIES[name])


def detect(image: Picture, board: Board, refinement: Refinement | None = None) -> Corners | None:
    """Find a board's corners in a picture, to a fraction of a pixel.

    Parameters
    ----------
    image
        Grey, shape (height, width).
    board
        Which board.  A chessboard must be seen whole, of a ChArUco board :data:`FEWEST` corners.
    refinement
        How the corners are refined; without it the window grows with the corners' distance in the picture.

    Returns
    -------
    Corners or None
        None where the picture does not show the board.
    """
    scale = max(1.0, max(image.shape) / SEARCH)
    size = (round(image.shape[1] / scale), round(image.shape[0] / scale))
    small = image if scale == 1.0 else np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))
    found = _chessboard(small, board) if board.kind == CHESSBOARD else _charuco(small, board)
    if found is None:
        return None
    ids, rough = found
    # Pixel centres are at integers: a scaled picture's first pixel is not centred on the whole one's.
    rough = (rough + 0.5) * (np.array(image.shape[::-1]) / np.array(size)) - 0.5
    if refinement is None:
        refinement = Refinement(max(2, int(board.window * spacing(rough))))
    return Corners(ids, board.points[ids], refinement.of(image, rough))


def spacing(pixels: Array) -> float:
    """The smallest distance between two corners, pixels."""
    return float(cKDTree(pixels).query(pixels, k=2)[0][:, 1].min())


def _chessboard(image: Picture, board: Board) -> tuple[np.ndarray, Array] | None:
    # The fast check first: without it a picture of noise takes eight times as long.
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    # findChessboardCornersSB finds as many boards, in 20 times the time, with 2.5 times the error on rendered boards.
    found, corners = cv2.findChessboardCorners(image, (board.columns, board.rows), flags=flags)
    if not found:
        return None
    return np.arange(board.columns * board.rows), np.asarray(corners, dtype=np.float64).reshape(-1, 2)


def _charuco(image: Picture, board: Board) -> tuple[np.ndarray, Array] | None:
    drawn = cv2.aruco.CharucoBoard(
        (board.columns, board.rows), board.square, board.marker, dictionary(board.dictionary)
    )
    corners, ids, _, _ = cv2.aruco.CharucoDetector(drawn).detectBoard(image)
    if ids is None or len(ids) < FEWEST:
        return None
    # Flat: OpenCV 4 and 5 give different shapes.
    ids, corners = np.asarray(ids).ravel(), np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    most = max(np.bincount(line).max() for line in (ids % (board.columns - 1), ids // (board.columns - 1)))
    return (ids, corners) if len(ids) - most >= 2 else None

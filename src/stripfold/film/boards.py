"""Calibration boards, chessboard and ChArUco, and the detection of their corners."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from scipy.spatial import cKDTree

from stripfold.base.arrays import Array, Index, Mask, Picture
from stripfold.base.errors import MISSING, InvalidInputError
from stripfold.base.validation import Input, Number, Whole, quantity

Dictionary = Literal["4x4_50", "5x5_100", "6x6_250", "apriltag_36h11"]
Count = Annotated[Whole, quantity("inner corners of a chessboard, squares of a ChArUco board", ge=3, le=100)]
Side = Annotated[Number, quantity("side of a square", "m", gt=0.0, le=1.0)]
MIN_CORNERS = 8
"""Corners of a ChArUco board that must be visible, at least two of them off any line: fewer hardly fix its pose."""
DETECTION_SIZE = 1600
"""Longest side, pixels, of the picture in which corners are detected; they are refined in the full picture."""
NOISE = 1.0
"""Standard deviation of the smoothing of a picture in which no board was found as it is, pixels."""
STRAY = 0.2
"""Distance of a board's own corner from where its row and column go on, in the least one of two corners, from which on
it is something else."""
GOES_ON = np.array([3.0, -3.0, 1.0])
"""Weights of three values of a parabola in the next one."""
WINDOW = 0.3
"""Half-window of the refinement over the distance between corners: with 0.4 it contains edges of the next one."""


class Refinement(NamedTuple):
    """Sub-pixel refinement: half-window, pixels; most iterations; change that ends the iteration, pixels."""

    half_window: int
    iterations: int = 100
    change: float = 1e-4


class Corners(NamedTuple):
    """Corners of a board in a picture: indices into :attr:`Board.points`, shape (n,), these points, m, and pixels."""

    ids: Index
    object_points: Array
    pixels: Array


class Board(Input):
    """A printed board, as a recording describes it."""

    type: Literal["chessboard", "charuco"]
    columns: Count
    rows: Count
    square: Side
    marker: Annotated[Side | None, Field(description="side of a marker of a ChArUco board")] = None
    dictionary: Dictionary | None = None

    @model_validator(mode="after")
    def _check_charuco(self) -> Self:
        for key in ("marker", "dictionary"):
            value = getattr(self, key)
            if (value is None) == (self.type == "charuco"):
                raise InvalidInputError(key, MISSING if value is None else value, f"the {key} of a ChArUco board only")
        if self.marker is not None and self.dictionary is not None:
            if not self.marker < self.square:
                raise InvalidInputError("marker", self.marker, f"less than the square, {self.square:g} m")
            needed = self.columns * self.rows // 2
            if needed > len(dictionary(self.dictionary).bytesList):
                raise InvalidInputError("dictionary", self.dictionary, f"a dictionary of {needed} markers or more")
        return self

    @property
    def window(self) -> float:
        """Half-window of the refinement over the distance between corners; it does not reach the markers' edges."""
        if self.marker is None:
            return WINDOW
        return min(WINDOW, 0.5 * (1.0 - self.marker / self.square))

    @property
    def points(self) -> Array:
        """Shape (n, 3): all inner corners, row by row, m."""
        inner = 0 if self.type == "chessboard" else 1
        y, x = np.mgrid[0 : self.rows - inner, 0 : self.columns - inner]
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * self.square

    @property
    def black(self) -> Array:
        """Shape (n, 3): the black squares and cells of a ChArUco board: left and upper edge from its outer corner, and
        side, m.
        """
        row, column = np.nonzero(np.indices((self.rows, self.columns)).sum(axis=0) % 2 == 0)
        found = [np.column_stack([self.square * column, self.square * row, np.full(len(row), self.square)])]
        known = self.charuco
        for corners, number in zip(known.getObjPoints(), known.getIds(), strict=True):
            cells = black_cells(str(self.dictionary), int(number))
            (left, upper), side = np.asarray(corners)[0, :2], np.ptp(np.asarray(corners)[:, 0]) / len(cells)
            row, column = np.nonzero(cells)
            found.append(np.column_stack([left + side * column, upper + side * row, np.full(len(row), side)]))
        return np.concatenate(found)

    @property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's description of a ChArUco board."""
        assert self.marker is not None
        assert self.dictionary is not None
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square, self.marker, dictionary(self.dictionary))


def black_cells(name: str, number: int) -> Mask:
    """Which cells of a marker of a dictionary are black, with its rim, row by row from above, shape (n, n)."""
    known = dictionary(name)
    return np.asarray(cv2.aruco.generateImageMarker(known, number, known.markerSize + 2) == 0)


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's marker dictionary of a name in :data:`Dictionary`."""
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name.upper()}"))


def detect(picture: Picture, board: Board, refinement: Refinement | None = None) -> Corners | None:
    """Find a board's corners in a picture with sub-pixel accuracy, or None if it does not show the board.

    A chessboard must be entirely visible; a ChArUco board must show :data:`MIN_CORNERS` corners.  Without
    ``refinement`` the half-window is proportional to the distance between corners.
    """
    small = reduced(picture)
    search = _chessboard if board.type == "chessboard" else _charuco
    # In the dark noise hides squares: then they are found in a smoothed picture.
    found = search(small, board) or search(np.asarray(cv2.GaussianBlur(small, (0, 0), NOISE), dtype=np.uint8), board)
    if found is None:
        return None
    ids, rough = found
    # Pixel centres are at integers: half a pixel is added before scaling and subtracted after it.
    rough = (rough + 0.5) * (np.array(picture.shape[::-1]) / np.array(small.shape[::-1])) - 0.5
    if refinement is None:
        refinement = Refinement(max(3, int(board.window * spacing(rough))))
    return Corners(ids, board.points[ids], refine(picture, rough, refinement))


def reduced(picture: Picture) -> Picture:
    """A picture whose longest side has :data:`DETECTION_SIZE` pixels at most."""
    scale = max(1.0, max(picture.shape) / DETECTION_SIZE)
    size = (round(picture.shape[1] / scale), round(picture.shape[0] / scale))
    return picture if scale == 1.0 else np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def refine(picture: Picture, corners: NDArray[np.floating[Any]], refinement: Refinement) -> Array:
    """Corners, shape (n, 2), with sub-pixel accuracy."""
    # A copy, because OpenCV refines in place.
    rough = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, refinement.iterations, refinement.change)
    refined = cv2.cornerSubPix(picture, rough, (refinement.half_window, refinement.half_window), (-1, -1), stop)
    return np.asarray(refined, dtype=np.float64).reshape(-1, 2)


def spacing(pixels: Array) -> float:
    """The smallest distance between two corners, pixels."""
    return float(cKDTree(pixels).query(pixels, k=2)[0][:, 1].min())


def _chessboard(picture: Picture, board: Board) -> tuple[Index, Array] | None:
    # The fast check rejects a picture of noise eight times faster.
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    # findChessboardCornersSB finds as many boards, but takes 20 times as long, and its error is 2.5 times as large.
    found, corners = cv2.findChessboardCorners(picture, (board.columns, board.rows), flags=flags)
    if not found:
        return None
    rough = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    grid, reach = rough.reshape(board.rows, board.columns, 2), STRAY * spacing(rough)
    # A corner of the board itself may be something else beside it, far from where its row and column go on.
    known = min(board.rows, board.columns) > len(GOES_ON)
    for turned in (grid, grid[::-1], grid[:, ::-1], grid[::-1, ::-1]) if known else ():
        expected = 0.5 * GOES_ON @ (turned[0, 1:4] + turned[1:4, 0])
        if np.hypot(*(turned[0, 0] - expected)) > reach:
            turned[0, 0] = expected
    return np.arange(len(rough)), rough


def _charuco(picture: Picture, board: Board) -> tuple[Index, Array] | None:
    # Before OpenCV 4.6, and still by some makers, boards with an even number of rows begin with a marker, not with a
    # black square; with an odd number both patterns are the same.
    found = _pattern(picture, board, legacy=False)
    return _pattern(picture, board, legacy=True) if found is None and board.rows % 2 == 0 else found


def _pattern(picture: Picture, board: Board, legacy: bool) -> tuple[Index, Array] | None:
    known = board.charuco
    known.setLegacyPattern(legacy)
    # Markers that are too blurred to be read are found by where those that are read say that they must be.
    asked = cv2.aruco.CharucoParameters()
    asked.tryRefineMarkers = True
    corners, ids, _, _ = cv2.aruco.CharucoDetector(known, asked).detectBoard(picture)
    if ids is None or len(ids) < MIN_CORNERS:
        return None
    # The shape depends on OpenCV's version.
    ids, corners = np.asarray(ids).ravel(), np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    on_one_line = max(np.bincount(line).max() for line in np.divmod(ids, board.columns - 1))
    return (ids, corners) if len(ids) - on_one_line >= 2 else None

"""The plate: a printed ChArUco board that stands beside the cloth in the plane of its near edge (docs/measuring.md).

A picture of it gives the scale, the vertical and where the camera stands.  There is a long one, for films, and a card.
Coordinates on it are x along the table, to the right of one who looks at the print, and z up, m, with the origin on the
table below the left edge of the squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import CalibrationError, TrackingError
from stripfold.film.boards import Board, Corners, detect
from stripfold.film.camera import Camera, Mapping, fit_homography, rms, transform

LONG = Board(type="charuco", columns=10, rows=3, square=0.024, marker=0.018, dictionary="4x4_50")
CARD = Board(type="charuco", columns=7, rows=3, square=0.012, marker=0.009, dictionary="5x5_100")
FOOT, MARGIN = 0.5, 1.0 / 3.0
"""White below the squares, down to the table, and around them, in squares: a plate is cut out along it."""
GRIPPERS, SIDE = (40, 41), 0.048
"""Markers for the gripper: numbers in the same dictionary, and side of their black square, m."""
FOCALS = 0.75, 1.45, 2.1
"""Focal length over the longer side of a picture: of the main cameras of phones, and of what enlarges twice or thrice.
From where a strip is seen follows from it."""
FOCAL_SD, KNOWN_FOCAL_SD = 0.1, 0.015
"""Standard deviation of a focal length, as a share: of one of these, and by a picture's data."""
PRINT_SD, PLACE_SD = 0.0015, 0.002
"""Standard deviations of the print's scale, and of the distance of the cloth's edge from the plate's plane, m."""
MAX_RMS = 1.5e-3
"""Largest distance of the corners from a plane, root mean square, over the longer side of the picture: paper curls."""
DRAWS = 50
"""Samples of the mapping."""
MAX_GROWTH = 1.5
"""Largest side of a rectified picture over that of the picture."""
NEEDED = "the plate in view, flat and sharp (stripfold plate prints it)"


@dataclass(frozen=True, eq=False)
class Seen:
    """A plate in a picture: its ``board`` and ``corners``, the ``mapping`` from pixels to it, and how far the corners
    are off it, pixels.  The lens is taken as one without distortion; ``focal_sd``: of its focal length, as a share.
    """

    board: Board
    corners: Corners
    mapping: Mapping
    rms: float
    focal_sd: float = 0.0

    def with_focal(self, focal: float, focal_sd: float) -> Seen:
        """The same by another focal length over the longer side, and its standard deviation as a share."""
        return _posed(self.board, self.corners, self.mapping.camera.size, focal, focal_sd)

    def resample(self, random: np.random.Generator) -> Mapping:
        """Draw a mapping: the corners with noise of the size of their residuals, and a focal length."""
        pixels = self.corners.pixels + random.normal(0.0, self.rms / np.sqrt(2.0), self.corners.pixels.shape)
        factor = np.diag([*np.full(2, np.exp(random.normal(0.0, self.focal_sd))), 1.0])
        camera = replace(self.mapping.camera, matrix=self.mapping.camera.matrix @ factor)
        return _mapping(camera, pixels, places(self.board, self.corners))


def places(board: Board, corners: Corners) -> Array:
    """The plate's x and z of corners, shape (n, 2), m."""
    # A board's own origin is its first inner corner, one square from either edge.
    x, down = corners.object_points[:, :2].T + board.square
    return np.column_stack([x, (FOOT + board.rows) * board.square - down])


def find(image: Picture, source: str = "picture", boards: Sequence[Board] = (CARD, LONG)) -> Seen:
    """Find the first of some plates in grey values, shape (h, w), as by the camera of most phones.

    Raises TrackingError: none is seen, or no plane.
    """
    for board in boards:
        corners = detect(image, board)
        if corners is not None:
            return _seen(image, source, board, corners)
    raise TrackingError(source, "no plate", NEEDED, "come closer, or use more light; without a plate give the scale")


def _seen(image: Picture, source: str, board: Board, corners: Corners) -> Seen:
    on_plate = places(board, corners)
    try:
        off = rms(transform(np.linalg.inv(fit_homography(corners.pixels, on_plate)), on_plate) - corners.pixels)
    except CalibrationError as error:
        raise TrackingError(source, error.found, NEEDED) from error
    longer = max(image.shape)
    if off > MAX_RMS * longer:
        raise TrackingError(source, f"a plate whose corners are {off:.1f} px off a plane", NEEDED, "glue it on a board")
    height, width = image.shape
    return _posed(board, corners, (width, height), FOCALS[0], FOCAL_SD)


def _posed(board: Board, corners: Corners, size: tuple[int, int], focal: float, focal_sd: float) -> Seen:
    width, height = size
    length, on_plate = focal * max(size), places(board, corners)
    matrix = np.array([[length, 0.0, 0.5 * (width - 1)], [0.0, length, 0.5 * (height - 1)], [0.0, 0.0, 1.0]])
    camera = Camera(matrix, np.zeros(5), size)
    mapping = _mapping(camera, corners.pixels, on_plate)
    return Seen(board, corners, mapping, rms(mapping.to_pixels(on_plate) - corners.pixels), focal_sd)


def _mapping(camera: Camera, pixels: Array, on_plate: Array) -> Mapping:
    """To places on a plate by the camera's pose, which errs less beside a small plate than a free homography."""
    return Mapping.of_pose(camera, *pose(camera, pixels, on_plate))


def pose(camera: Camera, pixels: Array, on_plate: Array) -> tuple[Array, Array]:
    """The pose of a plate in front of a camera: its Rodrigues vector and its origin, m, shape (3,) each."""
    points, seen = np.column_stack([on_plate, np.zeros(len(on_plate))]), camera.undistort(pixels)
    _, rotation, shift = cv2.solvePnP(points, seen, camera.matrix, None, flags=cv2.SOLVEPNP_IPPE)
    rotation, shift = cv2.solvePnPRefineLM(points, seen, camera.matrix, None, rotation, shift)
    return np.ravel(rotation), np.ravel(shift)


class Rectified(NamedTuple):
    """A picture as seen from straight ahead, upright: grey values, its scale, m per pixel, and its upper left corner's
    x and z on the plate, m; the plate is painted over.
    """

    image: Picture
    scale: float
    corner: Array

    def places(self, pixels: Array) -> Array:
        """The plate's x and z, shape (n, 2), m, of pixels, shape (n, 2)."""
        return self.corner + self.scale * pixels * [1.0, -1.0]

    def pixels(self, places: Array) -> Array:
        """Pixels, shape (n, 2), of the plate's x and z, shape (n, 2), m."""
        return (places - self.corner) / [self.scale, -self.scale]


def rectified(image: Picture, seen: Seen) -> Rectified:
    """See a picture straight and upright, at the scale of its plate; only what is in the picture."""
    height, width = image.shape
    mapping = seen.mapping
    scale = mapping.resolution(seen.corners.pixels.mean(axis=0))
    border = np.array([[0.0, 0.0], [width - 1.0, 0.0], [width - 1.0, height - 1.0], [0.0, height - 1.0]])
    x, z = np.sort(transform(mapping.homography, border), axis=0).T
    left, right, low, high = x[1], x[2], z[1], z[2]
    scale = max(scale, (right - left) / (MAX_GROWTH * width), (high - low) / (MAX_GROWTH * height))
    size = int((right - left) / scale), int((high - low) / scale)
    to_pixels = np.array([[1.0 / scale, 0.0, -left / scale], [0.0, -1.0 / scale, high / scale], [0.0, 0.0, 1.0]])
    matrix = to_pixels @ mapping.homography
    straight = cv2.warpPerspective(image, matrix, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    found = Rectified(np.asarray(straight, np.uint8), scale, np.array([left, high]))
    _paint_over(found, seen.board)
    return found


def outline(board: Board) -> Array:
    """The upper left and the lower right corner of a plate that is cut out, x and z, shape (2, 2), m."""
    corners = [[-MARGIN, FOOT + board.rows + MARGIN], [board.columns + MARGIN, 0.0]]
    return np.asarray(board.square * np.array(corners))


def _paint_over(found: Rectified, board: Board) -> None:
    """Replace the plate by what is beside it: its squares are no cloth."""
    corners = outline(board)
    (left, top), (right, bottom) = np.rint((corners - found.corner) / [found.scale, -found.scale]).astype(int).tolist()
    rim = max(round(2e-3 / found.scale), 2)
    image = found.image
    rows, columns = (slice(max(low - rim, 0), max(high + rim, 0)) for low, high in ((top, bottom), (left, right)))
    part = image[rows, columns]
    if part.size == 0:
        return
    sides = [image[rows, max(columns.start - 1, 0)], image[rows, min(columns.stop, image.shape[1] - 1)]]
    # From side to side: the light may fall off along the wall, and the table has another tone.
    share = np.linspace(0.0, 1.0, part.shape[1])
    smooth = [gaussian_filter1d(side.astype(np.float64), 2.0)[:, None] for side in sides]
    part[:] = np.clip((1.0 - share) * smooth[0] + share * smooth[1], 0.0, 255.0)

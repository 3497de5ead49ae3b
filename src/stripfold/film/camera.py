"""A pinhole camera with lens distortion, and the mapping from its pixels to the robot's coordinates.

OpenCV's convention holds: the centre of the first pixel is (0, 0).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orthogonal_procrustes

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.base.validation import read_yaml
from stripfold.film.pictures import Shown

MAX_SIDE = 100_000
"""Largest width or height of a picture, pixels."""
# OpenCV's default of five iterations leaves 0.3 px in the corners of pictures from a wide-angle lens.
_UNDISTORTED = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-10)
ALLOWED = (
    "an OpenCV YAML file with image_width, image_height, camera_matrix (3 x 3, without skew) and "
    "distortion_coefficients (k1, k2, p1, p2 and optionally k3)"
)


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics of a camera: ``matrix``, shape (3, 3), pixels; ``distortion``: k1, k2, p1, p2, k3; size."""

    matrix: Array
    distortion: Array
    size: tuple[int, int]

    def turned(self, turns: int) -> Camera:
        """The camera for pictures rotated by quarter turns to the left."""
        camera = self
        for _ in range(turns % 4):
            (fx, cx), fy, cy = camera.matrix[0, [0, 2]], camera.matrix[1, 1], camera.matrix[1, 2]
            k1, k2, p1, p2, k3 = camera.distortion
            # The new x is the old y, and the new y the old x from the other end.
            matrix = np.array([[fy, 0.0, cy], [0.0, fx, camera.size[0] - 1.0 - cx], [0.0, 0.0, 1.0]])
            camera = Camera(matrix, np.array([k1, k2, -p2, p1, k3]), camera.size[::-1])
        return camera

    def of_film(self, shown: Shown) -> Camera:
        """The camera for the frames of a film: turned where it is one for the sensor's rows.

        A file of a camera does not say which; upside down it is taken for the frames as they are shown.
        """
        return self.turned(shown.turns) if shown.turns % 2 and self.size != shown.size else self

    def undistort(self, pixels: Array) -> Array:
        """Where the camera without its distortion would see ``pixels``; shapes (n, 2)."""
        points = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        ideal = cv2.undistortPoints(points, self.matrix, self.distortion, P=self.matrix, criteria=_UNDISTORTED)
        return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)

    def distort(self, pixels: Array) -> Array:
        """The inverse of :meth:`undistort`."""
        return self.project(self._directions(pixels), np.zeros(3), np.zeros(3))

    def rays(self, pixels: Array) -> Array:
        """Directions, shape (n, 3), in which the camera sees ``pixels``, shape (n, 2): the points at depth 1."""
        return self._directions(self.undistort(pixels))

    def _directions(self, undistorted: Array) -> Array:
        """Of pixels of the camera without its distortion."""
        return np.reshape(undistorted, (-1, 2)) @ self._inverse[:, :2].T + self._inverse[:, 2]

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.matrix), dtype=np.float64)

    def project(self, points: Array, rotation: Array, translation: Array) -> Array:
        """Pixels, shape (n, 2), of ``points``, shape (n, 3), m, given the pose of their frame (Rodrigues vector, m)."""
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(points, rotation, translation, self.matrix, self.distortion)
        return np.asarray(pixels, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Mapping:
    """From pixels to the robot's x and z, m, in the folding plane: ``homography``, (3, 3), of undistorted pixels."""

    camera: Camera
    homography: Array

    @classmethod
    def of_pose(cls, camera: Camera, rotation: Array, origin: Array) -> Self:
        """To places in a plane of this Rodrigues vector and origin, m, in front of the camera, shapes (3,)."""
        axes = cv2.Rodrigues(rotation)[0]
        return cls(camera, np.linalg.inv(camera.matrix @ np.column_stack([axes[:, :2], origin])))

    def to_robot(self, pixels: Array) -> Array:
        """The robot's x and z, shape (n, 2), m, of pixels, shape (n, 2)."""
        return transform(self.homography, self.camera.undistort(pixels))

    def to_pixels(self, points: Array) -> Array:
        """The inverse of :meth:`to_robot`."""
        return self.camera.distort(transform(self._inverse, np.reshape(points, (-1, 2))))

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.homography), dtype=np.float64)

    @cached_property
    def camera_place(self) -> Array:
        """The camera's x and z, and its distance from the folding plane, m, shape (3,): by the camera's matrix."""
        columns = np.linalg.inv(self.homography @ self.camera.matrix)
        scale = np.sqrt(np.linalg.norm(columns[:, 0]) * np.linalg.norm(columns[:, 1]))
        first, second, origin = columns.T / scale
        u, _, v = np.linalg.svd(np.column_stack([first, second, np.cross(first, second)]))
        place = -(u @ v).T @ origin
        return np.array([place[0], place[1], abs(place[2])])

    def resolution(self, pixel: Array) -> float:
        """Metres per pixel at a pixel, shape (2,): the square root of the area that a pixel covers."""
        x, y = np.array([0.5, 0.0]), np.array([0.0, 0.5])
        left, right, above, below = self.to_robot(np.array([pixel - x, pixel + x, pixel - y, pixel + y]))
        return float(np.sqrt(np.abs(np.linalg.det([right - left, below - above]))))


def transform(homography: NDArray[np.floating[Any]], points: Array) -> Array:
    """Apply a homography, shape (3, 3), to points, shape (n, 2)."""
    homogeneous = points @ homography[:, :2].T + homography[:, 2]
    return np.asarray(homogeneous[:, :2] / homogeneous[:, 2:])


def fit_homography(source: Array, target: Array) -> Array:
    """The homography, shape (3, 3), that maps ``source`` to ``target`` best; both of shape (n, 2).

    Raises CalibrationError: points on a line, or that no homography fits.
    """
    found, _ = cv2.findHomography(source, target)
    if found is None:
        raise CalibrationError("board", "corners that no homography fits", "corners spread over the board")
    return np.asarray(found)


def fit_similarity(source: Array, target: Array) -> Array:
    """The similarity, shape (3, 3), mirrored or not, that maps ``source`` to ``target`` best; both of shape (n, 2).

    Source: Umeyama, IEEE Trans. Pattern Anal. Mach. Intell. 13 (1991) 376, with either sign of the determinant.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    turn, singular = orthogonal_procrustes(a, b)
    similarity = np.eye(3)
    similarity[:2, :2] = singular / np.sum(a**2) * turn.T
    similarity[:2, 2] = target.mean(axis=0) - similarity[:2, :2] @ source.mean(axis=0)
    return similarity


def scale(similarity: Array) -> float:
    """How much a similarity, shape (3, 3), magnifies."""
    return float(np.sqrt(abs(np.linalg.det(similarity[:2, :2]))))


def rms(vectors: Array) -> float:
    """Root mean square of the lengths of vectors, shape (n, 2)."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def read_camera(path: Path) -> Camera:
    """Read the camera in a file as OpenCV writes it; InvalidInputError: no such file, or not a camera's."""
    table = read_opencv_yaml(path)
    try:
        width, height = (_side(table[key]) for key in ("image_width", "image_height"))
        matrix = _matrix(table["camera_matrix"])
        if matrix.shape != (3, 3) or np.any(matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]] != [0.0, 0.0, 0.0, 0.0, 1.0]):
            raise ValueError("camera_matrix is not that of a camera without skew")
        if not (matrix[0, 0] > 0.0 and matrix[1, 1] > 0.0):
            raise ValueError("a focal length is not positive")
        if not (0.0 <= matrix[0, 2] <= width and 0.0 <= matrix[1, 2] <= height):
            raise ValueError("the principal point is outside the picture")
        distortion = _matrix(table["distortion_coefficients"]).ravel()
        if len(distortion) < 4 or np.any(distortion[5:] != 0.0):
            raise ValueError(f"distortion_coefficients has {len(distortion)} numbers, and only 4 or 5 are supported")
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        reason = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise InvalidInputError("intrinsics", str(path), ALLOWED, reason) from error
    return Camera(matrix, np.append(distortion, 0.0)[:5], (width, height))


def _side(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MAX_SIDE:
        raise ValueError(f"a side of the picture is {str(value)[:40]} pixels long")
    return value


def _matrix(entry: Any) -> Array:
    if not isinstance(entry, dict):
        raise ValueError("a matrix needs rows, cols and data")
    # OpenCV 5 writes arrays of one dimension with their sizes.
    shape = [int(size) for size in (entry["sizes"] if "sizes" in entry else [entry["rows"], entry["cols"]])]
    data = entry["data"]
    if not isinstance(data, list) or min(shape) < 1 or prod(shape) != len(data):
        raise ValueError("the data of a matrix do not match its rows and cols")
    values = np.array([float(value) for value in data]).reshape(shape)
    if not np.all(np.isfinite(values)):
        raise ValueError("a number is not finite")
    return values


def read_opencv_yaml(path: Path) -> dict[str, Any]:
    """Read an OpenCV YAML file, whose own reader crashes on nested files; InvalidInputError: none, or not YAML."""
    if not path.is_file():
        raise InvalidInputError("intrinsics", str(path), "an existing file")
    # OpenCV's first line is not valid YAML, and its tags of matrices say what their keys say, too.
    return read_yaml(path, "intrinsics", ALLOWED, lambda text: re.sub(r"\A%YAML:.*|!!opencv-(nd-)?matrix", "", text))

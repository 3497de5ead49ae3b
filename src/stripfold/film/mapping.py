"""From pixels to the robot's coordinates: lens distortion removed, then a homography of the folding plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orthogonal_procrustes

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError
from stripfold.film.camera import Camera


@dataclass(frozen=True, eq=False)
class Mapping:
    """From pixels to the robot's x and z, for points in the folding plane.

    ``homography``, shape (3, 3), maps undistorted pixels to x and z in m.
    """

    camera: Camera
    homography: Array

    def to_robot(self, pixels: Array) -> Array:
        """The robot's x and z, shape (n, 2), m, of pixels, shape (n, 2)."""
        return transform(self.homography, self.camera.undistort(pixels))

    def to_pixels(self, points: Array) -> Array:
        """The inverse of :meth:`to_robot`."""
        return self.camera.distort(transform(self._inverse, np.reshape(points, (-1, 2))))

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.homography), dtype=np.float64)

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

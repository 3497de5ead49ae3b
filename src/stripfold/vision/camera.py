"""A pinhole camera with lens distortion, in OpenCV's convention: the centre of the first pixel is (0, 0)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from stripfold.arrays import Array


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics of a camera.

    Attributes
    ----------
    matrix
        Shape (3, 3): focal lengths and principal point, pixels.
    distortion
        Shape (5,): k1, k2, p1, p2, k3.
    size
        Width and height of its pictures, pixels.
    """

    matrix: Array
    distortion: Array
    size: tuple[int, int]

    def undistort(self, points: Array) -> Array:
        """Where a camera without distortion and with the same matrix sees ``points``; shape (n, 2), pixels."""
        flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 2)
        ideal = cv2.undistortPoints(flat, self.matrix, self.distortion, P=self.matrix)
        return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)

    def distort(self, points: Array) -> Array:
        """The inverse of :meth:`undistort`; shape (n, 2), pixels."""
        flat = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        rays = np.column_stack([flat, np.ones(len(flat))]) @ np.linalg.inv(self.matrix).T
        return self.project(rays, np.zeros(3), np.zeros(3))

    def project(self, points: Array, rotation: Array, translation: Array) -> Array:
        """Pixels, shape (n, 2), of ``points``, shape (n, 3), m, with the pose of their frame as vectors, shape (3,)."""
        flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
        seen, _ = cv2.projectPoints(flat, rotation, translation, self.matrix, self.distortion)
        return np.asarray(seen, dtype=np.float64).reshape(-1, 2)

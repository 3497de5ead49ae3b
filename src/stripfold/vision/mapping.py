"""From pixels to the robot: without the lens, by a homography to the folding plane, by a similarity to the robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import CalibrationError
from stripfold.vision.camera import Camera


@dataclass(frozen=True, eq=False)
class Similarity:
    """Points of the folding plane, m, to the robot's x and z, m.

    Attributes
    ----------
    scale
        Metres of the robot in a metre of the plane.
    angle
        Turn, rad; after the reflection.
    shift
        Shape (2,), m.
    mirrored
        Whether the second coordinate is reflected first.
    """

    scale: float
    angle: float
    shift: Array
    mirrored: bool

    @property
    def matrix(self) -> Array:
        """Shape (2, 2): ``robot = matrix @ plane + shift``."""
        c, s = self.scale * np.cos(self.angle), self.scale * np.sin(self.angle)
        sign = -1.0 if self.mirrored else 1.0
        return np.array([[c, -sign * s], [s, sign * c]])

    def apply(self, points: Array) -> Array:
        """Robot's x and z of points of the plane; shapes (n, 2), m."""
        return np.asarray(points @ self.matrix.T + self.shift)

    def invert(self, points: Array) -> Array:
        """The inverse of :meth:`apply`."""
        return np.asarray(np.linalg.solve(self.matrix, (points - self.shift).T).T)

    @classmethod
    def fit(cls, plane: Array, robot: Array) -> Similarity:
        """The similarity, mirrored or not, with the smallest squares of what is left; shapes (n, 2), m.

        Source: Umeyama, IEEE Trans. Pattern Anal. Mach. Intell. 13 (1991) 376, with either sign of the determinant.
        """
        middle, place = plane.mean(axis=0), robot.mean(axis=0)
        left, singular, right = np.linalg.svd((robot - place).T @ (plane - middle))
        turn = left @ right
        scale = float(singular.sum() / np.sum((plane - middle) ** 2))
        mirrored = bool(np.linalg.det(turn) < 0.0)
        return cls(scale, float(np.arctan2(turn[1, 0], turn[0, 0])), place - scale * turn @ middle, mirrored)


@dataclass(frozen=True, eq=False)
class Mapping:
    """From pixels of the camera's pictures to the robot's x and z, for points in the folding plane.

    Attributes
    ----------
    camera
        The camera.
    plane
        Shape (3, 3): homography from undistorted pixels to the plane, m.
    robot
        From the plane to the robot.
    """

    camera: Camera
    plane: Array
    robot: Similarity

    def to_robot(self, pixels: Array) -> Array:
        """The robot's x and z, shape (n, 2), m, of pixels, shape (n, 2)."""
        return self.robot.apply(through(self.plane, self.camera.undistort(pixels)))

    def to_pixels(self, points: Array) -> Array:
        """The inverse of :meth:`to_robot`."""
        inverse = np.linalg.inv(self.plane)
        return self.camera.distort(through(inverse, self.robot.invert(np.reshape(points, (-1, 2)))))

    def resolution(self, pixels: Array) -> Array:
        """Metres of the folding plane in a pixel at pixels, shape (n, 2): the root of the area; shape (n,)."""
        pixels = np.reshape(pixels, (-1, 2))
        step = 0.5
        across, down = np.array([step, 0.0]), np.array([0.0, step])
        along = (self.to_robot(pixels + across) - self.to_robot(pixels - across)) / (2.0 * step)
        below = (self.to_robot(pixels + down) - self.to_robot(pixels - down)) / (2.0 * step)
        return np.asarray(np.sqrt(np.abs(along[:, 0] * below[:, 1] - along[:, 1] * below[:, 0])))


def through(homography: NDArray[np.floating[Any]], points: Array) -> Array:
    """Points, shape (n, 2), through a homography, shape (3, 3)."""
    seen = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(seen[:, :2] / seen[:, 2:])


def homography(pixels: Array, points: Array) -> Array:
    """The homography, shape (3, 3), from undistorted pixels to points of a plane, m; both of shape (n, 2).

    Raises
    ------
    CalibrationError
        Points on a line, or that no homography fits.
    """
    found, _ = cv2.findHomography(pixels, points)
    if found is None:
        raise CalibrationError("board", "corners that no plane fits", "corners spread over the board")
    return np.asarray(found)


def rms(off: Array) -> float:
    """Root mean square of the lengths of vectors, shape (n, 2)."""
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))

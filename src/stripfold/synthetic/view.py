"""Where the camera stands, and what its pixels see: the same model for the strip, the table and the boards."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.synthetic.scene import Filming
from stripfold.vision.camera import Camera

# OpenCV's own default stops after five rounds, 0.01 px short at the corners of a picture with distortion.
_EXACT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 1e-10)


@dataclass(frozen=True, eq=False)
class View:
    """A camera and its pose in the robot's frame: x along the table, z up; the folding plane is y = 0.

    Robot y points away from a camera that is not ``behind``.

    Attributes
    ----------
    camera
        Intrinsics.
    rotation, translation
        Shapes (3,): from the robot's frame to the camera's, as OpenCV takes them; m.
    """

    camera: Camera
    rotation: Array
    translation: Array

    @classmethod
    def of(cls, filming: Filming) -> View:
        """The view of a filming."""
        width, height = filming.size
        focal = width * filming.distance / filming.field
        # No camera has its principal point exactly in the middle.
        centre = (0.5 * (width - 1) + 0.011 * width, 0.5 * (height - 1) - 0.014 * height)
        matrix = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
        camera = Camera(matrix, np.array([*filming.distortion, 0.0]), filming.size)
        tilt, yaw, roll = np.radians([filming.tilt, filming.yaw, filming.roll])
        side = -1.0 if filming.behind else 1.0
        forward = np.array([np.sin(yaw) * np.cos(tilt), side * np.cos(yaw) * np.cos(tilt), -np.sin(tilt)])
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
        rotation = np.stack([right, down, forward])
        # The picture's middle, not the principal point, looks at the target.
        middle = np.array([[0.5 * (width - 1), 0.5 * (height - 1)]])
        ray = np.append(_rays(camera, middle)[0], 1.0) @ rotation
        target = np.array([filming.target[0], 0.0, filming.target[1]])
        place = target - ray * filming.distance
        return cls(camera, as_vector(rotation), -rotation @ place)

    @cached_property
    def matrix(self) -> Array:
        """Shape (3, 3): the rotation."""
        return np.asarray(cv2.Rodrigues(self.rotation)[0], dtype=np.float64)

    @cached_property
    def place(self) -> Array:
        """Shape (3,): where the camera is, m."""
        return np.asarray(-self.matrix.T @ self.translation)

    def pixels(self, points: Array) -> Array:
        """Pixels, shape (..., 2), of points of the robot's frame, shape (..., 3), m."""
        flat = self.camera.project(points.reshape(-1, 3), self.rotation, self.translation)
        return flat.reshape(*points.shape[:-1], 2)

    def in_plane(self, points: Array, y: float = 0.0) -> Array:
        """Pixels of points x, z, shape (..., 2), in a plane parallel to the folding plane."""
        return self.pixels(np.stack([points[..., 0], np.full(points.shape[:-1], y), points[..., 1]], axis=-1))


def as_vector(rotation: Array) -> Array:
    """A rotation, shape (3, 3), as OpenCV takes it, shape (3,)."""
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()


def _rays(camera: Camera, pixels: Array) -> Array:
    """Shape (n, 2): the direction in which each pixel looks, at depth 1, without the lens's distortion."""
    flat = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
    seen = cv2.undistortPoints(flat, camera.matrix, camera.distortion, R=None, P=None, criteria=_EXACT)
    return np.asarray(seen, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Rays:
    """Where the pixels of a camera look, each divided into ``fine`` x ``fine``.

    Attributes
    ----------
    camera
        The camera.
    fine
        Samples per pixel and direction.
    """

    camera: Camera
    fine: int = 4

    @cached_property
    def directions(self) -> NDArray[np.float32]:
        """Shape (fine * height, fine * width, 2): x and y at depth 1."""
        width, height = self.camera.size
        columns = (np.arange(width * self.fine) + 0.5) / self.fine - 0.5
        rows = (np.arange(height * self.fine) + 0.5) / self.fine - 0.5
        found = np.empty((len(rows), len(columns), 2), dtype=np.float32)
        # Row by row: what OpenCV needs for a whole large picture at once would be gigabytes.
        for start in range(0, len(rows), 64):
            some = rows[start : start + 64]
            grid = np.stack(np.meshgrid(columns, some), axis=-1)
            found[start : start + 64] = _rays(self.camera, grid).reshape(*grid.shape)
        return found

    def on_plane(self, to_plane: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Coordinates of a plane at each sample, by a homography from (x, y, 1) at depth 1; nan behind the camera."""
        x, y = self.directions[..., 0], self.directions[..., 1]
        h = to_plane.astype(np.float32)
        depth = h[2, 0] * x + h[2, 1] * y + h[2, 2]
        depth = np.where(depth > 0.0, depth, np.float32(np.nan))
        return (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / depth, (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / depth

    def averaged(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        """Shape (height, width): the mean over the samples of each pixel."""
        return np.asarray(cv2.resize(samples, self.camera.size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def plane_homography(rotation: Array, translation: Array) -> Array:
    """From (x, y, 1) at depth 1 to the plane's own two coordinates.

    Parameters
    ----------
    rotation
        Shape (3, 3): its columns are the plane's first axis, its second and its normal, in the camera's frame.
    translation
        Shape (3,): the plane's origin in the camera's frame, m.

    Returns
    -------
    Shape (3, 3), with the sign that makes the last coordinate positive in front of the camera.
    """
    inverse = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], translation]))
    # The plane's point (u, v) is seen at depth * (x, y, 1): the last coordinate of the inverse is 1 / depth.
    return np.asarray(inverse)

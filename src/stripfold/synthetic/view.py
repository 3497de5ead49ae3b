"""The camera's pose, the rays of its pixels, and a grey picture that polygons cover by exact shares of its pixels.

A side of a polygon covers, in each row of pixels that it crosses, what is to its right; the sides together leave what
is between them.  They are cut where they cross rows and columns, their shares added up in the pixels that they cross,
and the sums accumulated along the rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from stripfold import kernels
from stripfold.base.arrays import Array
from stripfold.film.camera import Camera
from stripfold.synthetic.scene import Filming

Light = NDArray[np.float32]

_SPACING = 8
"""Distance of the pixels whose rays are computed, pixels: between them a spline is exact to 1e-4 px."""


@dataclass(frozen=True, eq=False)
class View:
    """A camera and its pose in the robot frame: x along the table, z up, y = 0 in the folding plane.

    Robot y points away from a camera that is not ``behind``.  ``rotation`` and ``translation`` (m), shapes (3,), take
    the robot frame to the camera's, in OpenCV's convention.
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
        # The middle of the picture, not the principal point, looks at the target.
        middle = np.array([[0.5 * (width - 1), 0.5 * (height - 1)]])
        ray = camera.rays(middle)[0] @ rotation
        place = np.array([filming.target[0], 0.0, filming.target[1]]) - ray * filming.distance
        return cls(camera, rotation_vector(rotation), -rotation @ place)

    @cached_property
    def matrix(self) -> Array:
        """Shape (3, 3): the rotation."""
        return np.asarray(cv2.Rodrigues(self.rotation)[0], dtype=np.float64)

    @cached_property
    def place(self) -> Array:
        """Shape (3,): position of the camera, m."""
        return np.asarray(-self.matrix.T @ self.translation)

    def in_plane(self, points: Array, y: Array | float = 0.0) -> Array:
        """Pixels of points x, z, shape (..., 2), m, in the folding plane, or in parallel planes at ``y``."""
        places = np.stack(np.broadcast_arrays(points[..., 0], y, points[..., 1]), axis=-1)
        flat = self.camera.project(places.reshape(-1, 3), self.rotation, self.translation)
        return flat.reshape(*places.shape[:-1], 2)


def rotation_vector(rotation: Array) -> Array:
    """A rotation matrix as OpenCV's rotation vector, shape (3,)."""
    return np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64).ravel()


@dataclass(frozen=True, eq=False)
class Rays:
    """The rays of a camera's pixels, each pixel divided into ``fine`` x ``fine`` samples."""

    camera: Camera
    fine: int = 4

    @cached_property
    def directions(self) -> Light:
        """Shape (fine * height, fine * width, 2): x and y at depth 1."""
        places = [(np.arange(n * self.fine) + 0.5) / self.fine - 0.5 for n in self.camera.size]
        columns, rows = (np.linspace(-1.0, n, n // _SPACING + 4) for n in self.camera.size)
        x, y, _ = self.camera.rays(np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)).T
        shape = len(rows), len(columns)
        smooth = [RectBivariateSpline(rows, columns, values.reshape(shape))(*places[::-1]) for values in (x, y)]
        return np.stack(smooth, axis=-1, dtype=np.float32, casting="same_kind")

    def on_plane(self, axes: Array, origin: Array) -> tuple[Light, Light]:
        """Coordinates on a plane at each sample, m; nan behind the camera.

        The first two columns of ``axes`` are the axes of the plane, ``origin``, shape (3,), m, its origin, both in the
        camera frame.
        """
        # The point (u, v) is seen at depth * (x, y, 1): the last coordinate of the inverse is 1 / depth.
        h = np.linalg.inv(np.column_stack([axes[:, 0], axes[:, 1], origin])).astype(np.float32)
        x, y = self.directions[..., 0], self.directions[..., 1]
        depth = h[2, 0] * x + h[2, 1] * y + h[2, 2]
        depth = np.where(depth > 0.0, depth, np.float32(np.nan))
        return (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / depth, (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / depth

    def averaged(self, samples: Light) -> Light:
        """Shape (height, width): the mean over the samples of each pixel."""
        return np.asarray(cv2.resize(samples, self.camera.size, interpolation=cv2.INTER_AREA), dtype=np.float32)


class Canvas:
    """A picture to draw on, shape (height, width), 255 for white; pixel centres are at integers."""

    def __init__(self, background: Light) -> None:
        self._background, self._rows = background, (0, len(background))
        self.picture = background.copy()

    def clear(self, rows: tuple[int, int] | None = None) -> None:
        """Begin with the background; only these rows, first and end, are drawn from now on."""
        self._rows = rows or (0, len(self._background))
        self.picture[slice(*self._rows)] = self._background[slice(*self._rows)]

    def polygons(self, *layers: tuple[Array, float]) -> None:
        """Draw polygons, shape (n, k, 2), pixels, in a grey from 0 to 1; further layers lie within the ones before."""
        starts, ends = [], []
        weights: list[Array] = []
        below = 0.0
        for corners, grey in layers:
            following = np.roll(corners, -1, axis=1)
            area = np.sum(corners[..., 0] * following[..., 1] - following[..., 0] * corners[..., 1], axis=1)
            sign = np.repeat(-np.sign(area), corners.shape[1])
            starts.append(corners.reshape(-1, 2))
            ends.append(following.reshape(-1, 2))
            weights.append(np.stack([0.0 * sign if len(weights) else sign, (grey - below) * sign]))
            below = grey
        self._draw(np.concatenate(starts), np.concatenate(ends), np.concatenate(weights, axis=1), 1.0)

    def ribbon(self, one: Array, other: Array, greys: Array | float, alpha: float = 1.0) -> None:
        """Draw what is between two lines, shape (n, 2), pixels: pieces of a grey each, (n - 1,), without seams."""
        low, high = np.minimum(one, other), np.maximum(one, other)
        low, high = np.minimum(low[:-1], low[1:]), np.maximum(high[:-1], high[1:])
        least, most = [-0.5, self._rows[0] - 0.5], [self.picture.shape[1] - 0.5, self._rows[1] - 0.5]
        (a, b), (c, d) = (other[1:] - one[:-1]).T, (other[:-1] - one[1:]).T
        sign = np.where(np.all((high > least) & (low < most), axis=1), np.sign(b * c - a * d), 0.0)
        weights = np.stack([sign, sign * greys])
        # Two pieces share the side between them: only what differs is drawn there.
        between = -np.diff(weights, prepend=0.0, append=0.0)
        start, end = np.concatenate([one[:-1], other[1:], one]), np.concatenate([one[1:], other[:-1], other])
        self._draw(start, end, np.concatenate([weights, weights, between], axis=1), alpha)

    def _draw(self, start: Array, end: Array, weights: Array, alpha: float) -> None:
        """Draw what is inside of directed lines, shape (n, 2), that form closed polygons.

        ``weights``, shape (2, n): what they add to the covered share of the pixels to their right, and to this share
        times its grey.
        """
        kernels.coverage.draw(self.picture, *self._rows, start, end, weights, alpha)

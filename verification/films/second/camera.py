"""A pinhole camera whose lens follows the division model, with light fall-off, tone curve and noise.

The picture is drawn on a canvas as a perfect pinhole would see it, :data:`FINE` times finer, and taken from there pixel
by pixel.
"""

from __future__ import annotations

from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Canvas = NDArray[np.uint8]
Light = NDArray[np.float32]

FINE = 3
"""Pixels of the canvas along one of the sensor."""
FULL = 200.0
"""Value on the canvas of white in full light; beyond it are highlights."""
_BITS = 4
"""Binary digits of a canvas pixel in the corners of polygons."""


class Camera:
    """A camera at ``distance`` from the origin of the folding plane, which it shows in the middle, ``field`` m wide.

    World: x to the right and z up in the folding plane, y away from the camera.  ``tilt`` downwards, ``yaw`` and
    ``roll`` are in degrees; a point r from the axis at depth 1 is seen at d, r = d / (1 + ``bend`` d^2).
    """

    def __init__(
        self,
        size: tuple[int, int],
        field: float,
        distance: float,
        bend: float,
        tilt: float = 4.0,
        yaw: float = 0.0,
        roll: float = 0.0,
    ) -> None:
        self.size, self.bend = size, bend
        self.focal = size[0] * distance / field
        self.centre = np.array([0.489 * size[0], 0.508 * size[1]])
        a, b, c = np.radians([tilt, yaw, roll])
        forward = np.array([np.sin(b) * np.cos(a), np.cos(b) * np.cos(a), -np.sin(a)])
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        right, down = np.cos(c) * right + np.sin(c) * down, np.cos(c) * down - np.sin(c) * right
        self.axes = np.stack([right, down, forward])
        self.place = -distance * forward

    def project(self, points: Array) -> Array:
        """Pixels, shape (..., 2), of points of the world, shape (..., 3), m."""
        return self.focal * self._bent(self._flat(points)) + self.centre

    def rays(self, pixels: Array) -> Array:
        """Directions in the world, shape (..., 3), in which pixels, shape (..., 2), look; of depth 1."""
        flat = self._straight((pixels - self.centre) / self.focal)
        return np.asarray(flat @ self.axes[:2] + self.axes[2])

    def on_canvas(self, points: Array) -> Array:
        """Places on the canvas, shape (..., 2), of points of the world, shape (..., 3), m."""
        return (self.focal * self._flat(points) - self._corner + 0.5) * FINE - 0.5

    def ideal_rays(self) -> Array:
        """Directions in the world of the canvas at the sensor's resolution, shape (height, width, 3)."""
        pixels = np.stack(np.meshgrid(*map(np.arange, self._extent)), axis=-1)
        return np.asarray((pixels + self._corner) / self.focal @ self.axes[:2] + self.axes[2])

    def seen(self, canvas: Canvas, blur: float) -> Light:
        """What the lens throws on the sensor, shape (height, width), white being 1; ``blur`` in pixels."""
        width, height = self._extent
        small = cv2.resize(canvas, (int(width), int(height)), interpolation=cv2.INTER_AREA).astype(np.float32)
        soft = cv2.GaussianBlur(small, (0, 0), blur)
        return np.asarray(cv2.remap(soft, *self._source, cv2.INTER_CUBIC) / FULL * self._falloff, dtype=np.float32)

    def _flat(self, points: Array) -> Array:
        seen = (points - self.place) @ self.axes.T
        return np.asarray(seen[..., :2] / seen[..., 2:])

    def _bent(self, flat: Array) -> Array:
        square = np.sum(flat**2, axis=-1, keepdims=True)
        return np.asarray(2.0 * flat / (1.0 + np.sqrt(1.0 - 4.0 * self.bend * square)))

    def _straight(self, bent: Array) -> Array:
        return np.asarray(bent / (1.0 + self.bend * np.sum(bent**2, axis=-1, keepdims=True)))

    @cached_property
    def _ideal(self) -> Array:
        """Where a pinhole would see what each pixel sees, pixels from the axis, shape (height, width, 2)."""
        pixels = np.stack(np.meshgrid(*map(np.arange, self.size)), axis=-1)
        return self.focal * self._straight((pixels - self.centre) / self.focal)

    @cached_property
    def _corner(self) -> Array:
        return np.floor(self._ideal.min(axis=(0, 1))) - 4.0

    @cached_property
    def _extent(self) -> NDArray[np.int64]:
        return np.asarray(np.ceil(self._ideal.max(axis=(0, 1))) + 5.0 - self._corner, dtype=np.int64)

    @cached_property
    def _source(self) -> tuple[Light, Light]:
        x, y = np.moveaxis((self._ideal - self._corner).astype(np.float32), -1, 0)
        return x, y

    @cached_property
    def _falloff(self) -> Light:
        """cos^4 of the angle from the axis, of a lens twice as wide."""
        square = np.sum((2.0 * self._ideal / self.focal) ** 2, axis=-1)
        return np.asarray((1.0 + square) ** -2, dtype=np.float32)


def polygons(canvas: Canvas, corners: Array, values: Array) -> None:
    """Fill convex polygons, shape (n, k, 2), canvas pixels, with values, shape (n,) or longer, one after the other."""
    fixed = np.rint(corners * 2**_BITS).astype(np.int32)
    for one, value in zip(fixed, values.tolist(), strict=False):
        cv2.fillConvexPoly(canvas, one, (value,), cv2.LINE_8, _BITS)


def sheet(canvas: Canvas, texture: Canvas, corners: Array) -> None:
    """Draw a flat sheet: the corners of its texture, clockwise from its first pixel, are at places of shape (4, 2)."""
    rows, columns = texture.shape
    of = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], dtype=np.float32) - 0.5
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 2, canvas.shape[::-1])
    matrix = cv2.getPerspectiveTransform(of, (corners - low).astype(np.float32))
    part = canvas[low[1] : high[1], low[0] : high[0]]
    cv2.warpPerspective(
        texture, matrix, part.shape[::-1], dst=part, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_TRANSPARENT
    )


def exposed(light: Light, gain: float, gamma: float, noise: Light, read: float, shot: float) -> Canvas:
    """The picture that a sensor delivers: a tone curve, and noise (a standard normal picture) that grows with light."""
    value = 255.0 * np.clip(gain * light, 0.0, 1.0) ** gamma
    value += noise * np.sqrt(read**2 + shot**2 * value / 255.0)
    return np.asarray(np.clip(np.rint(value), 0, 255), dtype=np.uint8)

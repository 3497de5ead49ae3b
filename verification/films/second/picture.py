"""What the camera sees: a ribbon with a sheen over a table and before a wall, its shadow, and the gripper's marker.

The pinhole camera's lens follows the division model, with light fall-off, tone curve and noise.  A picture is drawn on
a canvas as a perfect pinhole would see it, :data:`FINE` times finer, and taken from there pixel by pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    ``roll`` are in degrees; a point r from the axis at depth 1 is seen at d, r = d / (1 + ``bend`` d^2).  Light
    falls off as in a lens ``wider`` times as wide.
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
        wider: float = 2.0,
    ) -> None:
        self.size, self.bend, self.wider = size, bend, wider
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
        """cos^4 of the angle from the axis."""
        square = np.sum((self.wider * self._ideal / self.focal) ** 2, axis=-1)
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


CELLS, CELL = 8, 16
"""Cells of the marker's card along its side with the white rim, and pixels of a cell."""
PAPER, INK = 0.9, 0.07
WALL = 0.3
"""Distance of the wall behind the folding plane, m."""
ROOM = np.random.default_rng(5).standard_normal((800, 100))
"""Noise that the textures of table and wall are made of: calibrations and films are of one room."""
STICKERS = 0.08
"""Distance of the stickers in a row on the wall, m."""
AMBIENT = 0.45
"""Share of the light that comes from everywhere."""


@dataclass(frozen=True)
class Look:
    """Looks of a scene; lengths in m, tones as shares of white.

    ``lamp`` points to the lamp; the strip's front edge recedes by ``recede`` and its width shrinks by ``narrowing`` (a
    share) from the gripper to the held end, and it is twisted by up to ``twist``, rad; ``hairs`` stick out of its edge.
    ``solid``: all of it is as thick as the edge in front.  ``ground``: z of the table.  ``turned``, ``leans``: angles
    by which the marker faces aside and leans, rad.
    """

    strip: float
    table: float
    wall: float
    lamp: tuple[float, float, float]
    sheen: float
    shadow: float
    width: float
    thickness: float
    recede: float
    narrowing: float
    twist: float
    hairs: int
    marker: int
    marker_size: float
    offset: tuple[float, float]
    solid: bool = False
    ground: float = 0.0
    turned: float = 0.0
    leans: float = 0.0


class Studio:
    """Draws canvases of a scene for a camera; ``rng`` is for the strip."""

    def __init__(self, camera: Camera, look: Look, rng: np.random.Generator) -> None:
        self.camera, self.look = camera, look
        self._lamp = np.array(look.lamp) / np.linalg.norm(look.lamp)
        bits = cv2.aruco.generateImageMarker(
            cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), look.marker, CELLS - 2
        )
        tones = np.where(np.pad(bits, 1, constant_values=255) > 0, PAPER, INK) * FULL * 0.9
        self._card = np.kron(tones, np.ones((CELL, CELL))).astype(np.uint8)
        self._hairs = rng.uniform([0.0, -1.2, 0.3], [1.0, 1.2, 1.0], (look.hairs, 3))
        self._weave = 1.0 + 0.04 * rng.standard_normal(1000)

    @cached_property
    def _scenery(self) -> tuple[Canvas, Canvas]:
        """The empty picture as a pinhole sees it, and where it shows the table (255)."""
        rays, place, look = self.camera.ideal_rays(), self.camera.place, self.look
        to_table = (look.ground - place[2]) / np.minimum(rays[..., 2], -1e-9)
        to_wall = (WALL - place[1]) / rays[..., 1]
        table = to_table < to_wall
        spot = place + rays * np.where(table, to_table, to_wall)[..., None]
        # A table with a grain along x, a wall with soft blotches; textures of 1 mm and of 4 cm.
        u = (spot[..., 0] * np.where(table, 60.0, 25.0) + 40.0).astype(np.float32)
        v = (np.where(table, spot[..., 1] * 900.0, spot[..., 2] * 25.0) + 400.0).astype(np.float32)
        texture = cv2.GaussianBlur(ROOM.astype(np.float32), (0, 0), 0.7)
        rough = cv2.remap(texture, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        tone = np.where(table, look.table * self._lit(np.array([0.0, 0.0, 1.0])), look.wall * self._lit(-np.eye(3)[1]))
        tone = tone * (1.0 + np.where(table, 0.05, 0.03) * rough) * (1.0 - 0.25 * spot[..., 0])
        sticker = (np.mod(spot[..., 0] / STICKERS, 1.0) < 0.15) & (np.abs(spot[..., 2] - 0.11) < 0.008)
        tone = tone * np.where(sticker & ~table, 0.6, 1.0)
        return (FULL * np.clip(tone, 0.0, 1.2)).astype(np.uint8), (255 * table).astype(np.uint8)

    def empty(self, shade: Canvas | None = None) -> Canvas:
        """The canvas with table and wall, the table in a shade, 255 being full light, of the size of the picture."""
        light, table = self._scenery
        if shade is not None:
            light = cv2.multiply(light, cv2.max(shade, 255 - table), scale=1.0 / 255.0)
        return np.asarray(cv2.resize(light, None, fx=FINE, fy=FINE, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)

    def board(self, columns: int, rows: int, square: float, right: Array, down: Array, middle: Array) -> Canvas:
        """A chessboard of so many squares: its middle and the unit vectors along its axes have shape (3,)."""
        y, x = np.mgrid[-1 : rows + 1, -1 : columns + 1]
        inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
        tones = np.where(inside & ((x + y) % 2 == 0), INK, PAPER) * FULL * self._lit(np.cross(down, right))
        texture = np.kron(tones, np.ones((48, 48))).astype(np.uint8)
        size = square * np.array([columns + 2, rows + 2]) / 2.0
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size
        canvas = self.empty()
        sheet(canvas, texture, self.camera.on_canvas(middle + signs @ np.stack([right, down])))
        return canvas

    def print(self, canvas: Canvas, low: Array, size: Array, tones: Canvas, depth: float = 0.0) -> None:
        """An upright print behind the folding plane, in grey values: its lower left corner, size and depth, m."""
        corners = low + size * np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
        light = FULL * self._lit(np.array([0.0, -1.0, 0.0]))
        shown = ((INK + (PAPER - INK) * tones / 255.0) * light).astype(np.uint8)
        sheet(canvas, shown, self.camera.on_canvas(_at(corners, depth)))

    def gripper(self, canvas: Canvas, end: Array) -> None:
        """The finger, the arm and the marker's card of a gripper that holds the strip's end at x and z."""
        x, z = end - np.array(self.look.offset)
        half = CELLS / (CELLS - 2) * self.look.marker_size / 2.0
        square = np.array([[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])
        finger = np.array([[x, z], [x, z], end, end]) + square * [0.004, 0.002]
        arm = np.array([x, z + 0.5]) + square * [0.3 * half, 0.5]
        polygons(
            canvas, self.camera.on_canvas(np.stack([_at(arm, 0.001), _at(finger, -0.001)])), np.array([100.0, 60.0])
        )
        angles = np.array([self.look.turned, self.look.leans])
        card = _at(np.array([x, z]) + half * square * np.cos(angles), 0.0)
        card[:, 1] += half * square @ np.sin(angles)
        sheet(canvas, self._card, self.camera.on_canvas(card))

    def frame(self, curve: Array, end: Array) -> Canvas:
        """The strip along a curve, shape (n, 2), x and z from the gripped end, m, and its gripper at ``end``."""
        canvas = self.strip(curve)
        self.gripper(canvas, end)
        return canvas

    def strip(self, curve: Array, backdrop: float | None = None, tone: float = 1.0) -> Canvas:
        """The strip alone; on a ``backdrop`` at this depth, m, of this ``tone``, it casts a shadow, too."""
        look, n = self.look, len(curve)
        share = np.linspace(0.0, 1.0, n)
        along = np.gradient(curve, axis=0)
        along /= np.hypot(*along.T)[:, None]
        normal = np.column_stack([-along[:, 1], along[:, 0]])
        width, front = look.width * (1.0 - look.narrowing * share), look.recede * share
        thick = 0.5 * look.thickness * (1.0 + 0.3 * np.sin(40.0 * share))[:, None] * normal
        turned = (width * np.tan(look.twist * np.sin(5.0 * share)))[:, None] * normal
        near, far = _at(curve, front), _at(curve + turned, front + width)
        canvas = self.empty(self._shadow(near[::2], far[::2]))
        if backdrop is not None:
            self._behind(canvas, near, far, backdrop, tone)
        faces = FULL * look.strip * self._shade(curve, normal) * self._weave[:n]
        edge = FULL * look.strip * self._lit(np.array([0.0, -1.0, 0.0])) * self._weave[-n:]
        # The camera looks down: what is higher hides what is lower.
        order = np.argsort(curve[:-1, 1] + curve[1:, 1])
        polygons(canvas, self._pieces(near, far)[order], faces[order])
        if look.solid:
            for side in (thick, -thick):
                raised = _at(side, 0.0)
                polygons(canvas, self._pieces(near + raised, far + raised)[order], faces[order])
        polygons(canvas, self._pieces(_at(curve + thick, front), _at(curve - thick, front)), edge)
        where, lean, long = self._hairs.T
        i = (where * (n - 1)).astype(int)
        across = (np.sign(lean) * np.cos(lean))[:, None] * normal[i] + np.sin(lean)[:, None] * along[i]
        roots, tips = (
            np.rint(self.camera.on_canvas(_at(curve[i] + size[:, None] * across, front[i]))).astype(int).tolist()
            for size in (0.0 * long, 0.003 * long)
        )
        for root, tip in zip(roots, tips, strict=True):
            cv2.line(canvas, root, tip, (0.8 * float(edge[0]),), 1)
        return canvas

    def _behind(self, canvas: Canvas, near: Array, far: Array, depth: float, tone: float) -> None:
        """A backdrop that stands on the table, with the shadow that the strip casts on it."""
        low = self.look.ground
        corners = np.array([[-2.0, low + 1.0], [2.0, low + 1.0], [2.0, low], [-2.0, low]])
        light = FULL * tone * self._lit(np.array([0.0, -1.0, 0.0]))
        polygons(canvas, self.camera.on_canvas(_at(corners, depth))[None], np.array([light]))
        cast = [line + (depth - line[:, 1:2]) / self._lamp[1] * self._lamp for line in (near, far)]
        above = np.minimum(cast[0][:-1, 2], cast[1][1:, 2]) > low
        dark = np.full(len(near) - 1, light * (1.0 - self.look.shadow))
        polygons(canvas, self._pieces(*cast)[above], dark)

    def _pieces(self, one: Array, other: Array) -> Array:
        """The quadrilaterals between two lines of the world, on the canvas, shape (n - 1, 4, 2)."""
        a, b = self.camera.on_canvas(one), self.camera.on_canvas(other)
        return np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=1)

    def _lit(self, normal: Array) -> float:
        return AMBIENT + (1.0 - AMBIENT) * max(float(normal @ self._lamp), 0.0)

    def _shade(self, curve: Array, normal: Array) -> Array:
        """Lambert's law and a highlight on the side of the ribbon that faces the camera, shape (n,)."""
        to_camera = self.camera.place - _at(curve, 0.0)
        to_camera /= np.linalg.norm(to_camera, axis=1)[:, None]
        facing = _at(normal, 0.0)
        facing *= np.sign(np.sum(facing * to_camera, axis=1) + 1e-12)[:, None]
        half = to_camera + self._lamp
        half /= np.linalg.norm(half, axis=1)[:, None]
        gloss = np.maximum(np.sum(facing * half, axis=1), 0.0) ** 24
        return np.asarray(AMBIENT + (1.0 - AMBIENT) * np.maximum(facing @ self._lamp, 0.0) + self.look.sheen * gloss)

    def _shadow(self, near: Array, far: Array) -> Canvas:
        """The light on the table under the strip between two lines of the world, 255 being full."""
        shade = np.full_like(self._scenery[0], 255)
        cast = [line - (line[:, 2:] - self.look.ground) / self._lamp[2] * self._lamp for line in (near, far)]
        dark = np.full(len(near) - 1, 255.0 * (1.0 - self.look.shadow))
        polygons(shade, self._pieces(*cast) / FINE, dark)
        return np.asarray(cv2.GaussianBlur(shade, (0, 0), 1.5), dtype=np.uint8)


def _at(curve: Array, y: Array | float) -> Array:
    """Points x, z of a curve, shape (n, 2), in the world at depths y."""
    return np.column_stack([curve[:, 0], np.broadcast_to(y, len(curve)), curve[:, 1]])

"""The picture of the strip, the gripper and the table at one time, before exposure, light and noise."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from stripfold.base.arrays import Array
from stripfold.film import plate
from stripfold.film.boards import black_cells
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.view import Canvas, Light, Rays, View

FRONT, BACK = -0.05, 0.4
"""Front edge of the table and the wall behind it: distances from the folding plane, m."""
CLAMP, FINGER, ARM, PAPER, INK = 0.12, 0.45, 0.2, 0.95, 0.05
"""Greys, relative to white."""
TAPE, TAPE_GAP, TAPE_SIDE = 0.6, (0.1, 0.18), (0.02, 0.004)
"""Crosses of tape on the wall, which show whether the camera stands still: grey relative to the wall's; distances along
x and z, length and width of a strip of tape, m."""
DICTIONARY: Final = "4x4_50"
"""Of the gripper's marker and of the ChArUco board."""
_LIGHT = np.array([-0.35, 0.94])
_SHADOW = (0.25, 0.35)
"""Offset of a shadow along x and in depth, per height."""


class Renderer:
    """Draws one scene; ``first``, shape (n, 2), m, is a curve of the strip, for the arc lengths of its points."""

    def __init__(self, scene: Scene, first: Array) -> None:
        self.scene, self._first = scene, first
        self.view = View.of(scene.filming)
        self.depth = -1.0 if scene.filming.behind else 1.0
        """Sign of robot y behind the folding plane, seen from the camera."""
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(first, axis=0), axis=1))])
        pixel = scene.filming.field / scene.filming.size[0]
        self._stations = np.linspace(0.0, 1.0, int(np.clip(scene.length / (1.4 * pixel), 80, 600)) + 1)
        # A spline is linear in its points: one matrix serves all curves.
        self._refine = CubicSpline(arc / arc[-1], np.eye(len(arc)))(self._stations)
        rng = np.random.default_rng([scene.seed, 1])
        weave = 1.0 + scene.strip.texture * rng.standard_normal((2, len(self._stations) - 1))
        if scene.strip.stripe:
            place = 0.5 * (self._stations[1:] + self._stations[:-1]) * scene.length
            weave *= np.where(place // scene.strip.stripe % 2.0, scene.strip.stripe_shade, 1.0)
        self._surface_grey, self._edge_grey = scene.strip.grey * weave[0], scene.strip.edge * weave[1]
        hairs = rng.poisson(scene.strip.hairs * scene.length)
        self._hairs = (rng.uniform(0.0, 1.0, hairs), rng.uniform(0.0, 2.0 * np.pi, hairs), rng.gamma(4.0, 5e-4, hairs))

    @cached_property
    def channels(self) -> list[Renderer]:
        """One renderer; for a coloured strip those of its red, green and blue light, with the greys of each."""
        strip = self.scene.strip
        if strip.colour is None:
            return [self]
        greys = [strip.model_copy(update={"colour": None, "grey": value, "edge": value}) for value in strip.colour]
        return [Renderer(self.scene.model_copy(update={"strip": grey}), self._first) for grey in greys]

    @cached_property
    def canvas(self) -> Canvas:
        """On the empty table and what is behind it."""
        filming, rays, turn = self.scene.filming, Rays(self.view.camera, 2), self.view.matrix
        x, y, z = np.eye(3) * [[1.0], [self.depth], [1.0]]

        def seen(first: Array, second: Array, origin: Array) -> tuple[Light, Light]:
            return rays.on_plane(turn @ np.column_stack([first, second]), turn @ origin + self.view.translation)

        top = -0.5 * self.scene.strip.thickness
        table, into = seen(x, y, top * z)
        front, height = seen(x, z, FRONT * y)
        grain = _grain(np.random.default_rng([self.scene.seed, 2]), table, into)
        with np.errstate(invalid="ignore"):
            on_table = (into >= FRONT) & (into <= BACK)
            below = ~on_table & (height < top)
        place = seen(x, z, BACK * y)
        wall = filming.background * (1.0 + 0.02 * _blotches(*place)) * np.where(_tape(*place), TAPE, 1.0)
        grey = np.where(on_table, filming.table * (1.0 + filming.grain * grain), wall)
        grey = np.where(below, 0.5 * filming.table * (1.0 + 0.02 * _blotches(front, height)), grey)
        return Canvas(rays.averaged(np.asarray(255.0 * np.clip(grey, 0.0, 1.0), dtype=np.float32)))

    def picture(
        self, curve: Array | None, gripper: Array, occluder: float | None = None, rows: tuple[int, int] | None = None
    ) -> Light:
        """The picture at one time, shape (height, width), 255 for white in full light; the next call overwrites it.

        ``curve``, shape (n, 2), is the mid-surface from the gripped end to the held end, m, or None for no strip;
        ``gripper``, shape (2,), the gripped end, m; ``occluder`` the x of the object in front of the strip, m.  Only
        the ``rows`` from first to end are drawn.
        """
        self.canvas.clear(rows)
        if curve is not None:
            fine = self._refine @ curve
            self._shadow(fine[::2])
            self._strip(fine)
            self._hair(fine)
            x, _ = curve[-1]
            self.canvas.polygons((self._block((x - 0.004, x + 0.03), (-0.002, 0.012)), CLAMP))
        if self.scene.filming.plate is not None:
            self.canvas.polygons((self._plate[0], PAPER), (self._plate[1], INK))
        self._gripper(gripper)
        if occluder is not None:
            half = 0.5 * self.scene.filming.occluder
            self.canvas.polygons((self._block((occluder - half, occluder + half), (-1.0, 1.0), y=-0.08), 0.08))
        return self.canvas.picture

    def _strip(self, fine: Array) -> None:
        strip = self.scene.strip
        tangent = np.gradient(fine, axis=0)
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # Lower and upper surface, at the edge in the folding plane and at the other edge.
        surfaces = fine + 0.5 * strip.thickness * np.array([[[-1.0]], [[1.0]]]) * normal
        near, far = self.view.in_plane(surfaces[None], self.depth * strip.width * np.array([0.0, 1.0])[:, None, None])
        shade = 0.7 + 0.3 * np.abs(normal[:-1] @ _LIGHT)
        for part, facing in visible_runs(fine, self.view.place[[0, 2]]):
            nodes = slice(part.start, part.stop + 1)
            self.canvas.ribbon(near[facing, nodes], far[facing, nodes], (self._surface_grey * shade)[part])
        self.canvas.ribbon(near[0], near[1], self._edge_grey)

    def _hair(self, fine: Array) -> None:
        """Loose fibres at the edge."""
        where, angle, length = self._hairs
        if not len(where):
            return
        foot = np.column_stack([np.interp(where, self._stations, fine[:, i]) for i in range(2)])
        along = np.column_stack([np.cos(angle), np.sin(angle)])
        tip, side = foot + length[:, None] * along, 1e-4 * along[:, ::-1] * [-1.0, 1.0]
        tip[:, 1] = np.maximum(tip[:, 1], 0.0)
        corners = self.view.in_plane(np.stack([foot - side, tip - side, tip + side, foot + side], axis=1))
        self.canvas.polygons((corners, self.scene.strip.edge))

    def _shadow(self, fine: Array) -> None:
        """The strip's shadow on the table."""
        lifted = np.clip(fine[:, 1], 0.0, None)
        line = np.column_stack(
            [fine[:, 0] + _SHADOW[0] * lifted, np.full(len(fine), -0.5 * self.scene.strip.thickness)]
        )
        y = self.depth * (_SHADOW[1] * lifted + np.array([[0.0], [self.scene.strip.width]]))
        near, far = self.view.in_plane(line[None], y)
        self.canvas.ribbon(near, far, 0.0, 0.3)

    def _block(self, x: tuple[float, float], z: tuple[float, float], y: float = 0.0) -> Array:
        """An upright rectangle parallel to the folding plane, shape (1, k, 2), pixels; the lens bends its sides."""
        return self.view.in_plane([x[0], z[0]] + _SQUARE * [x[1] - x[0], z[1] - z[0]], self.depth * y)

    def _gripper(self, end: Array) -> None:
        gripper = self.scene.gripper
        x, z = end - gripper.offset
        half = 0.5 * gripper.marker_size
        card = 1.4 * half
        self.canvas.polygons((self._block((x - 0.007, x + 0.007), (z, z + 1.0), y=0.004), ARM))
        tip = end[1] - gripper.finger
        finger = np.array([[x - 0.008, z], [end[0] - 0.0035, tip], [end[0] + 0.0035, tip], [x + 0.008, z]])
        self.canvas.polygons((self.view.in_plane(finger)[None], FINGER))
        self.canvas.polygons(
            (self._block((x - card, x + card), (z - card, z + card)), PAPER),
            (self._block((x - half, x + half), (z - half, z + half)), INK),
            (self.view.in_plane(np.array([x, z]) + self._cells), PAPER),
        )

    @cached_property
    def _plate(self) -> tuple[Array, Array]:
        """Sheet, shape (1, k, 2), and black squares and cells of the plate, shape (n, k, 2), pixels."""
        board, at, faces = plate.LONG, self.scene.filming.plate, np.array([self.depth, 1.0])
        upper, lower = plate.outline(board)
        square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        white = (np.array([upper[0], 0.0]) + square * [lower[0] - upper[0], upper[1]])[None]
        left, down, side = board.black.T[..., None]
        x, z = left + side * square[:, 0], (plate.FOOT + board.rows) * board.square - down - side * square[:, 1]
        black = np.stack([x, z], axis=-1)
        # A camera behind the plane sees its print, too.
        filming, origin = self.scene.filming, np.array([at, 0.0])
        scale, depth = filming.plate_scale * faces, self.depth * filming.plate_depth
        sheet, ink_of = (self.view.in_plane(origin + divided(part, 6) * scale, depth) for part in (white, black))
        return sheet, ink_of

    @cached_property
    def _cells(self) -> Array:
        """Shape (n, 4, 2): the white cells of the marker, from its centre, m."""
        white = marker_cells(self.scene.gripper.marker)
        side = self.scene.gripper.marker_size / len(white)
        row, column = np.nonzero(white)
        # A camera behind the plane would see the marker mirrored: it is on the side that faces the camera.
        place = np.column_stack([column, -row]) - 0.5 * len(white) * np.array([1.0, -1.0])
        corners = place[:, None] + np.array([[0, 0], [1, 0], [1, -1], [0, -1]])
        return np.asarray(side * corners * np.array([self.depth, 1.0]))


def marker_cells(number: int) -> Array:
    """The cells of a marker with its rim, shape (n, n): 1 for white."""
    return np.asarray(~black_cells(DICTIONARY, number), dtype=np.float64)


def divided(corners: Array, count: int) -> Array:
    """Polygons, shape (n, k, d), with each side divided into ``count``, since a lens bends it: (n, k count, d)."""
    sides = np.linspace(corners, np.roll(corners, -1, axis=1), count, endpoint=False, axis=2)
    return sides.reshape(len(corners), -1, corners.shape[2])


_SQUARE = divided(np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]]), 8)


def visible_runs(curve: Array, eye: Array) -> list[tuple[slice, int]]:
    """The parts of a cross-section of which the eye sees one side, the farthest first: the order in which to draw them.

    Seen from the eye, a part never overlaps itself, and of two that do not cross one is behind wherever both are.  For
    a ``curve``, shape (n, 2), and an ``eye``, shape (2,): the segments of each part, and 1 if the eye is on its left,
    else 0.
    """
    ray = curve - eye
    angle, distance = np.arctan2(ray[:, 0], -ray[:, 1]), np.hypot(*ray.T)
    turn = np.diff(angle)
    # Straight above the eye the angle jumps.
    jump = np.abs(turn) > np.pi
    left = (turn > 0.0) ^ jump
    cuts = np.flatnonzero((left[1:] != left[:-1]) | jump[1:] | jump[:-1]) + 1
    parts = [slice(*pair) for pair in pairwise([0, *cuts.tolist(), len(left)])]
    profiles = []
    for part in parts:
        nodes = slice(part.start, part.stop + 1)
        order = np.argsort(angle[nodes])
        profiles.append((angle[nodes][order], distance[nodes][order]))

    def behind(one: int, other: int) -> bool:
        low = max(profiles[one][0][0], profiles[other][0][0])
        high = min(profiles[one][0][-1], profiles[other][0][-1])
        if low >= high:
            return False
        between = np.linspace(low, high, 9)[1:-1]
        return bool(np.mean(np.interp(between, *profiles[one]) - np.interp(between, *profiles[other])) > 0.0)

    found: list[tuple[slice, int]] = []
    waiting = list(range(len(parts)))
    while waiting:
        # A cycle, which curves that do not cross cannot form, would be broken at any part.
        free = (i for i in waiting if not any(behind(j, i) for j in waiting if j != i))
        first = next(free, waiting[0])
        waiting.remove(first)
        found.append((parts[first], int(left[parts[first].start])))
    return found


def _grain(rng: np.random.Generator, u: Light, v: Light) -> Light:
    """A grain with unit standard deviation, longer along u, at places u and v, m."""
    rough = rng.standard_normal((256, 256)).astype(np.float32)
    smooth = cv2.GaussianBlur(np.tile(rough, (2, 2)), (0, 0), sigmaX=12.0, sigmaY=2.5)[128:384, 128:384]
    grain = np.asarray(smooth / smooth.std(), dtype=np.float32)
    places = [np.nan_to_num(np.mod(value * 400.0, 256.0)).astype(np.float32) for value in (u, v)]
    return np.asarray(cv2.remap(grain, places[0], places[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def _blotches(u: Light, v: Light) -> Light:
    """A smooth pattern between -1 and 1."""
    return np.nan_to_num(np.sin(23.0 * u + 3.0 * np.sin(17.0 * v)) * np.cos(31.0 * v + 1.0))


def _tape(x: Light, z: Light) -> NDArray[np.bool_]:
    """Where the crosses of tape on the wall are, at places x and z, m: the lowest row one distance above the table."""
    away = [np.abs(np.mod(value + 0.5 * gap, gap) - 0.5 * gap) for value, gap in zip((x, z), TAPE_GAP, strict=True)]
    long, wide = 0.5 * np.array(TAPE_SIDE)
    cross = (np.maximum(*away) < long) & (np.minimum(*away) < wide)
    return np.asarray(cross & (z > 0.5 * TAPE_GAP[1]))

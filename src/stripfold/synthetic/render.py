"""A picture of the strip, the gripper and the table at one moment: what reaches the sensor, before exposure."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from stripfold.arrays import Array
from stripfold.synthetic.canvas import Canvas, Grey
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.view import Rays, View, plane_homography

FRONT, BACK = -0.05, 0.4
"""Front edge of the table and the wall behind it, from the folding plane into the depth, m."""
CLAMP, FINGER, ARM = 0.12, 0.45, 0.2
"""Greys, as shares of white."""
_LIGHT = np.array([-0.35, 0.94])
_SHADOW = (0.25, 0.35)
"""How far a shadow falls along x and into the depth per height."""


def marker_dictionary() -> cv2.aruco.Dictionary:
    """The dictionary of the gripper's marker."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)


class Renderer:
    """Draws one scene.

    Parameters
    ----------
    scene
        The scene.
    first
        Shape (n, 2): the strip's curve at some moment; tells where along the strip the points of a curve are.
    """

    def __init__(self, scene: Scene, first: Array) -> None:
        self.scene = scene
        self.view = View.of(scene.filming)
        self.depth = -1.0 if scene.filming.behind else 1.0
        self._canvas = Canvas(scene.filming.size)
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(first, axis=0), axis=1))])
        pixel = scene.filming.field / scene.filming.size[0]
        self._stations = np.linspace(0.0, 1.0, int(np.clip(scene.strip.length / (1.4 * pixel), 80, 600)) + 1)
        # A spline is linear in its points: one matrix serves all moments.
        self._refine = CubicSpline(arc / arc[-1], np.eye(len(arc)))(self._stations)
        rng = np.random.default_rng([scene.seed, 1])
        shape = (len(self._stations) - 1,)
        weave = 1.0 + scene.strip.texture * rng.standard_normal((2, *shape))
        self._surface_grey, self._edge_grey = scene.strip.grey * weave[0], scene.strip.edge * weave[1]
        hairs = rng.poisson(scene.strip.hairs * scene.strip.length)
        self._hairs = (
            rng.uniform(0.0, 1.0, hairs),
            rng.uniform(0.0, 2.0 * np.pi, hairs),
            rng.gamma(4.0, 5e-4, hairs),
        )

    @cached_property
    def background(self) -> Grey:
        """Shape (height, width): the table and what is behind it, without anything on it."""
        filming, rays = self.scene.filming, Rays(self.view.camera, 2)
        rng = np.random.default_rng([self.scene.seed, 2])
        rough = rng.standard_normal((256, 256)).astype(np.float32)
        along = self.view.matrix
        x, y, z = (np.eye(3)[i] for i in range(3))

        def seen(first: Array, second: Array, origin: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            axes = along @ np.column_stack([first, second, np.cross(first, second)])
            return rays.on_plane(plane_homography(axes, along @ origin + self.view.translation))

        top = -0.5 * self.scene.strip.thickness
        table, into = seen(x, y * self.depth, top * z)
        face, up = seen(x, z, y * self.depth * FRONT)
        wall, height = seen(x, z, y * self.depth * BACK)
        grain = _textured(rough, 12.0, 2.5, table, into, 400.0)
        with np.errstate(invalid="ignore"):
            on_table = (into >= FRONT) & (into <= BACK)
            below = ~on_table & (up < top)
        grey = np.where(
            on_table, filming.table * (1.0 + 0.05 * grain), filming.background * (1.0 + 0.02 * _blotches(wall, height))
        )
        grey = np.where(below, 0.5 * filming.table * (1.0 + 0.02 * _blotches(face, up)), grey)
        picture = rays.averaged(np.asarray(grey, dtype=np.float32))
        return np.asarray(np.clip(np.rint(255.0 * picture), 0, 255), dtype=np.uint8)

    def picture(
        self, curve: Array | None, gripper: Array, passing: float | None = None, rows: tuple[int, int] | None = None
    ) -> Grey:
        """What is seen at one moment.

        Parameters
        ----------
        curve
            Shape (n, 2): the mid-surface from the gripped end to the held end, m; None for no strip.
        gripper
            Shape (2,): the gripped end, or where it would be, m.
        passing
            x of the thing that passes in front, m; None for none.
        rows
            First and end of the rows that are wanted; None for all.

        Returns
        -------
        Shape (height, width): 255 is white in full light.  A view that the next call overwrites.
        """
        self._canvas.clear(self.background, rows or (0, self.scene.filming.size[1]))
        if curve is not None:
            fine = self._refine @ curve
            self._shadow(fine[::2])
            self._strip(fine)
            self._hairy(fine)
            end = curve[-1]
            self._block(np.array([end[0] - 0.004, end[0] + 0.03]), np.array([-0.002, 0.012]), CLAMP)
        self._gripper(gripper)
        if passing is not None:
            half = 0.5 * self.scene.filming.passing
            self._block(np.array([passing - half, passing + half]), np.array([-1.0, 1.0]), 0.08, y=-0.08)
        return self._canvas.picture

    def _strip(self, fine: Array) -> None:
        strip = self.scene.strip
        tangent = np.gradient(fine, axis=0)
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # Both sides of the strip, at its edge in the folding plane and at its other edge.
        sides = fine + 0.5 * strip.thickness * np.array([[[-1.0]], [[1.0]]]) * normal
        into = np.array([0.0, self.depth * strip.width])[:, None, None] * np.ones(sides.shape[:2])
        points = np.stack([np.broadcast_to(sides[None, ..., i], into.shape) for i in range(2)], axis=-1)
        near, far = self.view.pixels(np.stack([points[..., 0], into, points[..., 1]], axis=-1))
        eye = self.view.place[[0, 2]]
        shade = 0.7 + 0.3 * np.abs(normal[:-1] @ _LIGHT)
        for part, facing in visible_runs(fine, eye):
            ends = slice(part.start + 1, part.stop + 1)
            pieces = [near[facing, part], near[facing, ends], far[facing, ends], far[facing, part]]
            self._canvas.ribbon(np.stack(pieces, axis=1), (self._surface_grey * shade)[part])
        rim = np.stack([near[0, :-1], near[0, 1:], near[1, 1:], near[1, :-1]], axis=1)
        self._canvas.ribbon(rim, self._edge_grey)

    def _hairy(self, fine: Array) -> None:
        where, angle, length = self._hairs
        if not len(where):
            return
        foot = np.column_stack([np.interp(where, self._stations, fine[:, i]) for i in range(2)])
        along = np.column_stack([np.cos(angle), np.sin(angle)])
        tip, side = foot + length[:, None] * along, 1e-4 * along[:, ::-1] * [-1.0, 1.0]
        tip[:, 1] = np.maximum(tip[:, 1], 0.0)
        corners = self.view.in_plane(np.stack([foot - side, tip - side, tip + side, foot + side], axis=1))
        self._canvas.quads(corners, np.full(len(foot), self.scene.strip.edge))

    def _shadow(self, fine: Array) -> None:
        """The strip's shadow on the table."""
        lifted = np.clip(fine[:, 1], 0.0, None)
        x, y = fine[:, 0] + _SHADOW[0] * lifted, _SHADOW[1] * lifted
        top = np.full_like(x, -0.5 * self.scene.strip.thickness)
        rows = [
            self.view.pixels(np.stack([x, self.depth * (y + add), top], axis=1))
            for add in (0.0, self.scene.strip.width)
        ]
        quads = np.stack([rows[0][:-1], rows[0][1:], rows[1][1:], rows[1][:-1]], axis=1)
        self._canvas.shape(quads, 0.0, 0.3)

    def _block(self, x: Array, z: Array, grey: float, y: float = 0.0) -> None:
        """An upright rectangle parallel to the folding plane."""
        self._canvas.shape(self.view.in_plane(_rectangle(x, z), self.depth * y)[None], grey)

    def _gripper(self, end: Array) -> None:
        gripper = self.scene.gripper
        centre = end - gripper.offset
        half = 0.5 * gripper.marker_size
        plate = 1.4 * half
        self._block(centre[0] + 0.007 * np.array([-1, 1]), centre[1] + np.array([0.0, 1.0]), ARM, y=0.004)
        finger = np.array(
            [
                [centre[0] - 0.008, centre[1]],
                [end[0] - 0.0035, end[1] - gripper.finger],
                [end[0] + 0.0035, end[1] - gripper.finger],
                [centre[0] + 0.008, centre[1]],
            ]
        )
        self._canvas.shape(self.view.in_plane(finger)[None], FINGER)
        self._block(centre[0] + plate * np.array([-1, 1]), centre[1] + plate * np.array([-1, 1]), 0.95)
        self._block(centre[0] + half * np.array([-1, 1]), centre[1] + half * np.array([-1, 1]), 0.05)
        self._canvas.shape(self.view.in_plane(centre + self._cells), 0.95)

    @cached_property
    def _cells(self) -> Array:
        """Shape (n, 4, 2): the white cells of the marker, from its centre, m."""
        dictionary = marker_dictionary()
        count = dictionary.markerSize + 2
        bits = cv2.aruco.generateImageMarker(dictionary, self.scene.gripper.marker, count, borderBits=1)
        side = self.scene.gripper.marker_size / count
        row, column = np.nonzero(bits)
        # The camera behind the plane would see a mirrored marker: it is put on the side that faces the camera.
        x = self.depth * (column - 0.5 * count) * side
        z = (0.5 * count - row) * side
        step = self.depth * side
        return np.stack(
            [np.stack([x + a * step, z - b * side], axis=1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1
        )


def visible_runs(curve: Array, eye: Array) -> list[tuple[slice, int]]:
    """Parts of a cross-section of which the eye sees one side, in the order in which to draw them.

    Seen from the eye, a part never overlaps itself, and of two that do not cross one is behind wherever both are.

    Parameters
    ----------
    curve
        Shape (n, 2).
    eye
        Shape (2,).

    Returns
    -------
    Segments of each part, and 1 where the eye is on the left of the way along the curve, else 0; what is behind first.
    """
    ray = curve - eye
    angle, distance = np.arctan2(ray[:, 0], -ray[:, 1]), np.hypot(*ray.T)
    turn = np.diff(angle)
    # Straight above the eye the angle jumps.
    left = np.where(np.abs(turn) > np.pi, -turn, turn) > 0.0
    cuts = np.flatnonzero((left[1:] != left[:-1]) | (np.abs(turn[1:]) > np.pi) | (np.abs(turn[:-1]) > np.pi)) + 1
    limits = [0, *cuts.tolist(), len(left)]
    parts = [slice(*pair) for pair in pairwise(limits)]
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
        # One that no other is behind of; were there a circle, which curves that do not cross cannot make, any.
        free = (i for i in waiting if not any(behind(j, i) for j in waiting if j != i))
        first = next(free, waiting[0])
        waiting.remove(first)
        found.append((parts[first], int(left[parts[first].start])))
    return found


def _rectangle(x: Array, z: Array) -> Array:
    """Shape (4 * 8, 2): the outline, its sides divided, since the lens bends them."""
    corners = np.array([[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]])
    share = np.linspace(0.0, 1.0, 8, endpoint=False)[:, None]
    return np.concatenate([(1.0 - share) * corners[i] + share * corners[(i + 1) % 4] for i in range(4)])


def _textured(
    rough: NDArray[np.float32], long: float, broad: float, u: NDArray[np.float32], v: NDArray[np.float32], scale: float
) -> NDArray[np.float32]:
    """A grain with unit standard deviation at places u and v, m."""
    smooth = cv2.GaussianBlur(np.tile(rough, (2, 2)), (0, 0), sigmaX=long, sigmaY=broad)[128:384, 128:384]
    grain = np.asarray(smooth / smooth.std(), dtype=np.float32)
    places = [np.nan_to_num(np.mod(value * scale, 256.0)).astype(np.float32) for value in (u, v)]
    return np.asarray(cv2.remap(grain, places[0], places[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))


def _blotches(u: NDArray[np.float32], v: NDArray[np.float32]) -> NDArray[np.float32]:
    """A soft pattern about 1 at most."""
    return np.nan_to_num(np.sin(23.0 * u + 3.0 * np.sin(17.0 * v)) * np.cos(31.0 * v + 1.0))

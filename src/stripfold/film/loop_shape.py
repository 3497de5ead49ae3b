"""The loop of a folded strip by its thickness, dimensionless (L*), and its place in a picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.film.line_kernels import normals

MAX_THICKNESS = 0.3
"""Largest thickness, L*."""
SECTIONS = 200


@dataclass(frozen=True)
class Place:
    """Where the loop is: unit, origin (the lift-off point), rotation in the picture (rad), and on which side it is."""

    unit: float
    x: float
    y: float
    angle: float
    side: float

    def of(self, points: Array) -> Array:
        """Pixels of points of the dimensionless loop, shape (n, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.asarray([self.x, self.y] + self.unit * (points * [self.side, -1.0]) @ np.array([[c, s], [-s, c]]))

    def back(self, pixels: Array) -> Array:
        """Points of the dimensionless loop of pixels, shape (n, 2)."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.asarray((pixels - [self.x, self.y]) @ np.array([[c, -s], [s, c]]) / self.unit * [self.side, -1.0])

    def moved(self, change: Array) -> Place:
        """Changed by a relative change of the unit, x, y and the angle."""
        scale, x, y, turn = change.tolist()
        return Place(self.unit * float(np.exp(scale)), self.x + x, self.y + y, self.angle + turn, self.side)

    def slopes(self, points: Array, across: Array) -> Array:
        """Change of pixels of ``points`` along ``across`` by that of the unknowns in :meth:`moved`, shape (n, 4)."""
        arm = points - [self.x, self.y]
        return np.column_stack(
            [
                np.einsum("ij,ij->i", arm, across),
                across,
                across[:, 1] * arm[:, 0] - across[:, 0] * arm[:, 1],
            ]
        )


@cache
def _table() -> tuple[Array, Array]:
    """Thicknesses, shape (4,), and loops with them, arc length, x and z at equal shares, shape (4, 801, 3); L*."""
    thickness = np.linspace(0.0, MAX_THICKNESS, 4)
    loops = []
    for value in thickness:
        state = elastica.folded_loop(float(value)).state
        profile = state.at(np.linspace(0.0, state.length, 801))
        loops.append(np.column_stack([profile.s, profile.x, profile.z]))
    return thickness, np.array(loops)


def loop(thickness: float) -> Array:
    """Arc length, x and z of the loop of a strip of this thickness, shape (801, 3), by cubic interpolation; L*."""
    at, loops = _table()
    weights = [np.prod([(thickness - b) / (a - b) for b in at if b != a]) for a in at]
    return np.einsum("k,kij->ij", np.array(weights), loops)


def visible(thickness: float, high: float) -> tuple[Array, Array, Array]:
    """Equally spaced points of the strip where the upper layer is ``high`` or higher above the lower one; L*.

    Arc lengths, shape (n,), places and their change with the thickness, shape (n, 2).
    """
    middle = loop(thickness)
    falling = middle[np.argmax(middle[:, 2]) :]
    last = falling[falling[:, 2] > high][-1]
    s = np.linspace(last[1], last[0], SECTIONS)
    nearby = [loop(thickness + step) for step in (0.0, 0.01)]
    share = np.maximum(s, 0.0) / middle[-1, 0]
    here, there = (
        np.column_stack([np.interp(share, one[:, 0] / one[-1, 0], one[:, i]) for i in (1, 2)]) for one in nearby
    )
    here[:, 0] += np.minimum(s, 0.0)
    there[:, 0] += np.minimum(s, 0.0)
    return s, here, (there - here) / 0.01


def inside_of(thickness: float) -> Array:
    """Outline of the hole that the loop encloses, shape (n, 2); L*."""
    middle = loop(thickness)[:, 1:]
    inner = middle + 0.5 * thickness * normals(middle)
    inner = inner[(inner[:, 1] > 0.5 * thickness) & (np.arange(len(inner)) > 10)]
    return np.concatenate([inner, [[inner[-1, 0], 0.5 * thickness], [inner[0, 0], 0.5 * thickness]]])

"""The triangular and the circular path of a half fold: they depend on the strip's length only."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import Self

import numpy as np

from stripfold.base.arrays import Array
from stripfold.paths.curve import GripperPath, Piece, pieces_through


@dataclass(frozen=True)
class HalfCircle(Piece):
    """A half circle from the floor to the floor, lengths in the unit of ``radius``; ``centre``: its x."""

    radius: float
    centre: float = 0.0

    def position(self, s: float) -> Array:
        angle = s / self.radius
        return np.array([self.centre - self.radius * cos(angle), self.radius * max(sin(angle), 0.0)])

    def rate(self, s: float) -> Array:
        return np.array([sin(s / self.radius), cos(s / self.radius)])

    def scaled(self, factor: float) -> Self:
        lengths = {name: factor * getattr(self, name) for name in ("start", "end", "radius", "centre")}
        return replace(self, **lengths)

    def shifted(self, x: float) -> Self:
        return replace(self, centre=self.centre + x)


def triangular(length: float) -> GripperPath:
    """Straight up at 45 degrees to half the length above the fold line, straight down at 45 degrees.

    Exact for a strip without stiffness on a floor with infinite friction (Berg et al., WAFR 2010).
    """
    half = length / 2.0
    start, apex, end = np.array([[-half, 0.0], [0.0, half], [half, 0.0]])
    parts = ("up", np.array([start, apex])), ("down", np.array([apex, end]))
    return GripperPath("triangular", pieces_through(parts))


def circular(length: float) -> GripperPath:
    """The half circle about the fold line.

    Exact for two rigid halves with a hinge (Petrik et al., TAROS 2015).
    """
    radius = length / 2.0
    return GripperPath("circular", (HalfCircle(0.0, pi * radius, "circle", radius),))

"""The triangular and the circular path of a half fold: they depend on the strip's length only."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from stripfold.arrays import Array
from stripfold.paths.curve import GripperPath, Piece, pieces_through


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

    def position(s: float) -> Array:
        return radius * np.array([-cos(s / radius), max(sin(s / radius), 0.0)])

    def rate(s: float) -> Array:
        return np.array([sin(s / radius), cos(s / radius)])

    return GripperPath("circular", (Piece(0.0, pi * radius, position, rate, "circle"),))

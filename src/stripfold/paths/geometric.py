"""The paths that know nothing but the strip's length: triangular and circular, of a half fold."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np

from stripfold.arrays import Array
from stripfold.paths.curve import GripperPath, Piece


def triangular(length: float) -> GripperPath:
    """Straight up at 45 degrees to half the length above the fold line, straight down at 45 degrees.

    Right for a strip without stiffness on a floor with infinite friction (Berg et al., WAFR 2010).
    """
    half = length / 2.0
    side = sqrt(2.0) * half
    apex = np.array([0.0, half])
    return GripperPath(
        "triangular",
        (
            Piece.through(np.array([[-half, 0.0], apex]), 0.0, "up"),
            Piece.through(np.array([apex, [half, 0.0]]), side, "down"),
        ),
    )


def circular(length: float) -> GripperPath:
    """The half circle about the fold line.

    Right for two rigid halves with a hinge (Petrik et al., TAROS 2015).
    """
    radius = length / 2.0

    def position(s: float) -> Array:
        angle = s / radius
        return np.array([-radius * cos(angle), max(radius * sin(angle), 0.0)])

    def rate(s: float) -> Array:
        angle = s / radius
        return np.array([sin(angle), cos(angle)])

    return GripperPath("circular", (Piece(0.0, pi * radius, position, rate, "circle"),))

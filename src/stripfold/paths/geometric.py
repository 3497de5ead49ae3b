"""Paths by their places: triangular, circular, and those that lift the strip without horizontal force; lengths in L*.

The low path carries the end over the strip below the height from which it snaps, in three phases (docs/physics.md,
section 9): *lift* to a height, *carry* over at that height, and *lay* down as it was lifted.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin
from typing import Self

import numpy as np

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.paths.curve import GripperPath, Piece, pieces_through
from stripfold.paths.rpath import check_half_fold


@dataclass(frozen=True)
class HalfCircle(Piece):
    """A half circle from the floor to the floor, lengths in the unit of ``radius``; ``centre``: its x."""

    radius: float
    centre: float = 0.0

    def position(self, s: float) -> Array:
        # Zero at both ends, and below the floor behind them: a branch is followed through its end.
        height = self.radius * sin(min(s, self.end - s) / self.radius)
        return np.array([self.centre - self.radius * cos(s / self.radius), height])

    def rate(self, s: float) -> Array:
        return np.array([sin(s / self.radius), cos(s / self.radius)])

    def moved(self, factor: float, x: float) -> Self:
        centre = factor * self.centre + x
        return type(self)(factor * self.start, factor * self.end, self.name, factor * self.radius, centre)


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


LOWEST = 0.1
"""Lowest height, L*: the strip is pushed with up to 2.75 / z^2 there, the weight of 275 L* of it."""
HIGHEST = 0.25
"""Largest height over the length: above it little is left to be carried over."""


def low(length: float, height: float) -> GripperPath:
    """The low path of a strip of this length at this height, L*; it is stable below :func:`.elastica.touch_limit`.

    The height is from :data:`LOWEST` to :data:`HIGHEST` times the length.

    Raises InvalidInputError: a strip too short to be folded in half, or longer than tested.

    Examples
    --------
    >>> path = low(20.0, 1.2)
    >>> [piece.name for piece in path.pieces], path.position(path.corners[0]).round(6).tolist()
    (['lift', 'carry', 'lay'], [-9.518957, 1.2])
    """
    check_half_fold(length)
    lift = lifted(length, height)
    lay = lift[::-1] * (-1.0, 1.0)
    carry = np.array([lift[-1], lay[0]])
    return GripperPath("low", pieces_through([("lift", lift), ("carry", carry), ("lay", lay)]))


def lifted_triangular(length: float, height: float) -> GripperPath:
    """The triangular path from its apex on, after a lift without horizontal force to this height, L*.

    At 45 degrees from the floor on, a gripper pushes what lies with tens of rho_a g L*; above L* with one.
    """
    half = length / 2.0
    lift, apex, end = lifted(length, height), np.array([0.0, half]), np.array([half, 0.0])
    parts = ("lift", lift), ("up", np.array([lift[-1], apex])), ("down", np.array([apex, end]))
    return GripperPath("triangular", pieces_through(parts))


def lifted(length: float, height: float) -> Array:
    """Places of the gripper from the floor to this height without horizontal force, L*, shape (n, 2)."""
    free = elastica.state_no_horizontal_force(height).length
    up = [(state.advance, state.gripper[1]) for state in states_no_horizontal_force(free)]
    return np.array([(0.0, 0.0), *up]) - (length / 2.0, 0.0)


def layer_slide(length: float, height: float) -> float:
    """Way of the upper layer over the lower one from its touch to the fold, L*, where it touches without friction.

    What touches at the distance s from the grasped end lies in the fold at length/2 - s.  All of it is given by the
    height of the gripper at the touch, below :func:`.elastica.touch_limit`, whatever its way there; negative where the
    layer is drawn back.  Source: docs/plan.md.

    Examples
    --------
    >>> round(layer_slide(12.0, 1.2), 4)
    2.9464
    """
    state = elastica.critical(height).state
    sag = state.sag
    assert sag is not None  # it touches
    from_end, to_sag = state.length - sag.s, state.length - float(state.at(sag.s).x)
    return length - from_end - to_sag

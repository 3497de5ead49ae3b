"""The low path: the gripper carries its end over the strip below the height from which a strip snaps.

Three phases (docs/physics.md, section 9): *lift* to a height without horizontal force, *carry* over at that height, and
*lay* down as it was lifted.
"""

from __future__ import annotations

import numpy as np

from stripfold import elastica
from stripfold.elastica.half_fold import states_no_horizontal_force
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.rpath import check_half_fold

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
    half = length / 2.0
    free = elastica.state_no_horizontal_force(height).length
    up = [(state.advance - half, state.gripper[1]) for state in states_no_horizontal_force(free)]
    lift = np.array([(-half, 0.0), *up])
    lay = lift[::-1] * (-1.0, 1.0)
    carry = np.array([lift[-1], lay[0]])
    return GripperPath("low", pieces_through([("lift", lift), ("carry", carry), ("lay", lay)]))


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

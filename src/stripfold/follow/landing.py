"""The gripper between the floor and the lowest height at which a state is computed, on the way down and up.

The part of the strip beside a gripper at height z is (24 z)^(1/4) long, a beam under its weight, and gone on the floor.
Lengths in L*.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stripfold.base.arrays import Array
from stripfold.follow.contact_branch import BranchPoint, transferred
from stripfold.paths.curve import Piece
from stripfold.strip.contact_mesh import FOLDED, INTERVAL, Topology
from stripfold.strip.problem import Motion

LOW = 1e-3
"""Least height of the gripper off the floor, L*: strips are lifted to it and set down from it, below is the floor."""


def over_low(motion: Motion, lam: float) -> float:
    """Height of the gripper over :data:`LOW`."""
    return float(motion.values(lam)[-1]) - LOW


def place_of_low(piece: Piece, floor: float, above: float) -> float:
    """Length travelled at which the gripper is :data:`LOW`, between places on the floor and above."""
    for _ in range(60):
        if abs(above - floor) < 1e-9:
            break
        middle = 0.5 * (floor + above)
        floor, above = (floor, middle) if piece.position(middle)[1] > LOW else (middle, above)
    return above


def lands(at: BranchPoint, lam: float) -> bool:
    """Whether the gripper comes down to the floor before this lambda."""
    return over_low(at.problem.motion, at.point.lam) > 0.0 >= over_low(at.problem.motion, lam)


def landed(at: BranchPoint, lam: float) -> BranchPoint:
    """The state with the gripper on the floor, from one just above it with an upper layer that lies."""
    return _moved(at, at.contact[1:], FOLDED, lam)


def taken_off(at: BranchPoint, lam: float) -> BranchPoint:
    """The state with the gripper just above the floor, from one with the gripper on it."""
    height = float(at.problem.motion.values(lam)[-1])
    beside = min((24.0 * height) ** 0.25, 0.5 * float(at.contact[0]))
    return _moved(at, np.concatenate([[beside], at.contact]), INTERVAL, lam)


def _moved(at: BranchPoint, contact: Array, topology: Topology, lam: float) -> BranchPoint:
    """The state at ``lam``, with another contact."""
    there = replace(at.point, state=replace(at.point.state, lam=lam))
    return transferred(BranchPoint(at.problem, there), contact, topology, (np.zeros(len(contact)), 1.0))

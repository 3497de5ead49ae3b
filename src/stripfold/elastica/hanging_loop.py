"""Loops of a strip whose ends are held together and that hangs down: textile tests of L* by the loop's height.

Pear: the ends point downwards.  Heart: they point upwards, and the strip falls over to both sides.  The tests are those
of Peirce, J. Text. Inst. 21 (1930) T377; in place of his approximations the elastica is solved.  Of one half, from the
clamp to the lowest point, where there is no vertical force, in units of its length, whose cube in L*^3 is ``a``::

    theta'' = F_x sin(theta) - a (s - 1) cos(theta),    X(1) = 0
"""

from __future__ import annotations

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError, NewtonError
from stripfold.base.material import GRAVITY
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import number, positive

ENDS = {"heart": (0.5 * np.pi, -np.pi), "pear": (-0.5 * np.pi, -np.pi)}
"""Angles at the clamp and at the lowest point, rad."""
BULGE = {"heart": 0.0, "pear": 1.2}
"""Of the guess without weight: how far its angle bends back, rad."""
NODES = 96
STEP = 0.01
"""Change of the height over the half's length from one solution to the next; least one by the weight, below which it
says too little about L*."""
MAX_WEIGHT = 4000.0
"""Largest ``a``: a loop of 32 L* is nearly a double strip that hangs straight."""


def eta_b_from_hanging_loop(kind: str, length: float, height: float) -> float:
    """Weight-to-bending-stiffness ratio, m^-4 s^2, of a strip that hangs as a loop.

    ``kind``: "heart" or "pear"; ``length``, ``height``: of the strip between the clamp's edges, and from these to the
    loop's lowest point, m.  Raises InvalidInputError: another kind, or a height of a loop whose weight hardly bends it
    or lets it hang almost straight.

    Examples
    --------
    >>> round(eta_b_from_hanging_loop("heart", 0.2, 0.07), 1)
    13018.3
    """
    if kind not in ENDS:
        raise InvalidInputError("loop", kind, " or ".join(ENDS))
    half = 0.5 * positive("length", length, ", in m")
    wanted = number("height", height, 0.0, 2.0 * half, ", in m") / half
    return _weight(kind, wanted, half) / (GRAVITY * half**3)


def _weight(kind: str, wanted: float, half: float) -> float:
    """``a`` of the height over the half loop's length, in steps from the loop without weight."""
    height, values = round(wanted * half, 9), np.zeros(NODES + 2)
    values[:NODES] = -BULGE[kind] * np.pi**2 * np.sin(np.pi * grid(NODES).nodes)
    values = _solved(kind, values)
    depth = _depth(kind, values) + STEP
    if wanted < depth:
        raise InvalidInputError("height", height, f"at least {depth * half:.4g} m", "take a longer strip")
    while values[-1] <= MAX_WEIGHT:
        values = _solved(kind, values, depth)
        if depth == wanted:
            return float(values[-1])
        depth = min(depth + STEP, wanted)
    raise InvalidInputError("height", height, f"at most {depth * half:.4g} m", "take a shorter strip")


def _depth(kind: str, values: Array) -> float:
    """Of the lowest point below the clamp."""
    return -float(grid(NODES).integral[-1] @ np.sin(_angle(kind, values)))


def _angle(kind: str, values: Array) -> Array:
    g = grid(NODES)
    first, last = ENDS[kind]
    return first + (last - first) * g.nodes + _twice(values[:NODES])


def _twice(second: Array) -> Array:
    """The function with this second derivative that vanishes at both ends."""
    g = grid(NODES)
    twice = g.integral @ (g.integral @ second)
    return np.asarray(twice - np.multiply.outer(g.nodes, twice[-1]))


def _solved(kind: str, values: Array, depth: float | None = None) -> Array:
    """theta'' at the nodes, F_x and ``a``, by Newton's method; without weight where no ``depth`` is given."""
    g = grid(NODES)
    matrix = _twice(np.eye(NODES))
    for _ in range(40):
        angle = _angle(kind, values)
        sin, cos, ahead = np.sin(angle), np.cos(angle), g.nodes - 1.0
        force, weight = values[-2:]
        right = np.concatenate([values[:NODES] - force * sin + weight * ahead * cos, [g.integral[-1] @ cos, weight]])
        slopes = np.zeros((NODES + 2, NODES + 2))
        slopes[:NODES, :NODES] = np.eye(NODES) - (force * cos + weight * ahead * sin)[:, None] * matrix
        slopes[:NODES, -2], slopes[:NODES, -1] = -sin, ahead * cos
        slopes[-2, :NODES] = -(g.integral[-1] * sin) @ matrix
        slopes[-1, -1] = 1.0
        if depth is not None:
            right[-1] = -(g.integral[-1] @ sin) - depth
            slopes[-1] = np.append(-(g.integral[-1] * cos) @ matrix, [0.0, 0.0])
        change = np.linalg.solve(slopes, -right)
        turn = float(np.abs(matrix @ change[:NODES]).max())
        values = values + min(1.0, 0.5 / max(turn, 1e-12)) * change
        if turn < 1e-9:
            return np.asarray(values)
    raise NewtonError("Newton's method on a hanging loop did not converge", residuals=[turn])

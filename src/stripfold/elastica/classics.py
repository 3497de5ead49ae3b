"""Two classical problems of the same equation: the drooping cantilever and the column under its own weight."""

from __future__ import annotations

import numpy as np

from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import number
from stripfold.elastica._system import FORCE_X, LENGTH, fixed, no_end_force, solve
from stripfold.elastica.state import State
from stripfold.roots import root

MAX_LENGTH = 60.0
PEIRCE_ANGLE = float(np.radians(41.5))
"""Angle of the chord in the cantilever test of fabrics, rad."""


def cantilever(length: float) -> State:
    """A strip clamped horizontally at s = 0, free at s = l (1e-3 to 60 L*), drooping under its weight.

    Z is negative below the clamp; ``droop_angle`` is the angle of the chord.

    Raises
    ------
    InvalidInputError
        ``length`` outside its range or not a number.
    SolveError
        No convergence.

    Examples
    --------
    >>> round(float(np.degrees(cantilever(2.000350).droop_angle)), 4)
    41.5
    """
    length = number("length", length, 1e-3, MAX_LENGTH, ", in units of L*")
    l = min(length, 1.0)  # noqa: E741
    y = np.concatenate([np.zeros(24), [0.0, -l, l]])
    while True:
        e = solve(y, (fixed(FORCE_X, 0.0), no_end_force, fixed(LENGTH, l)))
        if l == length:
            return State._from(e)
        # Continuation in the length: from a straight strip Newton's method converges for short ones only.
        l, y = min(length, 1.5 * l), e.y  # noqa: E741


def cantilever_length(angle: float = PEIRCE_ANGLE) -> float:
    """Free length in L* at which the chord points ``angle`` (rad) below the horizontal.

    The default is the angle of the cantilever test (41.5 degrees): about 2 L*.

    Raises
    ------
    InvalidInputError
        An angle outside [0.001, 1.5] rad or not a number.

    Examples
    --------
    >>> round(cantilever_length(), 6)
    2.00035
    """
    wanted = number("angle", angle, 1e-3, 1.5, " rad")
    return root(lambda length: cantilever(length).droop_angle - wanted, 0.1, 10.0, 1e-12)


def column_buckling_length() -> float:
    """Height in L* at which a column, clamped below and free above, buckles under its own weight.

    Smallest l with a nonzero solution of theta'' + (l - s) theta = 0, theta(0) = theta'(l) = 0.

    Examples
    --------
    >>> round(column_buckling_length(), 6)
    1.986353
    """
    g = grid(32)
    # u = -l^3 (1 - sigma) G u: the eigenvalues of the operator are 1 / l^3.
    values = np.linalg.eigvals(-(1.0 - g.nodes)[:, None] * g.angle)
    return float(values.real.max() ** (-1.0 / 3.0))

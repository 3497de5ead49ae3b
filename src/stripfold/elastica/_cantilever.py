"""The drooping cantilever."""

from __future__ import annotations

import numpy as np

from stripfold.elastica._checks import number
from stripfold.elastica._system import FORCE_X, LENGTH, fixed, no_end_force, solve
from stripfold.elastica.state import State

MAX_LENGTH = 60.0


def cantilever(length: float) -> State:
    """A strip clamped horizontally at s = 0, free at s = l (1e-3 to 60 L*), drooping under its weight.

    Z is negative below the clamp; ``droop_angle`` is the angle of the chord.

    Raises InvalidInputError: ``length`` outside its range or not a number; SolveError: no convergence.

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

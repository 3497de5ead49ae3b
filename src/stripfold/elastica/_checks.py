"""Checks of what a user hands in; every message names the key, the value and what is allowed."""

from __future__ import annotations

from typing import Any

import numpy as np

from stripfold.errors import InvalidInputError

MIN_HEIGHT, MAX_HEIGHT = 0.1, 100.0
"""Gripper heights, in L*, for which a branch is followed (and tested)."""


def number(key: str, value: Any, low: float, high: float, unit: str) -> float:
    """``value`` as a float.

    Raises
    ------
    InvalidInputError
        Not a number, or not in [low, high].
    """
    allowed = f"a finite number from {low:g} to {high:g}{unit}"
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise InvalidInputError(key, value, allowed) from None
    if not low <= out <= high:
        raise InvalidInputError(key, value, allowed)
    return out


def positive(key: str, value: Any, unit: str) -> float:
    """``value`` as a float.

    Raises
    ------
    InvalidInputError
        Not a number, not finite, or not greater than zero.
    """
    allowed = f"a finite number greater than 0{unit}"
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise InvalidInputError(key, value, allowed) from None
    if not 0.0 < out < np.inf:
        raise InvalidInputError(key, value, allowed)
    return out


def height(z: Any, low: float = MIN_HEIGHT) -> float:
    """Gripper height as a float; the same errors."""
    return number("z", z, low, MAX_HEIGHT, ", in units of L*")

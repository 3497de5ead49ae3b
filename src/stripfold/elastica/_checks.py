"""Checks of user input; every message names the key, the value and the allowed range."""

from __future__ import annotations

from typing import Any

import numpy as np

from stripfold.base.errors import InvalidInputError

MIN_HEIGHT, MAX_HEIGHT = 0.1, 100.0
"""Tested range of gripper heights of a branch, in L*."""


def number(key: str, value: Any, low: float, high: float, unit: str) -> float:
    """``value`` as a float in [low, high].

    Raises InvalidInputError: not a number, or out of range.
    """
    return _checked(key, value, low, high, f"a finite number from {low:g} to {high:g}{unit}")


def positive(key: str, value: Any, unit: str) -> float:
    """``value`` as a positive finite float; the same errors."""
    smallest, largest = np.nextafter([0.0, np.inf], 1.0)
    return _checked(key, value, smallest, largest, f"a finite number greater than 0{unit}")


def height(z: Any, low: float = MIN_HEIGHT) -> float:
    """Gripper height as a float; the same errors."""
    return number("z", z, low, MAX_HEIGHT, ", in units of L*")


def _checked(key: str, value: Any, low: float, high: float, allowed: str) -> float:
    try:
        out = float(value)
    except (TypeError, ValueError):
        raise InvalidInputError(key, value, allowed) from None
    if not low <= out <= high:
        raise InvalidInputError(key, value, allowed)
    return out

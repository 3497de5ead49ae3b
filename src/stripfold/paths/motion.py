"""When a gripper is where on a path, within a speed and an acceleration: fastest, and at rest in corners."""

from __future__ import annotations

import numpy as np

from stripfold.arrays import Array
from stripfold.paths.curve import polygon_length
from stripfold.paths.table import CORNER


def times(places: Array, speed: float, acceleration: float) -> Array:
    """Times, shape (n,), at which a gripper that starts and ends at rest is at ``places``, shape (n, 2).

    On a straight line the speed rises and falls linearly.  In bends the acceleration is that along the path together
    with that towards the centre.  Where the polygon turns by more than :data:`.table.CORNER` the gripper stops.

    Parameters
    ----------
    places
        A polygon with at least two edges between two corners; any unit of length.
    speed, acceleration
        Largest ones, in that unit and s.

    Examples
    --------
    >>> line = np.linspace([0.0, 0.0], [3.0, 0.0], 301)
    >>> round(float(times(line, speed=1.0, acceleration=1.0)[-1]), 6)  # 1 s up, 2 s at full speed, 1 s down
    4.0
    """
    steps = np.diff(polygon_length(places))
    direction = np.diff(places, axis=0) @ [1.0, 1j]
    turn = np.abs(np.angle(direction[1:] / direction[:-1]))
    bend = np.zeros(len(places))
    bend[1:-1] = turn / (0.5 * (steps[1:] + steps[:-1]))
    # Squares of the speed: linear along a path of constant acceleration.
    with np.errstate(divide="ignore"):
        largest = np.minimum(speed**2, acceleration / bend)
    largest[[0, -1]] = 0.0
    largest[1:-1][turn > CORNER] = 0.0
    forward = _risen(largest, steps, bend, acceleration)
    backward = _risen(forward[::-1], steps[::-1], bend[::-1], acceleration)[::-1]
    reached = np.sqrt(backward)
    return np.concatenate([[0.0], np.cumsum(2.0 * steps / (reached[1:] + reached[:-1]))])


def _risen(largest: Array, steps: Array, bend: Array, acceleration: float) -> Array:
    """Squares of the speed that stay below ``largest`` and rise no faster than the acceleration allows."""
    found = largest.copy()
    for i, step in enumerate(steps):
        towards_centre = found[i] * bend[i]
        along = np.sqrt(max(acceleration**2 - towards_centre**2, 0.0)) if found[i] > 0.0 else acceleration
        found[i + 1] = min(largest[i + 1], found[i] + 2.0 * along * step)
    return found

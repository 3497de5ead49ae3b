"""When a gripper is where on a path, within a speed and an acceleration: fastest, and at rest in corners."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from stripfold.base.arrays import Array
from stripfold.paths.curve import turns
from stripfold.paths.table import CORNER


@dataclass(frozen=True, eq=False)
class TimedPath:
    """The length travelled over time, a :class:`.Drive`: between two places the speed is linear in time.

    ``t``, ``travelled``, ``speed``: times, lengths travelled and speeds at places of a path, shape (n,) each.
    """

    t: Array
    travelled: Array
    speed: Array

    def lam(self, t: float) -> float:
        i, since = self._since(t)
        return float(self.travelled[i] + since * 0.5 * (self.speed[i] + self.rate(t)))

    def rate(self, t: float) -> float:
        i, since = self._since(t)
        rise = (self.speed[i + 1] - self.speed[i]) / (self.t[i + 1] - self.t[i])
        return float(self.speed[i] + rise * since)

    def _since(self, t: float) -> tuple[int, float]:
        """The interval of a time, and the time since its begin."""
        i = min(max(int(self.t.searchsorted(t, side="right")) - 1, 0), len(self.t) - 2)
        return i, min(t, float(self.t[-1])) - float(self.t[i])

    def starting_at(self, travelled: float) -> TimedPath:
        """The same motion, with the time at which it has come that far within its first interval as zero."""
        return replace(self, t=self.t - self.t[1] * sqrt(travelled / self.travelled[1]))


def timed(travelled: Array, places: Array, speed: float, acceleration: float) -> TimedPath:
    """The motion of a gripper that starts and ends at rest.

    On a straight line the speed rises and falls linearly.  In bends the acceleration is that along the path together
    with that towards the centre.  Where the polygon turns by more than :data:`.table.CORNER` the gripper stops.

    ``travelled``, ``places``: lengths travelled from 0 on, shape (n,), and places, shape (n, 2), with at least two
    edges between two corners; any unit of length.  ``speed``, ``acceleration``: largest ones, in that unit and s.

    Examples
    --------
    >>> s = np.linspace(0.0, 3.0, 301)
    >>> line = timed(s, np.column_stack([s, 0.0 * s]), speed=1.0, acceleration=1.0)
    >>> round(float(line.t[-1]), 6), round(line.lam(1.0), 6)  # 1 s up, 2 s at full speed, 1 s down
    (4.0, 0.5)
    """
    steps = np.diff(travelled)
    turn = turns(places)
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
    t = np.concatenate([[0.0], np.cumsum(2.0 * steps / (reached[1:] + reached[:-1]))])
    return TimedPath(t, travelled, reached)


def _risen(largest: Array, steps: Array, bend: Array, acceleration: float) -> Array:
    """Squares of the speed that stay below ``largest`` and rise no faster than the acceleration allows."""
    found = largest.copy()
    for i, step in enumerate(steps):
        towards_centre = found[i] * bend[i]
        along = np.sqrt(max(acceleration**2 - towards_centre**2, 0.0)) if found[i] > 0.0 else acceleration
        found[i + 1] = min(largest[i + 1], found[i] + 2.0 * along * step)
    return found

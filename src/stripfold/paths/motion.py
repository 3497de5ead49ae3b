"""When a gripper is where on a path, within a speed, an acceleration and a jerk: at rest in corners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arrays import Array
from stripfold.paths.curve import turns
from stripfold.paths.table import CORNER

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

KNOTS = 400
"""Times, at least, between two rests at which a motion with a limited jerk is stored."""
SLOWER = 1.0001
"""Factor of its times: between these the speed is linear, and would exceed the limits by a few times 1e-5."""


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

    def when(self, travelled: Array) -> Array:
        """When it has come so far, shape of ``travelled``."""
        i = np.clip(self.travelled.searchsorted(travelled, side="right") - 1, 0, len(self.t) - 2)
        rise = np.diff(self.speed) / np.diff(self.t)
        way = np.maximum(travelled - self.travelled[i], 0.0)
        later = np.sqrt(np.maximum(self.speed[i] ** 2 + 2.0 * rise[i] * way, 0.0))
        mean = np.maximum(0.5 * (self.speed[i] + later), np.finfo(float).tiny)
        return np.asarray(np.minimum(self.t[i] + way / mean, self.t[i + 1]))

    def _since(self, t: float) -> tuple[int, float]:
        """The interval of a time, and the time since its begin."""
        i = min(max(int(self.t.searchsorted(t, side="right")) - 1, 0), len(self.t) - 2)
        return i, min(t, float(self.t[-1])) - float(self.t[i])

    def starting_at(self, travelled: float) -> TimedPath:
        """The same motion, with the time at which it has come that far within its first interval as zero."""
        return replace(self, t=self.t - self.t[1] * sqrt(travelled / self.travelled[1]))


@dataclass(frozen=True, eq=False)
class StampedPath:
    """The length travelled over time as a table says it, a :class:`.Drive`: smooth, and never back.

    ``t``, ``travelled``: times and lengths travelled at places of a path, ascending, shape (n,) each.
    """

    t: Array
    travelled: Array

    @cached_property
    def _law(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.t, self.travelled)

    def lam(self, t: float) -> float:
        return float(self._law(min(t, self.t[-1])))

    def rate(self, t: float) -> float:
        return float(self._law(t, 1)) if t < self.t[-1] else 0.0

    def starting_at(self, travelled: float) -> StampedPath:
        """The same motion, with the time at which it has come that far as zero."""
        return replace(self, t=self.t - self._law.solve(travelled, extrapolate=False)[0])


def timed(travelled: Array, places: Array, speed: float, acceleration: float, jerk: float | None = None) -> TimedPath:
    """The motion of a gripper that starts and ends at rest.

    On a straight line the speed rises and falls linearly.  In bends the acceleration is that along the path together
    with that towards the centre.  Where the polygon turns by more than :data:`.table.CORNER` the gripper stops.

    ``travelled``, ``places``: lengths travelled from 0 on, shape (n,), and places, shape (n, 2), with at least two
    edges between two corners; any unit of length.  ``speed``, ``acceleration``: largest ones, in that unit and s;
    ``jerk``: that along the path.  Without one the motion is the fastest; with one its place is averaged over the time
    in which the jerk builds up the acceleration, and in bends it is as slow as the sharpest within reach asks.

    Examples
    --------
    >>> s = np.linspace(0.0, 3.0, 301)
    >>> line = timed(s, np.column_stack([s, 0.0 * s]), speed=1.0, acceleration=1.0)
    >>> round(float(line.t[-1]), 6), round(line.lam(1.0), 6)  # 1 s up, 2 s at full speed, 1 s down
    (4.0, 0.5)
    """
    if jerk is None:
        return _fastest(travelled, places, speed, acceleration)
    # Averaged over this time, or where it turns round within it over twice as long.
    shortest = acceleration / jerk
    for window in (shortest, 2.0 * shortest):
        law = _fastest(travelled, places, speed, acceleration, speed * window)
        if window > shortest or _turn_of(law, window) <= (1.0 + 1e-9) * acceleration:
            break
    return _averaged(law, window)


def _fastest(travelled: Array, places: Array, speed: float, acceleration: float, reach: float = 0.0) -> TimedPath:
    """The fastest motion; in bends as slow as the sharpest that is nearer than ``reach`` along the path asks."""
    steps = np.diff(travelled)
    turn = turns(places)
    bend = np.zeros(len(places))
    bend[1:-1] = turn / (0.5 * (steps[1:] + steps[:-1]))
    first, last = np.searchsorted(travelled, travelled - reach), np.searchsorted(travelled, travelled + reach, "right")
    sharpest = np.array([bend[i:j].max() for i, j in zip(first, last, strict=True)])
    # Squares of the speed: linear along a path of constant acceleration.
    with np.errstate(divide="ignore"):
        largest = np.minimum(speed**2, acceleration / sharpest)
    largest[[0, -1]] = 0.0
    largest[1:-1][turn > CORNER] = 0.0
    forward = _risen(largest, steps, sharpest, acceleration)
    backward = _risen(forward[::-1], steps[::-1], sharpest[::-1], acceleration)[::-1]
    reached = np.sqrt(backward)
    t = np.concatenate([[0.0], np.cumsum(2.0 * steps / (reached[1:] + reached[:-1]))])
    return TimedPath(t, travelled, reached)


def _parts(law: TimedPath) -> Iterator[slice]:
    """The places from each rest to the next."""
    for first, last in pairwise(np.flatnonzero(law.speed == 0.0).tolist()):
        yield slice(first, last + 1)


def _turn_of(law: TimedPath, window: float) -> float:
    """Largest change of the acceleration along the path within a time."""
    found = 0.0
    for part in _parts(law):
        t, along = law.t[part], np.pad(np.diff(law.speed[part]) / np.diff(law.t[part]), 1)
        knots = np.concatenate([t, t + window])
        now, before = (along[t.searchsorted(knots - back, side="right")] for back in (0.0, window))
        found = max(found, float(np.abs(now - before).max()))
    return found


def _averaged(law: TimedPath, window: float) -> TimedPath:
    """The motion whose place is the average of another's over the last time of length ``window``, from rest to rest.

    A jerk is then at most the change of the acceleration over the window; neither speed nor acceleration grow.
    """
    t, travelled, speed = [np.zeros(1)], [law.travelled[:1]], [np.zeros(1)]
    for part in _parts(law):
        begin, end = law.t[part][[0, -1]]
        knots = np.concatenate([law.t[part], law.t[part] + window, np.linspace(begin, end + window, KNOTS)])
        knots = np.unique(knots)
        knots = knots[np.append(np.diff(knots) > 1e-6 * window, True)]
        before, now = (
            np.array([law.lam(float(np.clip(at, begin, end))) for at in knots - back]) for back in (window, 0.0)
        )
        mean = (now - before) / window
        way = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(knots) * (mean[1:] + mean[:-1]))])
        share = np.ptp(law.travelled[part]) / way[-1]  # rounding of the sum
        t.append(t[-1][-1] + SLOWER * (knots[1:] - begin))
        travelled.append(law.travelled[part.start] + share * way[1:])
        speed.append(mean[1:] / SLOWER)
        speed[-1][-1], travelled[-1][-1] = 0.0, law.travelled[part][-1]
    return TimedPath(*(np.concatenate(parts) for parts in (t, travelled, speed)))


def _risen(largest: Array, steps: Array, bend: Array, acceleration: float) -> Array:
    """Squares of the speed that stay below ``largest`` and rise no faster than the acceleration allows."""
    found = largest.copy()
    for i, step in enumerate(steps):
        towards_centre = found[i] * bend[i]
        along = np.sqrt(max(acceleration**2 - towards_centre**2, 0.0)) if found[i] > 0.0 else acceleration
        found[i + 1] = min(largest[i + 1], found[i] + 2.0 * along * step)
    return found

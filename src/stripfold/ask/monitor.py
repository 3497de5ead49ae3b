"""How far a gripper is from where its strip snaps, fast enough for a control loop (docs/robot.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from stripfold.ask.map import gripper_map
from stripfold.ask.strip import Strip
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.elastica.boundary import LENGTHS

SPACING, FINE = 0.04, 0.002
"""Of the places whose distance is stored, and of the heights whose limits are, L*."""


class Reading(NamedTuple):
    """What a :class:`Monitor` says of places: numbers, or arrays of their shape.

    ``margin``: distance from where the strip snaps, m; negative behind it.  ``x``, ``z``: nearest place there, m.
    ``energy``: that makes the strip fall, J per m of width; 0 behind, inf where it can only hang.
    """

    margin: Any
    x: Any
    z: Any
    energy: Any


@dataclass(frozen=True)
class Monitor:
    """Distance of a gripper from where its strip snaps, from tables made once: ``monitor(x, z)``.

    The strip is that of a stability map: without friction and thickness, and hanging.  With the largest eta_b that it
    may have the answer is on the safe side.  Places have their origin mid-strip on the floor, m; numbers, or arrays of
    one shape; outside of the map they count as on its edge.  Within 1e-3 L* of the distance from the boundary.

    Raises InvalidInputError: a strip shorter than 7 or longer than 100 L*; SolveError: a boundary could not be
    followed.

    Examples
    --------
    >>> import stripfold as sf
    >>> monitor = sf.Monitor(sf.Strip(length=0.6, eta_b=3780.0))
    >>> round(float(monitor(-0.05, 0.09).margin), 3)
    0.034
    """

    strip: Strip

    def __post_init__(self) -> None:
        if not isinstance(self.strip, Strip):
            raise InvalidInputError("strip", self.strip, "a stripfold.Strip")
        low, high = (limit * self.strip.gravity_length for limit in LENGTHS)
        if not low <= self.strip.length <= high:
            allowed = f"from {low:.3g} to {high:.3g} m with eta_b = {self.strip.eta_b:g} m^-4 s^2"
            raise InvalidInputError("length", self.strip.length, allowed)
        _tables(self._length)

    @property
    def _length(self) -> float:
        return self.strip.length / self.strip.gravity_length

    def __call__(self, x: Any, z: Any) -> Reading:
        """Read the tables."""
        unit, length = self.strip.gravity_length, self._length
        tables, half = _tables(length), 0.5 * length
        rows, columns = tables.margin.shape
        u, v = x / unit + half, z / unit
        column = np.minimum(np.maximum(u / SPACING, 0.0), columns - 1.000001)
        row = np.minimum(np.maximum(v / SPACING, 0.0), rows - 1.000001)
        i, j = np.asarray(column, dtype=int), np.asarray(row, dtype=int)
        a, b = column - i, row - j
        first = j * columns + i
        m00, m01, m10, m11 = (tables.margin.take(first + step) for step in (0, 1, columns, columns + 1))
        low, high = m00 + a * (m01 - m00), m10 + a * (m11 - m10)
        margin, rise = low + b * (high - low), (high - low) / SPACING
        run = ((1.0 - b) * (m01 - m00) + b * (m11 - m10)) / SPACING
        place = np.minimum(np.maximum(v / FINE, 0.0), len(tables.snap) - 1.000001)
        at = np.asarray(place, dtype=int)
        snap = tables.snap[at] + (place - at) * (tables.snap[at + 1] - tables.snap[at])
        left = np.maximum(snap - u, 0.0)
        energy: Array = np.where(u < tables.touch[at], np.inf, tables.coefficient[at] * left * np.sqrt(left))
        energy *= self.strip.rho_a * self.strip.gravity * unit**2
        return Reading(unit * margin, x - unit * margin * run, z - unit * margin * rise, energy)


class _Tables(NamedTuple):
    """Signed distances, shape (z, x), and over heights :data:`FINE` apart the limits of the bistable range
    and its energies' factor, L*; below the touch limit no place is in it."""

    margin: Array
    snap: Array
    touch: Array
    coefficient: Array


@lru_cache(maxsize=8)
def _tables(length: float) -> _Tables:
    found = gripper_map(length)
    lowest, top = found.snap.z[0], found.snap.z[-1]
    widest, highest = found.snap.advance.max() + 1.0, found.lifted[:, 1].max()
    z, advance = (SPACING * np.arange(ceil(most / SPACING) + 2) for most in (highest, widest))
    margin = found.snap.distance(*np.meshgrid(advance, z))
    fine = FINE * np.arange(ceil(top / FINE) + 2)
    inside = np.clip(fine, lowest, top)
    # Below the touch limit no strip can fall, nor where none can lie.
    touch = np.nan_to_num(np.where(fine >= lowest, found.touch.at(inside), np.inf), nan=np.inf)
    coefficient = np.interp(inside, found.snap.z, found.coefficient)
    return _Tables(margin, found.snap.at(inside), touch, coefficient)

"""How far a gripper is from where its strip snaps, fast enough for a control loop (docs/robot.md)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, exp
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from stripfold.ask.map import gripper_map
from stripfold.ask.strip import Strip
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.elastica import with_friction
from stripfold.elastica.boundary import LENGTHS

SPACING, FINE = 0.04, 0.002
"""Of the places whose distance is stored, and of the heights whose limits are, L*."""

ALONG = np.linspace(0.0, 12.0, 481)
"""Distances from the gripper at which a shape is computed for a fit, L*: as long as what hangs before a snap."""
UNLIKE = 1.6
"""Largest factor of L* by which a fit may leave the monitor's strip: of eta_b it is 4."""
MISFIT = 4.0
"""Distance of points from the strip that fits, over their accuracy, from which they are those of no strip."""


class Fit(NamedTuple):
    """The eta_b, m^-4 s^2, that points of a strip say, and the ends of its 95 % interval."""

    eta_b: float
    low: float
    high: float


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

    def update(self, x: Any, z: Any, point: Any, accuracy: float = 1e-3) -> Fit:
        """Say which eta_b fits points of the hanging strip that were measured while the gripper was at places.

        The strip is the monitor's but for its eta_b: without friction in bending, and not touching yet.

        Parameters
        ----------
        x, z
            Places of the gripper, m: numbers, or arrays of shape (n,).
        point
            For each x and z of a point of the sag, or of any other part off the floor, m; shape (2,) or (n, 2).
        accuracy
            Standard deviation of a point's distance from the strip, m.

        Raises
        ------
        InvalidInputError
            Numbers that do not belong together, or points that no strip has with an eta_b within a factor of 4 of
            the monitor's, whose gripper has advanced beyond the place without horizontal force and does not snap.

        Examples
        --------
        >>> import stripfold as sf
        >>> monitor = sf.Monitor(sf.Strip(length=0.6, eta_b=3780.0))
        >>> fit = monitor.update(-0.10, 0.09, (-0.157, 0.045))
        >>> round(fit.eta_b, -2), round(fit.low, -2), round(fit.high, -2)
        (3700.0, 3200.0, 4200.0)
        """
        places = np.column_stack([np.atleast_1d(np.asarray(given, dtype=float)) for given in (x, z)])
        points = np.asarray(point, dtype=float).reshape(-1, 2)
        if points.shape != places.shape or not (np.isfinite(points).all() and np.isfinite(places).all()):
            allowed = f"one, x and z in m, for each of {len(places)} places of the gripper"
            raise InvalidInputError("point", f"{len(points)} of them", allowed)
        if not accuracy > 0.0:
            raise InvalidInputError("accuracy", accuracy, "a number greater than 0 m")
        offset, unit = np.array([0.5 * self.strip.length, 0.0]), self.strip.gravity_length

        def away(log_unit: Array) -> Array:
            """Distances of the points from the strip, to the side of its normals, m."""
            there, found = exp(float(log_unit[0])), []
            for at, seen in zip((places + offset) / there, (points + offset) / there, strict=True):
                (curve,) = with_friction.branch(at[1]).shapes(0.0, at[:1], ALONG)
                found.append(there * _distance(curve, seen))
            return np.array(found)

        limits = np.log(unit / UNLIKE), np.log(unit * UNLIKE)
        best = least_squares(away, [np.log(unit)], bounds=limits, x_scale=0.1, diff_step=1e-3)
        log_unit, slope = float(best.x[0]), float(np.linalg.norm(best.jac))
        there = exp(log_unit)
        for at in (places + offset) / there:
            low, high = with_friction.branch(at[1]).advances
            if not low <= at[0] <= high:
                first, last, here = (float(there * end - offset[0]) for end in (low, high, at[0]))
                allowed = f"x from {first:.4g} to {last:.4g} m at this height"
                raise InvalidInputError("x", here, allowed, "before, the strip is pulled back; behind, it snaps")
        sd = accuracy / slope if slope else np.inf
        misfit = float(np.sqrt(np.mean(best.fun**2)))
        if misfit > MISFIT * accuracy or not min(log_unit - limits[0], limits[1] - log_unit) > 0.01:
            allowed = f"points of a strip whose eta_b is within a factor of 4 of {self.strip.eta_b:g} m^-4 s^2"
            raise InvalidInputError(
                "point", points.tolist(), allowed, f"the nearest such strip is {1e3 * misfit:.2g} mm off"
            )
        eta_b = [float(1.0 / (self.strip.gravity * exp(log_unit + 1.96 * by * sd) ** 3)) for by in (0.0, 1.0, -1.0)]
        return Fit(*eta_b)


def _distance(curve: Array, point: Array) -> float:
    """Distance of a point from a polygon, shape (n, 2), to the left of its nearest edge."""
    edges = np.diff(curve, axis=0)
    length = np.hypot(*edges.T)
    along = np.clip(((point - curve[:-1]) * edges).sum(axis=1) / length**2, 0.0, 1.0)
    away = point - curve[:-1] - along[:, None] * edges
    i = int(np.argmin(np.hypot(*away.T)))
    side = edges[i, 0] * away[i, 1] - edges[i, 1] * away[i, 0]
    return float(np.copysign(np.hypot(*away[i]), side))


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

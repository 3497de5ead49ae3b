"""The log of a robot as a gripper path: its columns, its unit and frame, and the noise in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import UNITS

STIFFEST = 16.0
"""Largest decimal logarithm of the spline's penalty, with rows one apart: longer than any log."""
HALVINGS = 12
FEWEST = 8
"""Rows below which there is nothing to smooth."""


@dataclass(frozen=True)
class LogFormat:
    """How a log is to be read.

    ``columns``: names in the file, or numbers from 1 on, of the columns t, x and z; empty for a table that names them
    so.  ``unit``: "m", "cm" or "mm", of positions in the file; None for what its header says, or m.  ``origin``: x and
    z in the log, m, of the point on the floor under the middle of the strip.  ``flip``: whether the log's x runs
    against the direction of folding.  ``smooth``: largest distance of the path from the rows, m; None for a path
    through the rows.
    """

    columns: tuple[str, ...] = ()
    unit: str | None = None
    origin: tuple[float, float] = (0.0, 0.0)
    flip: bool = False
    smooth: float | None = None

    @classmethod
    def of(
        cls, columns: str | None = None, unit: str | None = None, frame: str | None = None, smooth: float | None = None
    ) -> LogFormat:
        """From texts as the command line has them: ``"t,x,z"`` and ``"x0,z0"`` or ``"x0,z0,flip"``.

        Raises InvalidInputError: a text or number that cannot be used.
        """
        names = tuple(name.strip() for name in columns.split(",")) if columns is not None else ()
        if columns is not None and (len(names) != 3 or not all(names)):
            raise InvalidInputError("columns", columns, "three names or numbers of columns, as time,x,z or 1,3,5")
        if unit not in (None, *UNITS["m"]):
            raise InvalidInputError("unit", unit, f"one of {', '.join(UNITS['m'])}")
        x0, z0, *more = (frame or "0,0").split(",")[:4] if "," in (frame or "0,0") else ("", "")
        try:
            origin = float(x0), float(z0)
        except ValueError:
            origin = np.nan, np.nan
        flip = [word.strip() for word in more] == ["flip"]
        if not np.isfinite(origin).all() or (more and not flip):
            raise InvalidInputError("frame", frame, "x0,z0 in m, or x0,z0,flip", "as --frame=-0.1,0.02,flip")
        if smooth is not None and not 0.0 < smooth <= 1.0:
            raise InvalidInputError("smooth", smooth, "a distance in m, more than 0 and at most 1")
        return cls(names, unit, origin, flip, smooth)

    def in_frame(self, positions: Array) -> Array:
        """Positions of a log, m, shape (n, 2), in the frame with its origin mid-strip."""
        moved = positions - np.array(self.origin)
        return moved * np.array([-1.0 if self.flip else 1.0, 1.0])


def smoothed(positions: Array, tolerance: float) -> tuple[Array, Mask]:
    """Rows without their noise, and those of them that a path needs.

    A smoothing spline over the rows' numbers, as stiff as the tolerance lets it be; then points of it at least the
    tolerance apart, as a gripper at rest wanders.

    ``positions``: shape (n, 2); ``tolerance``: largest distance of the path from a row, in the unit of ``positions``.

    Returns positions, shape (n, 2), and which of them to keep, shape (n,).
    """
    if len(positions) < FEWEST:
        return positions, np.ones(len(positions), dtype=bool)
    from scipy.interpolate import make_smoothing_spline

    numbers = np.arange(len(positions), dtype=float)

    def fitted(exponent: float) -> Array:
        return np.asarray(make_smoothing_spline(numbers, positions, lam=10.0**exponent)(numbers))

    low, high, best = -4.0, STIFFEST, positions
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        found = fitted(middle)
        if np.linalg.norm(found - positions, axis=1).max() <= tolerance:
            low, best = middle, found
        else:
            high = middle
    return best, _apart(best, tolerance)


def _apart(positions: Array, distance: float) -> Mask:
    """The first and last position, and those between that are this far from the one kept before."""
    keep, last = np.zeros(len(positions), dtype=bool), 0
    keep[[0, -1]] = True
    for number in range(1, len(positions) - 1):
        if np.linalg.norm(positions[number] - positions[last]) >= distance:
            keep[number], last = True, number
    # None just before the last.
    if last and np.linalg.norm(positions[-1] - positions[last]) < distance:
        keep[last] = False
    return keep

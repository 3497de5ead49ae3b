"""Gripper paths as tables of ``t,x,z`` in SI: reading a user's path, writing a planned one."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Self

import numpy as np
from pydantic import model_validator

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import UNITS
from stripfold.base.validation import Input, Number, Text
from stripfold.files.tables import Table, read_table
from stripfold.paths.curve import GripperPath, pieces_through, polygon_length, turns

HEADER, ANGLE = "t,x,z", "angle"
CORNER = float(np.deg2rad(10.0))
"""Change of direction, rad, above which a row is a corner: smooth paths are sampled more finely."""
MAX_ROWS = 20_000
SNAP, SNAP_SHARE = 5e-3, 0.05
"""Distance, m, and share of the length, by which a robot may miss what its path should be: more than the height of its
fingers' ends above the floor."""
START_TOLERANCE = 1e-3
"""Distance between the start of a path and the end of the flat strip that counts as rounding, over the length."""
SPACING = 0.05
"""Spacing of written rows, L*."""
STIFFEST = 16.0
"""Largest decimal logarithm of the spline's penalty, with rows one apart: longer than any log."""
HALVINGS = 12
FEWEST = 8
"""Rows below which there is nothing to smooth."""
LARGEST_TURN = 60.0
"""Rotation of the gripper from one row to the next that is refused, degrees: angles are to be continuous."""


class LogFormat(Input):
    """How a robot's log is to be read; each entry may be left out.

    ``columns``: names in the file, or numbers from 1 on, of the columns t, x and z, as "t,x,z".  ``unit``: "m", "cm" or
    "mm", of positions in the file; else what its header says, or m.  ``frame``: "x0,z0" or "x0,z0,flip": x and z in the
    log, m, of the point on the floor under the middle of the strip, and whether the log's x runs against the direction
    of folding.  ``smooth``: largest distance of the path from the rows, m; else the path goes through the rows.
    """

    columns: Text | None = None
    unit: Text | None = None
    frame: Text | None = None
    smooth: Number | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.columns is not None and (len(self.names) != 3 or not all(self.names)):
            raise InvalidInputError("columns", self.columns, "three names or numbers of columns, as time,x,z or 1,3,5")
        if self.unit not in (None, *UNITS["m"]):
            raise InvalidInputError("unit", self.unit, f"one of {', '.join(UNITS['m'])}")
        if not np.isfinite(self.origin).all() or (self.frame or "").count(",") > 1 + self.flip:
            raise InvalidInputError("frame", self.frame, "x0,z0 in m, or x0,z0,flip", "as --frame=-0.1,0.02,flip")
        if self.smooth is not None and not 0.0 < self.smooth <= 1.0:
            raise InvalidInputError("smooth", self.smooth, "a distance in m, more than 0 and at most 1")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names or numbers of the columns; none of a table that names them t, x and z."""
        return () if self.columns is None else tuple(name.strip() for name in self.columns.split(","))

    @property
    def origin(self) -> Array:
        """The point under the middle of the strip, m; nan where the frame is not two numbers."""
        try:
            x0, z0 = map(float, ("0,0" if self.frame is None else self.frame).split(",")[:2])
        except ValueError:
            x0 = z0 = np.nan
        return np.array([x0, z0])

    @property
    def flip(self) -> bool:
        """Whether x runs against the direction of folding."""
        return [word.strip() for word in (self.frame or "").split(",")[2:]] == ["flip"]

    def in_frame(self, positions: Array) -> Array:
        """Return positions of a log, m, shape (n, 2), in the frame with its origin mid-strip."""
        return (positions - self.origin) * self._signs

    @property
    def _signs(self) -> Array:
        return np.array([-1.0 if self.flip else 1.0, 1.0])

    def meant(self, positions: Array, length: float, stated: bool) -> str:
        """Say with which options a log starts where a flat strip ends.

        ``positions``: of the log as it is read, m, shape (n, 2); ``length``: of the strip, m; ``stated``: whether the
        log's header has their unit.
        """
        factors = {"": 1.0} if stated or self.unit else UNITS["m"]
        # The gripper goes about as far as the strip is long.
        size = float(np.linalg.norm(np.ptp(positions, axis=0))) or length
        unit = min(factors, key=lambda name: abs(np.log(factors[name] * size / length)))
        first = factors[unit] * positions[0]
        origin = np.round(first + self._signs * np.array([length / 2.0, 0.0]), 4)
        words = [] if factors[unit] == 1.0 else [f"--unit {unit}"]
        if np.hypot(*(origin - self.origin)) > START_TOLERANCE * length:
            words.append(f"--frame={origin[0]:g},{origin[1]:g}{',flip' * self.flip}")
            if self.frame is None and abs(first[1]) <= START_TOLERANCE * length and first[0] < 0.0:
                words.append(f"or --length {-2.0 * first[0]:.4g}")
        return f"with {' '.join(words)} it starts there"


def read(path: str | os.PathLike[str], length: float, unit: float, log: LogFormat | None = None) -> GripperPath:
    """A user's path: a spline through the rows between corners, rows where it turns by more than :data:`CORNER`.

    ``path``: table with the columns ``t,x,z`` (:func:`.read_table`): pseudo time, increasing, of which the first is
    taken off; position of the gripper, m, with the origin mid-strip on the floor.  ``length``: length of the strip,
    L*.  ``unit``: L*, m.  ``log``: where the table has other columns, another unit or frame, or noise.  A column
    ``angle`` is the rotation of the gripper, degrees, 0 where it grasps the flat strip and 180 on the folded one.
    Raises InvalidInputError: not such a table, or a path that a strip of this length cannot follow; the message names
    the row.
    """
    path, log = Path(path), log or LogFormat()
    table = read_table("path", path, HEADER, (2, MAX_ROWS), log.names, (ANGLE,))
    stated = {name for name in table.units[1:3] if name}
    if log.unit and stated - {log.unit}:
        raise InvalidInputError("unit", log.unit, f"{' and '.join(stated)}, as the header says", "leave it out")
    numbers = table.numbers()
    in_metres = [1.0 if name else UNITS["m"][log.unit or max(stated, default="m")] for name in table.units[1:3]]
    t, logged = numbers[:, 0] - numbers[0, 0], numbers[:, 1:3] * in_metres
    positions = log.in_frame(logged) / unit
    table.check_increasing(t)
    angles = _checked_angles(table, numbers[:, 3]) if numbers.shape[1] > 3 else None
    keep = np.ones(len(t), dtype=bool)
    if log.smooth is not None:
        positions, keep = smoothed(positions, log.smooth / unit)
    travelled = polygon_length(positions)
    rounding = max(START_TOLERANCE * length, (log.smooth or 0.0) / unit)
    positions, warnings = _snapped(positions, length, unit, rounding)
    if np.hypot(*(positions[0] - (-length / 2.0, 0.0))) > rounding:
        allowed = f"a start at ({-length / 2.0 * unit:g}, 0) m, where the flat strip ends"
        advice = log.meant(logged, length * unit, bool(stated))
        raise InvalidInputError("path", _in_metres(positions[0], unit), allowed, advice)
    _check_rows(positions, length, unit, table.place)
    positions[0] = (-length / 2.0, 0.0)
    shown, positions = travelled[keep], positions[keep]
    moved = np.concatenate([[True], np.linalg.norm(np.diff(positions, axis=0), axis=1) > 1e-9])
    if moved.sum() < 2:
        raise InvalidInputError("path", str(path), "at least two different places")
    shown, positions = shown[moved], positions[moved]
    turned = [] if angles is None else [angles[keep][moved]]
    ends = [0, *(np.flatnonzero(turns(positions) > CORNER) + 1), len(positions) - 1]
    parts = (
        (f"rows {i + 1} to {j + 1}", positions[i : j + 1], *(of[i : j + 1] for of in turned)) for i, j in pairwise(ends)
    )
    # A row on the floor has no business under it between the rows either.
    above_floor = bool(warnings or log.smooth)
    pieces = tuple(replace(piece, above_floor=above_floor) for piece in pieces_through(parts))
    # Times and numbers of all rows, also of those left out.
    numbers_in_file = np.array([number for number, _ in table.rows])
    rows_at = np.interp(travelled, shown, polygon_length(positions))
    stamped = np.concatenate([[True], np.diff(rows_at) > 0.0])
    found = GripperPath(path.name, pieces, (rows_at[stamped], t[stamped], numbers_in_file[stamped]), warnings)
    lowest = found.sampled(SPACING)[1][:, 1].min()
    if lowest < -1e-6:
        allowed = "at least 0 m, the floor, also between the rows"
        raise InvalidInputError("z", lowest * unit, allowed, "give more rows where it bends")
    return found


def _checked_angles(table: Table, angles: Array) -> Array:
    """The rotation of the gripper at each row, rad."""
    steps = np.abs(np.diff(angles, prepend=0.0))
    if steps.max() > LARGEST_TURN:
        row = int(np.argmax(steps > LARGEST_TURN))
        allowed = f"degrees, 0 where the gripper grasps the flat strip, within {LARGEST_TURN:g} of the row before"
        raise InvalidInputError(ANGLE, float(angles[row]), allowed, table.place(row))
    return np.asarray(np.deg2rad(angles))


def largest_miss(length: float, unit: float) -> float:
    """Distance by which a robot may miss a place, L*, with a strip of this length, L*; ``unit`` is L* in m."""
    return min(SNAP / unit, SNAP_SHARE * length)


def _snapped(positions: Array, length: float, unit: float, rounding: float) -> tuple[Array, tuple[str, ...]]:
    """Positions that a robot misses by little are moved to where they can be, and what was done is said.

    What is less than ``rounding`` is not worth a word.
    """
    most, warnings = largest_miss(length, unit), []
    held, flat = np.array([length / 2.0, 0.0]), np.array([-length / 2.0, 0.0])
    off = positions[0] - flat
    if rounding < np.linalg.norm(off) <= most:
        positions = positions - off
        x, z = 1e3 * unit * off
        warnings.append(f"the path starts {x:.2g} mm in x and {z:.2g} mm in z off the strip's end: all of it is moved")
    depth = -positions[:, 1].min()
    if 0.0 < depth <= most:
        positions = np.maximum(positions, [-np.inf, 0.0])
        if depth > (rounding if rounding > START_TOLERANCE * length else 0.0):
            warnings.append(f"the path goes {1e3 * unit * depth:.2g} mm below the floor: it is kept on it")
    from_held = np.linalg.norm(positions - held, axis=1)
    beyond = from_held.max() - length
    if 0.0 < beyond <= most:
        share = np.minimum(1.0, length / np.maximum(from_held, 1e-300))[:, None]
        positions = held + share * (positions - held)
        if beyond > rounding:
            warnings.append(f"the path goes {1e3 * unit * beyond:.2g} mm beyond the strip's length: it is kept within")
    return positions.copy(), tuple(warnings)


def _in_metres(position: Array, unit: float) -> str:
    x, z = position * unit
    return f"({x:g}, {z:g}) m"


def _check_rows(positions: Array, length: float, unit: float, place: Callable[[int], str]) -> None:
    """Refuse the row that is farthest from where it can be: others may be off by rounding."""
    low = int(np.argmin(positions[:, 1]))
    if positions[low, 1] < 0.0:
        raise InvalidInputError("z", float(positions[low, 1] * unit), f"at least 0 m, the floor ({place(low)})")
    half = length / 2.0
    away = np.hypot(positions[:, 0] - half, positions[:, 1])
    far = 1 + int(np.argmax(away[1:]))
    if away[far] > length * (1.0 + 1e-12):
        allowed = f"within {length * unit:g} m, the strip's length, of the held end at ({half * unit:g}, 0) m"
        advice = f"it is {1e3 * unit * (away[far] - length):.2g} mm beyond"
        raise InvalidInputError("path", _in_metres(positions[far], unit), f"{allowed} ({place(far)})", advice)


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


def rows(path: GripperPath, spacing: float) -> Array:
    """Shape (n, 3): pseudo time, x and z, m, at most ``spacing`` apart, of a path in metres."""
    s, positions = path.sampled(spacing)
    t = [path.pseudo_time(float(travelled)) for travelled in s]
    return np.column_stack([t, positions[:, 0], np.maximum(positions[:, 1], 0.0)])


def as_text(path: GripperPath, spacing: float, comments: tuple[str, ...] = ()) -> str:
    """A path in metres as a table that :func:`read` accepts, after lines of comments."""
    places = rows(path, spacing)
    if path.turns:
        angles = [np.rad2deg(path.angle(float(s))[0]) for s in path.sampled(spacing)[0]]
        places = np.column_stack([places, angles])
    lines = [f"# {line}" for line in comments] + [f"{HEADER},{ANGLE}" if path.turns else HEADER]
    lines += [",".join(f"{value:.9g}" for value in row) for row in places]
    return "\n".join(lines) + "\n"

"""Gripper paths as tables of ``t,x,z`` in SI: reading a user's path, writing a planned one."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import UNITS
from stripfold.files.tables import read_table
from stripfold.paths.curve import GripperPath, pieces_through, polygon_length
from stripfold.paths.robot_log import LogFormat, smoothed

HEADER = "t,x,z"
CORNER = float(np.deg2rad(10.0))
"""Change of direction, rad, above which a row is a corner: smooth paths are sampled more finely."""
MAX_ROWS = 20_000
SNAP, SNAP_SHARE = 5e-3, 0.05
"""Distance, m, and share of the length, by which a robot may miss what its path should be: more than the height of its
fingers' ends above the floor."""
AS_WRITTEN = LogFormat()
START_TOLERANCE = 1e-3
"""Distance between the start of a path and the end of the flat strip that counts as rounding, over the length."""
SPACING = 0.05
"""Spacing of written rows, L*."""


def read(path: str | os.PathLike[str], length: float, unit: float, log: LogFormat = AS_WRITTEN) -> GripperPath:
    """A user's path: a spline through the rows between corners, rows where it turns by more than :data:`CORNER`.

    ``path``: table with the columns ``t,x,z`` (:func:`.read_table`): pseudo time, increasing, of which the first is
    taken off; position of the gripper, m, with the origin mid-strip on the floor.  ``length``: length of the strip,
    L*.  ``unit``: L*, m.  ``log``: where the table has other columns, another unit or frame, or noise.  Raises
    InvalidInputError: not such a table, or a path that a strip of this length cannot follow; the message names the row.
    """
    path = Path(path)
    table = read_table("path", path, HEADER, (2, MAX_ROWS), log.columns)
    stated = {name for name in table.units[1:] if name}
    if log.unit and stated - {log.unit}:
        raise InvalidInputError("unit", log.unit, f"{' and '.join(stated)}, as the header says", "leave it out")
    numbers = table.numbers()
    in_metres = [1.0 if name else UNITS["m"][log.unit or max(stated, default="m")] for name in table.units[1:]]
    t, positions = numbers[:, 0] - numbers[0, 0], log.in_frame(numbers[:, 1:] * in_metres) / unit
    table.check_increasing(t)
    keep = np.ones(len(t), dtype=bool)
    if log.smooth is not None:
        positions, keep = smoothed(positions, log.smooth / unit)
    travelled = polygon_length(positions)
    rounding = max(START_TOLERANCE * length, (log.smooth or 0.0) / unit)
    positions, warnings = _snapped(positions, length, unit, rounding)
    _check_rows(positions, length, unit, table.place, rounding)
    positions[0] = (-length / 2.0, 0.0)
    shown, positions = travelled[keep], positions[keep]
    moved = np.concatenate([[True], np.linalg.norm(np.diff(positions, axis=0), axis=1) > 1e-9])
    if moved.sum() < 2:
        raise InvalidInputError("path", str(path), "at least two different places")
    shown, positions = shown[moved], positions[moved]
    direction = np.diff(positions, axis=0) @ [1.0, 1j]
    turn = np.abs(np.angle(direction[1:] / direction[:-1]))
    ends = [0, *(np.flatnonzero(turn > CORNER) + 1), len(positions) - 1]
    parts = ((f"rows {i + 1} to {j + 1}", positions[i : j + 1]) for i, j in pairwise(ends))
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


def _check_rows(positions: Array, length: float, unit: float, place: Callable[[int], str], rounding: float) -> None:
    half, flat = length / 2.0, np.array([-length / 2.0, 0.0])

    def in_metres(row: int) -> str:
        x, z = positions[row] * unit
        return f"({x:g}, {z:g}) m"

    def refuse(bad: Mask, key: str, value: Callable[[int], float | str], allowed: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            raise InvalidInputError(key, value(row), f"{allowed} ({place(row)})")

    if np.hypot(*(positions[0] - flat)) > rounding:
        allowed = f"a start at ({-half * unit:g}, 0) m, where the flat strip ends"
        fits = [name for name, factor in UNITS["m"].items() if np.hypot(*(factor * positions[0] - flat)) <= rounding]
        advice = (
            f"with --unit {fits[0]} it starts there" if fits else "for another frame or unit give --frame or --unit"
        )
        raise InvalidInputError("path", in_metres(0), allowed, advice)
    refuse(positions[:, 1] < 0.0, "z", lambda row: float(positions[row, 1] * unit), "at least 0 m, the floor")
    beyond = np.hypot(positions[:, 0] - half, positions[:, 1]) > length * (1.0 + 1e-12)
    beyond[0] = False
    allowed = f"within {length * unit:g} m, the strip's length, of the held end at ({half * unit:g}, 0) m"
    refuse(beyond, "path", in_metres, allowed)


def rows(path: GripperPath, spacing: float) -> Array:
    """Shape (n, 3): pseudo time, x and z, m, at most ``spacing`` apart, of a path in metres."""
    s, positions = path.sampled(spacing)
    t = [path.pseudo_time(float(travelled)) for travelled in s]
    return np.column_stack([t, positions[:, 0], np.maximum(positions[:, 1], 0.0)])


def as_text(path: GripperPath, spacing: float, comments: tuple[str, ...] = ()) -> str:
    """A path in metres as a table that :func:`read` accepts, after lines of comments."""
    lines = [f"# {line}" for line in comments] + [HEADER]
    lines += [f"{t:.9g},{x:.9g},{z:.9g}" for t, x, z in rows(path, spacing)]
    return "\n".join(lines) + "\n"

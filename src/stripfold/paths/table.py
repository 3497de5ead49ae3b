"""Gripper paths as tables of ``t,x,z`` in SI: reading a user's path, writing a planned one."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from stripfold.arrays import Array, Mask
from stripfold.errors import InvalidInputError
from stripfold.paths.curve import GripperPath, pieces_through, polygon_length
from stripfold.tables import check_increasing, read_table

HEADER = "t,x,z"
ANGLE = "angle"
"""Last column of a plan's table: the gripper's rotation, which statics does not need."""
CORNER = float(np.deg2rad(10.0))
"""Change of direction, rad, above which a row is a corner: smooth paths are sampled more finely."""
MAX_ROWS = 20_000
START_TOLERANCE = 1e-3
"""Distance between the start of a path and the end of the flat strip that counts as rounding, over the length."""
SPACING = 0.05
"""Spacing of written rows, L*."""


def read(path: str | os.PathLike[str], length: float, unit: float) -> GripperPath:
    """A user's path: a spline through the rows between corners, rows where it turns by more than :data:`CORNER`.

    Parameters
    ----------
    path
        CSV file with the columns ``t,x,z``: pseudo time, increasing; position of the gripper, m, with the origin
        mid-strip on the floor; a last column ``angle`` and lines that begin with ``#`` are ignored.
    length
        Length of the strip, L*.
    unit
        L*, m.

    Raises
    ------
    InvalidInputError
        Not such a table, or a path that a strip of this length cannot follow; the message names the row.
    """
    path = Path(path)
    table = read_table("path", path, HEADER, (2, MAX_ROWS), ANGLE)
    t, positions = table[:, 0], table[:, 1:] / unit
    check_increasing("t", t, path)
    _check_rows(positions, length, unit, path.name)
    positions[0] = (-length / 2.0, 0.0)
    moved = np.concatenate([[True], np.linalg.norm(np.diff(positions, axis=0), axis=1) > 1e-9])
    if moved.sum() < 2:
        raise InvalidInputError("path", str(path), "at least two different places")
    t, positions = t[moved], positions[moved]
    direction = np.diff(positions, axis=0) @ [1.0, 1j]
    turn = np.abs(np.angle(direction[1:] / direction[:-1]))
    ends = [0, *(np.flatnonzero(turn > CORNER) + 1), len(positions) - 1]
    pieces = pieces_through((f"rows {i + 1} to {j + 1}", positions[i : j + 1]) for i, j in pairwise(ends))
    found = GripperPath(path.name, pieces, (polygon_length(positions), t))
    lowest = found.sampled(SPACING)[1][:, 1].min()
    if lowest < -1e-6:
        allowed = "at least 0 m, the floor, also between the rows"
        raise InvalidInputError("z", lowest * unit, allowed, "give more rows where it bends")
    return found


def _check_rows(positions: Array, length: float, unit: float, name: str) -> None:
    half = length / 2.0

    def in_metres(row: int) -> str:
        x, z = positions[row] * unit
        return f"({x:g}, {z:g}) m"

    def refuse(bad: Mask, key: str, value: Callable[[int], float | str], allowed: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            raise InvalidInputError(key, value(row), f"{allowed} (row {row + 1} of {name})")

    if np.hypot(positions[0, 0] + half, positions[0, 1]) > START_TOLERANCE * length:
        allowed = f"a start at ({-half * unit:g}, 0) m, where the flat strip ends"
        raise InvalidInputError("path", in_metres(0), allowed)
    refuse(positions[:, 1] < 0.0, "z", lambda row: float(positions[row, 1] * unit), "at least 0 m, the floor")
    beyond = np.hypot(positions[:, 0] - half, positions[:, 1]) > length
    beyond[0] = False
    allowed = f"within {length * unit:g} m, the strip's length, of the held end at ({half * unit:g}, 0) m"
    refuse(beyond, "path", in_metres, allowed)


def rows(path: GripperPath, unit: float) -> Array:
    """Shape (n, 3): pseudo time, x and z, m, at most :data:`SPACING` apart; ``unit`` is L* in m."""
    s, positions = path.sampled(SPACING)
    t = [path.pseudo_time(float(travelled)) for travelled in s]
    return np.column_stack([t, positions[:, 0] * unit, np.maximum(positions[:, 1] * unit, 0.0)])


def as_text(path: GripperPath, unit: float, comments: tuple[str, ...] = ()) -> str:
    """A path in L* as a table that :func:`read` accepts, after lines of comments; ``unit`` is L* in m."""
    lines = [f"# {line}" for line in comments] + [HEADER]
    lines += [f"{t:.9g},{x:.9g},{z:.9g}" for t, x, z in rows(path, unit)]
    return "\n".join(lines) + "\n"

"""Gripper paths as tables of ``t,x,z`` in SI: a user's own path read, a planned one written."""

from __future__ import annotations

import csv
import os
from itertools import pairwise

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.paths.curve import GripperPath, Piece, polygon_length
from stripfold.store import write_text

HEADER = "t,x,z"
CORNER = float(np.deg2rad(10.0))
"""Turn from one row to the next from which on a row is a corner, rad: a smooth path is sampled more finely."""
MOST_ROWS = 20_000
SLACK = 1e-3
"""How far a path may begin from the flat strip's end, as a share of its length: a rounded number is no mistake."""
SPACING = 0.05
"""Spacing of written rows, L*."""


def read(path: str | os.PathLike[str], length: float, unit: float) -> GripperPath:
    """A user's path.

    Rows that turn by more than :data:`CORNER` are corners; between corners a spline goes through the rows.

    Parameters
    ----------
    path
        CSV file with the columns ``t,x,z``: pseudo time, ascending; place of the gripper, m, in the frame with its
        origin mid-strip on the floor.  Lines that begin with ``#`` are left out.
    length
        Length of the strip, L*.
    unit
        L*, m.

    Raises
    ------
    InvalidInputError
        No such table, or a path that no strip of this length can follow; the message names the row.
    """
    t, places = _rows(path)
    places = places / unit
    half = length / 2.0
    _check_rows(t, places, length, unit, os.path.basename(path))
    places[0] = (-half, 0.0)
    moved = np.concatenate([[True], np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-9])
    if moved.sum() < 2:
        raise InvalidInputError("path", str(path), "at least two different places")
    t, places = t[moved], places[moved]
    steps = np.diff(places, axis=0)
    turn = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(steps[:, 1], steps[:, 0])))))
    ends = [0, *(np.flatnonzero(turn > CORNER) + 1), len(places) - 1]
    pieces: list[Piece] = []
    for i, j in pairwise(ends):
        pieces.append(Piece.through(places[i : j + 1], pieces[-1].end if pieces else 0.0, f"rows {i + 1} to {j + 1}"))
    found = GripperPath(os.path.basename(path), tuple(pieces), (polygon_length(places), t))
    lowest = found.sampled(SPACING)[1][:, 1].min()
    if lowest < -1e-6:
        raise InvalidInputError(
            "z", lowest * unit, "at least 0 m, the floor, also between the rows", "give more rows where it bends"
        )
    return found


def _rows(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Pseudo times, shape (n,), and places in m, shape (n, 2)."""
    allowed = f"a CSV file with the header {HEADER} and 2 to {MOST_ROWS} rows of numbers"
    try:
        with open(path, encoding="utf-8", newline="") as file:
            lines = [line for line in file.read(64 * MOST_ROWS).splitlines() if line.strip() and line[0] != "#"]
        header = [name.strip() for name in lines[0].split(",")]
        table = np.array([[float(value) for value in row] for row in csv.reader(lines[1:])])
    except (OSError, ValueError, IndexError) as error:
        raise InvalidInputError("path", str(path), allowed, " ".join(str(error).split())) from error
    if header != HEADER.split(","):
        raise InvalidInputError("path", ",".join(header)[:80], f"the header {HEADER}", "pseudo time and metres")
    if not (table.ndim == 2 and table.shape[1] == 3 and 2 <= len(table) <= MOST_ROWS):
        raise InvalidInputError("path", str(path), allowed)
    if not np.all(np.isfinite(table)):
        raise InvalidInputError("path", str(path), allowed, "a number is not finite")
    return table[:, 0], table[:, 1:]


def _check_rows(t: Array, places: Array, length: float, unit: float, name: str) -> None:
    half = length / 2.0
    backwards = np.flatnonzero(np.diff(t) <= 0.0)
    if len(backwards):
        row = int(backwards[0]) + 2
        raise InvalidInputError("t", float(t[row - 1]), f"more than in the row before (row {row} of {name})")
    if np.hypot(places[0, 0] + half, places[0, 1]) > SLACK * length:
        x, z = places[0] * unit
        raise InvalidInputError(
            "path", f"({x:g}, {z:g}) m", f"a start at ({-half * unit:g}, 0) m, where the flat strip ends"
        )
    below = np.flatnonzero(places[:, 1] < 0.0)
    if len(below):
        row = int(below[0])
        raise InvalidInputError("z", float(places[row, 1] * unit), f"at least 0 m, the floor (row {row + 1} of {name})")
    reach = np.hypot(places[:, 0] - half, places[:, 1])
    beyond = np.flatnonzero(reach[1:] > length)
    if len(beyond):
        row = int(beyond[0]) + 1
        raise InvalidInputError(
            "path",
            f"({places[row, 0] * unit:g}, {places[row, 1] * unit:g}) m",
            f"within {length * unit:g} m, the strip's length, of the held end at ({half * unit:g}, 0) m",
            f"row {row + 1} of {name} is out of the strip's reach",
        )


def write(path: GripperPath, target: str | os.PathLike[str], unit: float, comments: tuple[str, ...] = ()) -> int:
    """Write :func:`as_text` to a file; returns the number of rows."""
    text = as_text(path, unit, comments)
    write_text(text, target)
    return text.count("\n") - len(comments) - 1


def as_text(path: GripperPath, unit: float, comments: tuple[str, ...] = ()) -> str:
    """A path as a table that :func:`read` takes.

    Parameters
    ----------
    path
        The path, in L*.
    unit
        L*, m.
    comments
        Lines to begin with.
    """
    s, places = path.sampled(SPACING)
    lines = [f"# {line}" for line in comments] + [HEADER]
    for travelled, (x, z) in zip(s, places * unit, strict=True):
        lines.append(f"{path.pseudo_time(float(travelled)):.9g},{x:.9g},{max(z, 0.0):.9g}")
    return "\n".join(lines) + "\n"

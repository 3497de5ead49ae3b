"""Small tables of numbers as CSV: time stamps of frames, the log of a robot."""

from __future__ import annotations

import csv
import os
import stat
from pathlib import Path

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

_LONGEST = 200
"""Characters of a row."""


def table(key: str, path: Path, header: str, rows: tuple[int, int]) -> Array:
    """A table with the columns that ``header`` names; lines that begin with ``#`` are left out.

    Parameters
    ----------
    key
        What the table is, for errors.
    path
        The file.
    header
        Names of the columns, parted by commas.
    rows
        Fewest and most rows.

    Returns
    -------
    Array
        Shape (n, columns), finite.

    Raises
    ------
    InvalidInputError
        No such file, another header, not numbers, too few or too many rows; the message names the row.
    """
    columns = header.split(",")
    allowed = f"a CSV file with the header {header} and {rows[0]} to {rows[1]} rows of numbers"
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise InvalidInputError(key, str(path), allowed, "it is not a file")
        with open(path, encoding="utf-8-sig", newline="") as file:
            text = file.read(_LONGEST * (rows[1] + 100))
            if file.read(1):
                raise InvalidInputError(key, str(path), allowed, "the file is longer than that")
        lines = [line for line in text.splitlines() if line.strip() and line[0] != "#"]
        if not lines or [name.strip() for name in lines[0].split(",")] != columns:
            raise InvalidInputError(key, (lines or [""])[0][:80], f"the header {header}", f"look at {path}")
        if not rows[0] <= len(lines) - 1 <= rows[1]:
            raise InvalidInputError(key, f"{len(lines) - 1} rows", allowed, f"look at {path}")
        values = np.empty((len(lines) - 1, len(columns)))
        for number, row in enumerate(csv.reader(lines[1:]), start=1):
            try:
                values[number - 1] = np.array([float(entry) for entry in row]).reshape(len(columns))
            except ValueError as error:
                raise InvalidInputError(key, ",".join(row)[:80], allowed, f"row {number} of {path.name}") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidInputError(key, str(path), allowed, " ".join(str(error).split())) from error
    endless = np.flatnonzero(~np.all(np.isfinite(values), axis=1))
    if len(endless):
        raise InvalidInputError(
            key, values[endless[0]].tolist(), "finite numbers", f"row {endless[0] + 1} of {path.name}"
        )
    return values


def ascending(key: str, t: Array, path: Path) -> Array:
    """``t`` itself, when each value is larger than the one before.

    Raises
    ------
    InvalidInputError
        One is not; the message names its row.
    """
    backwards = np.flatnonzero(np.diff(t) <= 0.0)
    if len(backwards):
        row = int(backwards[0]) + 2
        raise InvalidInputError(key, float(t[row - 1]), "times that increase", f"row {row} of {path.name}")
    return t

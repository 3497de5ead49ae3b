"""Small CSV tables: a gripper's path, frame times, the robot's log, the stops of the robot grid."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

_LONGEST = 200
"""Characters of a row, on average."""


def read_rows(key: str, path: Path, header: str, limits: tuple[int, int], unread: str = "") -> list[list[str]]:
    """The rows of a table below its ``header``; empty lines and lines that begin with ``#`` are ignored.

    Parameters
    ----------
    key
        Name of the table, for errors.
    header
        Names of the columns, separated by commas.
    limits
        Smallest and largest number of rows.
    unread
        Name of a column that may be the last, and is left out.

    Raises
    ------
    InvalidInputError
        No such file, another header, or too few or too many rows.
    """
    allowed = f"a CSV file with the header {header} and {limits[0]} to {limits[1]} rows"
    try:
        if path.exists() and not path.is_file():  # a pipe would block
            raise InvalidInputError(key, str(path), allowed, "it is not a file")
        with open(path, encoding="utf-8-sig", newline="") as file:
            text = file.read(_LONGEST * (limits[1] + 100))
            if file.read(1):
                raise InvalidInputError(key, str(path), allowed, "the file is longer than that")
        rows = list(csv.reader(line for line in text.splitlines() if line.strip() and line[0] != "#"))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidInputError(key, str(path), allowed, " ".join(str(error).split())) from error
    if unread and rows and rows[0][-1].strip() == unread:
        width = len(rows[0])
        rows = [row[:-1] if len(row) == width else row for row in rows]
    if not rows or [name.strip() for name in rows[0]] != header.split(","):
        raise InvalidInputError(key, ",".join(rows[0])[:80] if rows else "", f"the header {header}", f"see {path}")
    if not limits[0] <= len(rows) - 1 <= limits[1]:
        raise InvalidInputError(key, f"{len(rows) - 1} rows", allowed, f"see {path}")
    return rows[1:]


def to_numbers(key: str, path: Path, rows: list[list[str]], columns: int) -> Array:
    """Finite numbers, shape (n, columns), from the text of ``rows``.

    Raises
    ------
    InvalidInputError
        An entry that is not a finite number, or a row of another length; the message names the row.
    """
    values = np.empty((len(rows), columns))
    for number, row in enumerate(rows, start=1):
        try:
            values[number - 1] = np.array([float(entry) for entry in row]).reshape(columns)
        except ValueError as error:
            allowed = f"{columns} numbers in each row"
            raise InvalidInputError(key, ",".join(row)[:80], allowed, f"row {number} of {path.name}") from error
        if not np.all(np.isfinite(values[number - 1])):
            raise InvalidInputError(key, ",".join(row)[:80], "finite numbers", f"row {number} of {path.name}")
    return values


def read_table(key: str, path: Path, header: str, limits: tuple[int, int], unread: str = "") -> Array:
    """A table of finite numbers, shape (n, columns); see :func:`read_rows` and :func:`to_numbers`."""
    return to_numbers(key, path, read_rows(key, path, header, limits, unread), len(header.split(",")))


def check_increasing(key: str, times: Array, path: Path) -> None:
    """Raise :class:`InvalidInputError`, which names the row, unless each value is larger than the one before."""
    backwards = np.flatnonzero(np.diff(times) <= 0.0)
    if len(backwards):
        row = int(backwards[0]) + 2
        raise InvalidInputError(key, float(times[row - 1]), "times that increase", f"row {row} of {path.name}")

"""Small CSV tables: a gripper's path, frame times, the robot's log, the stops of the robot grid."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

_LONGEST = 200
"""Bytes of a row, on average."""
LARGEST = 1e30
"""Largest number in a table, so that no power of it that is needed overflows: time stamps in ns are 1e18."""
_DECIMAL, _COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*"), re.compile(",")
"""A number with a decimal comma."""


def read_rows(
    key: str, path: Path, header: str, limits: tuple[int, int], columns: Sequence[str] = ()
) -> list[list[str]]:
    """The entries of a table in the columns asked for; empty lines and lines that begin with ``#`` are ignored.

    Columns are separated by semicolons, tabs or commas; with one of the first two a comma may be the decimal mark.  A
    file without names of columns has the asked ones in their order, and no other.

    ``key``: name of the table, for errors.  ``header``: names of the columns, separated by commas; the file may have
    more, in any order.  ``limits``: smallest and largest number of rows.  ``columns``: where these columns are: their
    names in the file, or their numbers from 1 on.  Raises InvalidInputError: no such file, no such columns, or too few
    or too many rows.
    """
    allowed = f"a CSV file with the header {header} and {limits[0]} to {limits[1]} rows"
    try:
        if path.exists() and not path.is_file():  # a pipe would block
            raise InvalidInputError(key, str(path), allowed, "it is not a file")
        rows = _split(_text(key, path, _LONGEST * (limits[1] + 100), allowed))
    except (OSError, UnicodeError, csv.Error) as error:
        raise InvalidInputError(key, str(path), allowed, " ".join(str(error).split())) from error
    first = [name.strip() for name in rows[0]] if rows else []
    named = any(_number(entry) is None for entry in first)
    rows = rows[1:] if named else rows
    if not limits[0] <= len(rows) <= limits[1]:
        raise InvalidInputError(key, f"{len(rows)} rows", allowed, f"see {path}")
    places = _places(key, path, header, columns, first, named)
    if places == list(range(len(first))):
        return rows
    for number, row in enumerate(rows, start=1):
        if len(row) != len(first):
            wanted = f"{len(first)} entries in each row"
            raise InvalidInputError(key, ",".join(row)[:80], wanted, f"row {number} of {path.name}")
    return [[row[place] for place in places] for row in rows]


def _text(key: str, path: Path, longest: int, allowed: str) -> str:
    """The file's text, by its byte-order mark or as UTF-8."""
    with open(path, "rb") as file:
        data = file.read(longest)
        if file.read(1):
            raise InvalidInputError(key, str(path), allowed, "the file is longer than that")
    return data.decode("utf-16" if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8-sig")


def _split(text: str) -> list[list[str]]:
    """The entries of all rows, with decimal points, without a last column that has no entries."""
    lines = [line for line in text.splitlines() if line.strip() and line[0] != "#"]
    separator = next((mark for mark in ";\t" if lines and mark in lines[0]), ",")
    rows = list(csv.reader(lines, delimiter=separator))
    if all(row and not row[-1].strip() for row in rows):
        rows = [row[:-1] for row in rows]
    if separator != ",":
        rows = [[_COMMA.sub(".", entry) if _DECIMAL.fullmatch(entry) else entry for entry in row] for row in rows]
    return rows


def _number(entry: str) -> float | None:
    try:
        return float(entry)
    except ValueError:
        return None


def _places(key: str, path: Path, header: str, columns: Sequence[str], first: list[str], named: bool) -> list[int]:
    """Positions of the columns asked for, by the first row."""
    asked = list(columns) or header.split(",")
    shown = ",".join(first)[:80]
    if not named and not columns:
        if len(first) != len(asked):
            allowed = f"the header {header}, or rows of {len(asked)} numbers"
            raise InvalidInputError(key, shown, allowed, f"see {path}; name its columns in the first row")
        return list(range(len(asked)))
    found = []
    names = [name.casefold() for name in first] if named else []
    numbers = [str(number) for number in range(1, len(first) + 1)]
    for column in asked:
        if columns and column in numbers:
            found.append(numbers.index(column))
        elif names.count(column.casefold()) == 1:
            found.append(names.index(column.casefold()))
        else:
            allowed = f"the header {header}" if not columns else f"a table with one column {column[:80]}"
            raise InvalidInputError(key, shown, allowed, f"see {path}")
    return found


def to_numbers(key: str, path: Path, rows: list[list[str]], columns: int) -> Array:
    """Numbers of at most :data:`LARGEST`, shape (n, columns), from the text of ``rows``.

    Raises InvalidInputError: an entry that is not such a number, or a row of another length; the message names the row.
    """
    values = np.empty((len(rows), columns))
    for number, row in enumerate(rows, start=1):
        try:
            values[number - 1] = np.array([float(entry) for entry in row]).reshape(columns)
        except ValueError as error:
            allowed = f"{columns} numbers in each row"
            raise InvalidInputError(key, ",".join(row)[:80], allowed, f"row {number} of {path.name}") from error
        if not np.all(np.abs(values[number - 1]) <= LARGEST):
            allowed = f"finite numbers from {-LARGEST:g} to {LARGEST:g}"
            raise InvalidInputError(key, ",".join(row)[:80], allowed, f"row {number} of {path.name}")
    return values


def read_table(key: str, path: Path, header: str, limits: tuple[int, int], columns: Sequence[str] = ()) -> Array:
    """A table of numbers, shape (n, columns); see :func:`read_rows` and :func:`to_numbers`."""
    return to_numbers(key, path, read_rows(key, path, header, limits, columns), len(header.split(",")))


def check_increasing(key: str, times: Array, path: Path) -> None:
    """Raise :class:`InvalidInputError`, which names the row, unless each value is larger than the one before."""
    backwards = np.flatnonzero(np.diff(times) <= 0.0)
    if len(backwards):
        row = int(backwards[0]) + 2
        raise InvalidInputError(key, float(times[row - 1]), "times that increase", f"row {row} of {path.name}")

"""Small tables as text: a gripper's path, frame times, the robot's log, the stops of the robot grid."""

from __future__ import annotations

import codecs
import csv
import io
import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf
from pathlib import Path

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import UNITS

_LONGEST = 200
"""Bytes of a row, on average."""
LARGEST = 1e30
"""Largest number in a table, so that no power of it that is needed overflows: time stamps in ns are 1e18."""
_UNITS = UNITS["m"] | UNITS["s"]
"""Units that a name of a column may have behind it, as in ``x [mm]`` or ``t (s)``."""
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "blanks"}
_COMMENTS = "#%"
_DECIMAL, _COMMA = re.compile(r"\s*[-+]?\d+,\d+(?:[eE][-+]?\d+)?\s*"), re.compile(",")
"""A number with a decimal comma."""
_STAMP = re.compile(r"\s*\d{4}-\d\d-\d\d[T ]\d\d:")
_NAME = re.compile(r"(.*?)\s*(?:[\[(]\s*([^\[\]()]*?)\s*[\])])?", re.DOTALL)
"""The name of a column, and its unit in brackets."""


@dataclass(frozen=True)
class Table:
    """The entries of a table as texts, and where they stand in the file.

    ``key``: name of the table, for errors.  ``rows``: number in the file, from 1, and entries of each row.  ``units``:
    unit of each column by the header; empty where it names none.
    """

    key: str
    path: Path
    rows: list[tuple[int, list[str]]]
    units: tuple[str, ...]

    def numbers(self, columns: slice = slice(None)) -> Array:
        """Numbers of at most :data:`LARGEST`, shape (n, columns), in SI where the header names a unit.

        Raises InvalidInputError: an entry that is not such a number, or a row of another length; the message names the
        row.
        """
        units = np.array([_UNITS[unit] if unit else 1.0 for unit in self.units[columns]])
        values = np.empty((len(self.rows), len(units)))
        for index, (_, row) in enumerate(self.rows):
            entries = row[columns]
            numbers = [_number(entry) for entry in entries]
            if None in numbers or len(numbers) != len(units):
                raise self._refused(entries, f"{len(units)} numbers in each row", index)
            values[index] = numbers
            if not np.all(np.abs(values[index]) <= LARGEST):
                raise self._refused(entries, f"finite numbers from {-LARGEST:g} to {LARGEST:g}", index)
        return values * units

    def place(self, index: int) -> str:
        """Where a row is in the file, in words."""
        return f"row {self.rows[index][0]} of {self.path.name}"

    def check_increasing(
        self, values: Array, key: str = "t", allowed: str = "times that increase", above: float = -inf
    ) -> None:
        """Raise :class:`InvalidInputError`, which names the row, unless each value is larger than the one before.

        ``key``, ``allowed``: of the error.  ``above``: what the first one has to exceed.
        """
        backwards = np.flatnonzero(np.diff(values, prepend=above) <= 0.0)
        if len(backwards):
            index = int(backwards[0])
            raise InvalidInputError(key, float(values[index]), allowed, self.place(index))

    def _refused(self, entries: list[str], allowed: str, index: int) -> InvalidInputError:
        return InvalidInputError(self.key, ",".join(entries)[:80], allowed, self.place(index))


def read_table(
    key: str,
    path: Path,
    header: str,
    limits: tuple[int, int],
    columns: Sequence[str] | None = None,
    more: Sequence[str] = (),
) -> Table:
    """The entries of a table in the columns asked for; empty lines and lines that begin with # or % are ignored.

    Columns are separated by semicolons, tabs, commas or blanks; where it is no comma, a comma may be the decimal mark.
    The names of the columns are in the first row, or in the comment before it.  A file without such names has the asked
    columns in their order, and no other.  A warning says what was assumed of a file that is not plain.

    ``key``: name of the table, for errors.  ``header``: names of the columns, separated by commas; the file may have
    more, in any order.  ``limits``: smallest and largest number of rows.  ``columns``: where these columns are: their
    names in the file, or their numbers from 1 on; empty where they are not given, None where they cannot be.  ``more``:
    names of columns that come behind these where the file has them.  Raises InvalidInputError: no such file, no such
    columns, or too few or too many rows.
    """
    allowed = f"a CSV file with the header {header} and {limits[0]} to {limits[1]} rows"
    try:
        if path.exists() and not path.is_file():  # a pipe would block
            raise InvalidInputError(key, str(path), allowed, "it is not a file")
        text, encoding = _text(key, path, _LONGEST * (limits[1] + 100), allowed)
        lines = [line for line in enumerate(io.StringIO(text, newline=None), start=1) if line[1].strip()]
        plain = [line for line in lines if not line[1].lstrip().startswith(tuple(_COMMENTS))]
        separator = _separator([line for _, line in plain[:2]])
        entries = [_cut(line, separator) for _, line in plain]
    except (OSError, csv.Error) as error:
        raise InvalidInputError(key, str(path), allowed, " ".join(str(error).split())) from error
    comma = separator != "," and any(_DECIMAL.fullmatch(entry) for row in entries for entry in row)
    if comma:
        entries = [[_COMMA.sub(".", entry) if _DECIMAL.fullmatch(entry) else entry for entry in row] for row in entries]
    width = max(map(_filled, entries), default=0)
    named = bool(entries) and any(_number(entry) is None for entry in entries[0][:width])
    before = [line for number, line in lines if plain and number < plain[0][0]]
    names = _names(plain[0][1] if named else before[-1].lstrip(f" \t{_COMMENTS}") if before else "", separator, width)
    if not named and len(names) != width:  # a comment in words
        names = []
    width = len(names) or width
    # Without what has no entries: some programs end each row with a separator.
    rows = [(number, row[: max(width, _filled(row))]) for (number, _), row in zip(plain, entries, strict=True)]
    rows = rows[1:] if named else rows
    if not limits[0] <= len(rows) <= limits[1]:
        raise InvalidInputError(key, f"{len(rows)} rows", allowed, f"see {path}")
    asked = list(columns or header.split(","))
    places = [place for column in asked if (place := _place(column, names, width if columns else 0)) is not None]
    by_order = not (named or columns or places) and width == len(asked)
    if by_order:
        places = list(range(width))
    if len(places) < len(asked):
        found = f"its columns are {', '.join(names)[:80]!r}" if names else f"it has {width} columns without names"
        found += f", with {_SEPARATORS[separator]} between them"
        if columns:
            missing = next(column for column in asked if _place(column, names, width) is None)
            known = f"one column of {path.name}, by its name or by its number from 1 to {width}"
            raise InvalidInputError("columns", missing, known, found)
        way = "name its columns in the first row" if columns is None else "give --columns with their names or numbers"
        raise InvalidInputError(
            key, str(path), f"the header {header}, or rows of {len(asked)} numbers", f"{found}; {way}"
        )
    places += [place for name in more if (place := _place(name, names, 0)) is not None]
    units = tuple(_unit(key, path, names[place]) if names else "" for place in places)
    other = dict.fromkeys(unit for unit in units if unit and _UNITS[unit] != 1.0)
    assumed = [
        f"as {encoding}" if encoding else "",
        "" if separator == "," else f"with {_SEPARATORS[separator]} between its columns",
        "with a decimal comma" if comma else "",
        "with the names in the comment before its first row" if names and not (named or by_order) else "",
        f"with its columns {', '.join(names)[:80]!r} as {header}" if names and by_order else "",
        f"in {', '.join(other)}, as its header says" if other else "",
    ]
    for number, row in rows:
        if len(row) != width:
            advice = f"row {number} of {path.name}"
            if separator == "," and max(len(row), width) == 2 * min(len(row), width):
                advice += "; with commas between the columns the decimal mark must be a point"
            raise InvalidInputError(key, ",".join(row)[:80], f"{width} entries in each row", advice)
    if any(assumed):
        logging.getLogger("stripfold").warning("%s is read %s", path.name, ", ".join(filter(None, assumed)))
    return Table(key, path, [(number, [row[place] for place in places]) for number, row in rows], units)


def _text(key: str, path: Path, longest: int, allowed: str) -> tuple[str, str]:
    """The file's text; and its encoding where it is neither UTF-8 nor said by a byte-order mark."""
    with open(path, "rb") as file:
        data = file.read(longest)
        if file.read(1):
            raise InvalidInputError(key, str(path), allowed, "the file is longer than that")
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        encodings = ["utf-16"]
    elif len(data) > 1 and b"\0" in data[:2] and data[:2] != b"\0\0":  # the first character is ASCII
        encodings = ["utf-16-le" if data[1] == 0 else "utf-16-be"]
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            return data.decode(encoding), "" if encoding in ("utf-16", "utf-8-sig") else encoding
        except UnicodeDecodeError:
            continue
    raise InvalidInputError(key, str(path), allowed, f"its text is not {' or '.join(encodings)}: save it as UTF-8")


def _separator(rows: Sequence[str]) -> str:
    """What is between the columns, by the first rows."""
    for mark in ";\t":
        if rows and all(mark in row for row in rows):
            return mark
    words = rows[-1].split() if rows else []
    are_numbers = all(_DECIMAL.fullmatch(word) or _number(word) is not None for word in words)
    return " " if len(words) > 1 and (are_numbers or "," not in rows[-1]) else ","


def _cut(line: str, separator: str) -> list[str]:
    if separator == " ":
        line = " ".join(re.sub(r"\s+(?=[\[(])", "", line).split())  # "x [m]" is one name
    return next(csv.reader([line.strip("\r\n")], delimiter=separator), [])


def _filled(row: list[str]) -> int:
    """Entries up to the last that is not empty."""
    return max((number for number, entry in enumerate(row, start=1) if entry.strip()), default=0)


def _names(line: str, separator: str, width: int) -> list[str]:
    """The names of the columns in the header, whose separator may be another than that of the rows."""
    ways = (_cut(line, mark) for mark in _SEPARATORS)
    row = next((row for row in ways if _filled(row) == width), _cut(line, separator))
    return [name.strip() for name in row[: _filled(row)]]


def _number(entry: str) -> float | None:
    """The number, or that of the seconds since 1970 where it is a date and a time as ISO 8601 writes them."""
    try:
        return float(entry)
    except ValueError:
        if not _STAMP.match(entry):
            return None
    try:
        stamp = datetime.fromisoformat(entry.strip())
    except ValueError:
        return None
    # Without a zone all of a table have the same one, and only differences count.
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


def _place(column: str, names: list[str], width: int) -> int | None:
    """Position of a column by its number, from 1 to ``width``, or by its name, with or without its unit."""
    numbers = [str(number + 1) for number in range(width)]
    if column in numbers:
        return numbers.index(column)
    for known in (names, [_NAME.fullmatch(name)[1] for name in names]):  # type: ignore[index]
        folded = [name.casefold() for name in known]
        if folded.count(column.casefold()) == 1:
            return folded.index(column.casefold())
    return None


def _unit(key: str, path: Path, name: str) -> str:
    """The unit behind the name of a column; empty where there is none."""
    unit = str(_NAME.fullmatch(name)[2] or "")  # type: ignore[index]
    if unit in ("-", "1") or unit.isdecimal():  # pseudo time; one of the entries of a vector
        return ""
    if unit and unit not in _UNITS:
        raise InvalidInputError(key, name, f"one of the units {', '.join(_UNITS)}", f"see the header of {path.name}")
    return unit

"""Stops of the robot with the gripper's marker in sight: which place each picture was taken at, and what it shows."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stripfold.arrays import Array
from stripfold.errors import CalibrationError, InvalidInputError
from stripfold.vision import markers, pictures

HEADER = ("image", "x", "z")
FEWEST, MOST = 6, 100
"""Stops: a similarity has four unknowns, and its residuals must tell a mistake."""
LARGEST = 100_000
"""Bytes of the table."""


class Stop(NamedTuple):
    """One stop of the robot.

    Attributes
    ----------
    name
        The picture's name in the table.
    corners
        Shape (4, 2): the marker's corners, pixels.
    place
        Shape (2,): x and z of the marker's centre, as the robot reports it, m.
    """

    name: str
    corners: Array
    place: Array


def read(path: Path) -> list[tuple[str, Array]]:
    """The pictures' names in a table ``image,x,z`` and the places, shape (2,), m, that the robot reports.

    Raises
    ------
    InvalidInputError
        No such table, another header, not numbers, a picture twice, or too many rows.
    """
    allowed = (
        f"a CSV file with the header {','.join(HEADER)} and {FEWEST} to {MOST} rows: a picture, and two numbers in m"
    )
    try:
        with path.open(encoding="utf-8", newline="") as file:
            text = file.read(LARGEST + 1)
        rows = [row for row in csv.reader(text.splitlines()) if row]
        found = tuple(name.strip() for name in rows[0]) if rows else ()
        if len(text) > LARGEST or found != HEADER:
            raise ValueError(f"its first row is {','.join(found)[:80]!r}")
        stops = [(name.strip(), np.array([float(x), float(z)])) for name, x, z in rows[1:]]
    except (OSError, ValueError, csv.Error) as error:
        raise InvalidInputError("robot grid", str(path), allowed, " ".join(str(error).split())) from error
    for name, place in stops:
        if not np.all(np.isfinite(place)):
            raise InvalidInputError("robot grid", str(path), allowed, f"a number of {name} is not finite")
    names = [name for name, _ in stops]
    if len(set(names)) < len(names):
        raise InvalidInputError("robot grid", str(path), allowed, "a picture is there twice")
    if len(stops) > MOST:
        raise InvalidInputError("robot grid", str(path), allowed, f"it has {len(stops)} rows")
    return stops


def stops_in(path: Path, dictionary: str, identity: int, size: tuple[int, int]) -> list[Stop]:
    """The stops of a table and the markers in their pictures, whose names are relative to the table's folder.

    Parameters
    ----------
    path
        The table.
    dictionary, identity
        The marker.
    size
        Width and height that the pictures must have.

    Raises
    ------
    InvalidInputError
        The table or a picture cannot be read.
    CalibrationError
        A picture of another size, or without the marker.
    """
    stops: list[Stop] = []
    for name, place in read(path):
        image = pictures.of_size(path.parent / name, size)
        marker = markers.find(image, dictionary, identity)
        if marker is None:
            raise CalibrationError(
                name,
                f"no marker {identity} of {dictionary}",
                "the gripper's marker in every picture of the robot grid",
                "take the picture anew, sharp and without glare, or take its row out of the table",
            )
        stops.append(Stop(name, marker.corners, place))
    return stops

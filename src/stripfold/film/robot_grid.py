"""The robot grid: pictures of the gripper's marker at known places, and the fit of the folding plane to the robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stripfold.base.arrays import Array
from stripfold.base.errors import CalibrationError, InvalidInputError
from stripfold.files.tables import read_table
from stripfold.film.camera import Camera
from stripfold.film.intrinsics import OUTLIER, require
from stripfold.film.mapping import fit_similarity, rms, scale, transform
from stripfold.film.marker import Marker
from stripfold.film.pictures import read_calibration_picture
from stripfold.film.recording import inside
from stripfold.film.template import Template
from stripfold.film.thumbnails import Thumbnails

MIN_STOPS, MAX_STOPS = 6, 100
"""Stops of the robot: a similarity has four unknowns, and its residuals must reveal a mistake."""
MAX_STOP_ERROR = 0.002
"""Distance, m, of a stop from where the other stops predict it."""
MAX_AWAY = 10.0
"""Largest distance of a stop from the middle of all, relative to the usual distance."""
MIN_SPREAD = 0.1
"""Extent of the stops across their principal direction over that along it."""


class Stops(NamedTuple):
    """The robot's stops.

    ``names`` are the pictures' file names, ``corners``, shape (n, 4, 2), the marker's corners in pixels, ``places``,
    shape (n, 2), x and z of the marker's centre in m as the robot reports them, and ``small``, shape (n, h, w), small
    copies of the pictures.
    """

    names: Sequence[str]
    corners: Array
    places: Array
    small: NDArray[np.uint8]

    def centres(self, camera: Camera, plane: Array) -> Array:
        """Shape (n, 2): the marker's centres in the folding plane, m, by the homography ``plane``."""
        corners = camera.undistort(self.corners.reshape(-1, 2))
        return np.asarray(transform(plane, corners).reshape(-1, 4, 2).mean(axis=1))


def find_stops(folder: Path, table: str, marker: Marker | Template, size: tuple[int, int]) -> Stops:
    """The stops in a table ``image,x,z`` and the markers in their pictures, whose paths are relative to the table.

    ``table`` is relative to the ``folder`` of the recording, which holds the pictures, too;
    ``size`` is the width and height that the pictures must have.

    Raises InvalidInputError: the table or a picture cannot be read, a picture is listed twice or lies outside the
    folder; CalibrationError: a picture of another size, or without the marker.
    """
    path = folder / table
    listed = read_table("robot grid", path, "image,x,z", (0, MAX_STOPS))
    places = listed.numbers(slice(1, None))
    names = [row[0].strip() for _, row in listed.rows]
    if len(set(names)) < len(names):
        raise InvalidInputError("robot grid", str(path), "a table in which each picture has one row")
    found, copies, small = [], [], Thumbnails(size).small
    for name in names:
        picture = inside(folder, Path(table).parent / name, "robot grid")
        seen = read_calibration_picture(picture, size)
        corners = marker.corners(seen)
        if corners is None:
            raise CalibrationError(
                name,
                f"{marker.name} was not found",
                "the gripper's marker, or its template, in every picture of the robot grid",
                "take the picture again, in focus and without glare, or remove its row from the table",
            )
        found.append(corners)
        copies.append(small(seen))
    return Stops(names, np.array(found).reshape(-1, 4, 2), places, np.array(copies))


def fit_robot(centres: Array, stops: Stops) -> tuple[Array, float]:
    """The similarity, shape (3, 3), from the markers' centres in the folding plane, shape (n, 2), m, to the robot.

    Returns
    -------
    The similarity, and the RMS distance, m, of each stop from where the others predict it.

    Raises
    ------
    CalibrationError
        A stop far away, stops on a line, an outlier, or stops that no similarity fits.
    """
    places, n = stops.places, len(stops.places)
    away = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    far = int(np.argmax(away))
    require(
        away[far] <= MAX_AWAY * np.median(away),
        stops.names[far],
        "a stop at x = {:g} and z = {:g} m, far from all others".format(*places[far]),
        f"at most {MAX_AWAY:g} times as far from their middle as the others",
        "is a decimal point missing in its row?",
    )
    for points in (places, centres):
        along, across = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        require(across > MIN_SPREAD * along, "robot grid", "stops on a line", "stops spread over x and z")
    whole = fit_similarity(centres, places)
    left_out = np.empty_like(places)
    for i in range(n):
        others = np.arange(n) != i
        left_out[i] = transform(fit_similarity(centres[others], places[others]), centres[[i]])[0] - places[i]
    # In the plane's metres: a table in millimetres is recognised by its scale, not by its residuals.
    left_out /= scale(whole)
    errors = np.linalg.norm(left_out, axis=1)
    worst = int(np.argmax(errors))
    require(
        errors[worst] <= MAX_STOP_ERROR,
        stops.names[worst] if errors[worst] > OUTLIER * np.median(errors) else "robot grid",
        f"a stop {errors[worst] * 1e3:.1f} mm from where the others predict it",
        f"{MAX_STOP_ERROR * 1e3:g} mm or less",
        "is each row right and its picture's, does the marker move in the folding plane, did the camera stay in place?",
    )
    return whole, rms(left_out)

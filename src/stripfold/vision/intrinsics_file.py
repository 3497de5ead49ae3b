"""A camera from a file of intrinsics, as OpenCV's calibration programs write it."""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.vision.camera import Camera

LARGEST = 200_000
"""Bytes: a file with the corners of a hundred views is smaller."""
MOST_PIXELS = 100_000
"""Of a picture's width or height."""
ALLOWED = (
    "a YAML file as OpenCV writes it with image_width, image_height, camera_matrix (3 x 3, without skew) and "
    "distortion_coefficients (k1, k2, p1, p2 and, or not, k3)"
)


class _Loader(yaml.SafeLoader):
    """Reads OpenCV's matrices as mappings."""


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    return loader.construct_mapping(node, deep=True)


for _tag in ("opencv-matrix", "opencv-nd-matrix"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _mapping)


def read(path: Path) -> Camera:
    """The camera of a file.

    Raises
    ------
    InvalidInputError
        No such file, too large, not in OpenCV's format, or numbers that no camera has.
    """
    table = table_of(path)
    try:
        size = (_pixels(table["image_width"]), _pixels(table["image_height"]))
        matrix = _matrix(table["camera_matrix"])
        distortion = _matrix(table["distortion_coefficients"]).ravel()
        _check(matrix, distortion, size)
    except (KeyError, TypeError, ValueError) as error:
        reason = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
        raise InvalidInputError("intrinsics", str(path), ALLOWED, reason) from error
    return Camera(matrix, np.concatenate([distortion[:5], np.zeros(max(0, 5 - len(distortion)))]), size)


def table_of(path: Path) -> dict[str, Any]:
    """What an OpenCV YAML file holds; matrices are mappings with rows, cols and data.

    OpenCV's own reader is not used: deeply nested files make it end the whole program.

    Raises
    ------
    InvalidInputError
        No such file, too large, or not YAML.
    """
    if not path.is_file():
        raise InvalidInputError("intrinsics", str(path), "an existing file")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise ValueError(f"it has more than {LARGEST:,} bytes")
        text = content.decode("utf-8")
        # OpenCV begins its files with a line that YAML itself does not allow.
        found = yaml.load(text.partition("\n")[2] if text.startswith("%YAML:") else text, _Loader)
        if not isinstance(found, dict):
            raise ValueError("it holds no mapping")
    except (OSError, ValueError, yaml.YAMLError, RecursionError, OverflowError, TypeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InvalidInputError("intrinsics", str(path), ALLOWED, f"reading it says: {reason}") from error
    return found


def _pixels(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MOST_PIXELS:
        raise ValueError(f"a picture of {str(value)[:40]} pixels a side")
    return value


def _matrix(entry: Any) -> Array:
    if not isinstance(entry, dict):
        raise ValueError("a matrix has rows, cols and data")
    # OpenCV 5 writes arrays of one dimension with their sizes.
    shape = entry["sizes"] if "sizes" in entry else [entry["rows"], entry["cols"]]
    shape, data = [int(size) for size in shape], entry["data"]
    if not isinstance(data, list) or not 0 < prod(shape) == len(data) or min(shape) < 1:
        raise ValueError("a matrix has as many numbers as its rows and cols say")
    values = np.array([float(value) for value in data]).reshape(shape)
    if not np.all(np.isfinite(values)):
        raise ValueError("a number is not finite")
    return values


def _check(matrix: Array, distortion: Array, size: tuple[int, int]) -> None:
    if matrix.shape != (3, 3) or np.any(matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]] != [0.0, 0.0, 0.0, 0.0, 1.0]):
        raise ValueError("camera_matrix is not one of a camera without skew")
    if not (matrix[0, 0] > 0.0 and matrix[1, 1] > 0.0):
        raise ValueError("a focal length is not positive")
    if not (0.0 <= matrix[0, 2] <= size[0] and 0.0 <= matrix[1, 2] <= size[1]):
        raise ValueError("the principal point is outside the picture")
    if len(distortion) < 4 or np.any(distortion[5:] != 0.0):
        raise ValueError(f"distortion_coefficients has {len(distortion)} numbers, and only 4 or 5 are used")

"""Pictures from files.  What a file claims to hold is checked before anything is decoded."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError

from stripfold.arrays import Picture
from stripfold.errors import InvalidInputError

MAX_PIXELS = 50_000_000
"""Largest picture that is decoded, pixels."""
SIDES = (32, 32_000)
"""Shortest and longest side, pixels: OpenCV's own limit above."""
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "WEBP")
ALLOWED = (
    f"a whole picture ({', '.join(FORMATS)}) of at most {MAX_PIXELS // 1_000_000} million pixels,"
    f" each side {SIDES[0]} to {SIDES[1]} long"
)


def read_grey(path: str | os.PathLike[str], upright: bool = True) -> Picture:
    """The grey values of a picture, shape (height, width).

    It is turned as its file asks for, a telephone's pictures are, unless it is not to be ``upright``: then it is as the
    sensor saw it, as the frames of a film are.

    Raises
    ------
    InvalidInputError
        No such file, no picture, a damaged one, or one that is too large.
    """
    return _read(path, "L", upright)


def read_colour(path: str | os.PathLike[str]) -> Picture:
    """A picture's colours, shape (height, width, 3), red first.

    Raises
    ------
    InvalidInputError
        The same.
    """
    return _read(path, "RGB", True)


def _read(path: str | os.PathLike[str], mode: str, upright: bool) -> Picture:
    if not Path(path).is_file():
        raise InvalidInputError("image", str(path), "an existing file")
    try:
        # Pillow warns of large pictures by itself; the limit here is the stricter one.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            opened = Image.open(path, formats=FORMATS)
        with opened as picture:
            width, height = picture.size
            sides = (min(width, height), max(width, height))
            if width * height > MAX_PIXELS or sides[0] < SIDES[0] or sides[1] > SIDES[1]:
                raise InvalidInputError("image", str(path), ALLOWED, f"it has {width} x {height}")
            picture.load()
            turned = ImageOps.exif_transpose(picture) if upright else picture
            return np.ascontiguousarray(_eight_bit(turned).convert(mode))
    except Image.DecompressionBombError as error:
        raise InvalidInputError("image", str(path), ALLOWED, str(error)) from error
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise InvalidInputError("image", str(path), ALLOWED, f"reading it says: {error}") from error


def _eight_bit(picture: Any) -> Any:
    """A picture of 16 bits as one of 8: Pillow alone would clip it."""
    if not picture.mode.startswith(("I", "F")):
        return picture
    values = np.asarray(picture, dtype=np.float64)
    if picture.mode == "F" or values.min() < 0 or values.max() > 65535:
        raise ValueError(f"grey values from {values.min():g} to {values.max():g}")
    return Image.fromarray((values / 257.0).round().astype(np.uint8))

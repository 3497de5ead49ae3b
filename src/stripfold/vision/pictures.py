"""Pictures from files: whole, of a size that fits into memory, or one clear error."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ..errors import CalibrationError, InvalidInputError

Picture = NDArray[np.uint8]
"""Grey values, shape (height, width)."""

FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "WEBP")
SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
LARGEST = 50_000_000
"""Pixels that a picture may have."""
MODES = ("1", "L", "LA", "P", "RGB", "RGBA", "CMYK", "YCbCr")
"""Pillow's names of the kinds of pixels with 8 bits a channel: others lose what they hold when they become grey."""
ADVICE = "is it a picture, and whole?"


def read(path: Path) -> Picture:
    """The picture in a file, grey, as its sensor saw it: a note in the file to turn it is not followed.

    The file's first bytes tell its size: a picture that is too large is never decoded.

    Raises
    ------
    InvalidInputError
        No such file, not a picture, damaged, too large, or with more than 8 bits a channel.
    """
    allowed = f"a picture ({', '.join(FORMATS)}) with 8 bits a channel and at most {LARGEST:,} pixels"
    if not path.is_file():
        raise InvalidInputError("picture", str(path), "an existing file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what Pillow warns of is looked at below
            with Image.open(path, formats=FORMATS) as image:
                width, height = image.size
                if width * height <= LARGEST and image.mode in MODES:
                    return np.asarray(image.convert("L"), dtype=np.uint8)
                found = f"it has {width} x {height} pixels of kind {image.mode}"
    # A damaged file can make a decoder raise anything.
    except Exception as error:
        raise InvalidInputError("picture", str(path), allowed, f"{ADVICE} Reading it says: {error}") from error
    raise InvalidInputError("picture", str(path), allowed, found)


def of_size(path: Path, size: tuple[int, int]) -> Picture:
    """The picture in a file, of the camera's width and height.

    Raises
    ------
    InvalidInputError
        As :func:`read`.
    CalibrationError
        A picture of another size.
    """
    image = read(path)
    if image.shape != (size[1], size[0]):
        raise CalibrationError(
            path.name,
            f"{image.shape[1]} x {image.shape[0]} pixels",
            f"{size[0]} x {size[1]} pixels, as the camera was calibrated with",
            "take all pictures with the camera and the settings of the film",
        )
    return image


def listed(folder: Path, most: int) -> list[Path]:
    """The pictures of a folder, in the order of their names; other files are left out.

    Raises
    ------
    InvalidInputError
        No such folder, no pictures in it, or more than ``most``.
    """
    if not folder.is_dir():
        raise InvalidInputError("folder", str(folder), "an existing folder of pictures")
    found = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not 1 <= len(found) <= most:
        raise InvalidInputError("folder", str(folder), f"a folder with 1 to {most} pictures", f"it has {len(found)}")
    return found

"""Reading picture files.  The size that a file declares is checked before anything is decoded."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from PIL import Image, ImageOps
from PIL.ExifTags import IFD, Base

from stripfold.base.arrays import Picture
from stripfold.base.errors import CalibrationError, InvalidInputError

MAX_PIXELS = 50_000_000
SIDES = (32, 32_000)
"""Shortest and longest side, pixels; OpenCV cannot remap larger ones."""
FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "WEBP")
FILM = 36.0
"""Longer side of the film for which EXIF data give a focal length, mm."""
MAX_SCANS = 100
"""Scans of a progressive JPEG: cameras and programs write about ten, and each costs a pass over all pixels."""
SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
ALLOWED = (
    f"a complete picture ({', '.join(FORMATS)}) of at most {MAX_PIXELS // 1_000_000} million pixels,"
    f" each side {SIDES[0]} to {SIDES[1]} long"
)


def read_grey(path: str | os.PathLike[str], turns: int | None = None) -> Picture:
    """Read the grey values of a picture, shape (h, w), rotated as its EXIF data say.

    ``turns``: quarter turns to the left instead, from the sensor's rows, of a picture whose EXIF data name a camera or
    an orientation; another, such as a frame of a film, is as it is shown.

    Raises InvalidInputError: no such file, not a picture, a damaged one, or one that is too large.
    """
    if not Path(path).is_file():
        raise InvalidInputError("image", str(path), "an existing file")
    try:
        # Pillow warns of metadata that it cannot read, and of large pictures; the limit here is stricter.
        with warnings.catch_warnings(action="ignore"), Image.open(path, formats=FORMATS) as picture:
            width, height = picture.size
            if width * height > MAX_PIXELS or min(width, height) < SIDES[0] or max(width, height) > SIDES[1]:
                raise InvalidInputError("image", str(path), ALLOWED, f"it has {width} x {height}")
            if picture.format == "JPEG" and (scans := Path(path).read_bytes().count(b"\xff\xda")) > MAX_SCANS:
                raise InvalidInputError("image", str(path), ALLOWED, f"it has {scans} scans")
            with _quiet():
                picture.load()
            by_camera = turns is not None and not {Base.Make, Base.Orientation}.isdisjoint(picture.getexif())
            shown = np.asarray(_eight_bit(picture if by_camera else ImageOps.exif_transpose(picture)).convert("L"))
            return np.ascontiguousarray(np.rot90(shown, turns or 0) if by_camera else shown)
    except InvalidInputError:
        raise
    except (Image.DecompressionBombError, OSError, SyntaxError, ValueError) as error:
        raise InvalidInputError("image", str(path), ALLOWED, f"reading it failed: {error}") from error
    except MemoryError as error:
        # A damaged file declares parts of any length, which are read at once.
        raise InvalidInputError("image", str(path), ALLOWED, "a part of it declares more than the memory") from error


def focal_of(path: str | os.PathLike[str]) -> float | None:
    """Read a camera's focal length over the longer side of its picture from the EXIF data; None: it does not say."""
    try:
        with Image.open(path, formats=FORMATS) as picture:
            length = picture.getexif().get_ifd(IFD.Exif).get(Base.FocalLengthIn35mmFilm)
    except (OSError, SyntaxError, ValueError):
        return None
    return float(length) / FILM if length else None


@contextmanager
def _quiet() -> Iterator[None]:
    """What libtiff prints of a damaged file by itself is dropped; its error is raised."""
    known, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        yield
    finally:
        os.dup2(known, 2)
        os.close(known)
        os.close(nothing)


def _eight_bit(picture: Image.Image) -> Image.Image:
    """Scale 16 bits to 8: Pillow would clip them."""
    if not picture.mode.startswith(("I", "F")):
        return picture
    values = np.asarray(picture, dtype=np.float64)
    if picture.mode == "F" or values.min() < 0 or values.max() > 65535:
        raise ValueError(f"grey values from {values.min():g} to {values.max():g}")
    return Image.fromarray((values / 257.0).round().astype(np.uint8))


class Shown(NamedTuple):
    """How a film is shown: width and height, pixels, and quarter turns to the left from the sensor's rows."""

    size: tuple[int, int]
    turns: int


def read_calibration_picture(path: Path, size: tuple[int, int] | None = None, shown: Shown | None = None) -> Picture:
    """Read a picture as the camera films, by default its sensor's rows.

    ``shown``: how the film is shown.  Raises CalibrationError: another width and height than ``size``.
    """
    picture = read_grey(path, shown.turns if shown else 0)
    if shown and shown.turns % 2 and picture.shape == shown.size:
        picture = read_grey(path)  # a program has turned its rows already
    if size is not None and picture.shape != (size[1], size[0]):
        raise CalibrationError(
            path.name,
            f"{picture.shape[1]} x {picture.shape[0]} pixels",
            f"{size[0]} x {size[1]} pixels, as the camera was calibrated with",
            "take all pictures with the camera and the settings of the video",
        )
    return picture


def picture_files(folder: Path, most: int) -> list[Path]:
    """The pictures in a folder, sorted by name; InvalidInputError: no such folder, none, or more than ``most``."""
    if not folder.is_dir():
        raise InvalidInputError("folder", str(folder), "an existing folder of pictures")
    found = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not 1 <= len(found) <= most:
        raise InvalidInputError("folder", str(folder), f"a folder with 1 to {most} pictures", f"it has {len(found)}")
    return found


@contextmanager
def one_thread() -> Iterator[None]:
    """Run OpenCV on one thread within; also a decorator: several add up in an order that changes from run to run."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)

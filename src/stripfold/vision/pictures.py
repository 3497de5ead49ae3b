"""Pictures of a calibration: as the film's camera saw them, all of its size."""

from __future__ import annotations

from pathlib import Path

from stripfold.arrays import Picture
from stripfold.errors import CalibrationError, InvalidInputError
from stripfold.vision.picture import read_grey

SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")


def read(path: Path) -> Picture:
    """The picture in a file, grey, as its sensor saw it; raises as :func:`.picture.read_grey` does."""
    return read_grey(path, upright=False)


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

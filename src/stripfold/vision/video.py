"""Frames of a recording with their true times: decoded one after the other, in a process with limits."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.vision.decoder import Decoder, Image
from stripfold.vision.decoding import MOST_FRAMES
from stripfold.vision.tables import ascending, table

_BLACK: Any = 16
"""Black where the range of greys is limited: it goes to 235 then."""


@dataclass(frozen=True)
class VideoInfo:
    """What a header says, which need not be true.

    Attributes
    ----------
    container, codec
        As FFmpeg names them.
    size
        Width and height, pixels, before a turn that the file asks for.
    declared
        Number of frames; 0 where the header does not say.
    rate
        Frames per second, or None.
    time_base
        Unit of the time stamps, s, or None.
    duration
        Length, s, or None.
    """

    container: str
    codec: str
    size: tuple[int, int]
    declared: int
    rate: float | None
    time_base: Fraction | None
    duration: float | None


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame.

    Attributes
    ----------
    index
        Its number, from 0, in the order in which the frames are shown.
    time
        When it was taken, s, by the clock of the camera.
    image
        Shape (h, w): grey from 0, black, to 255, white; not to be written to.
    doubled
        Whether it is the frame before once more, pixel by pixel, with another time.
    damaged
        Whether a part of its data is missing, of its own or of a frame on which it builds.
    """

    index: int
    time: float
    image: Image
    doubled: bool = False
    damaged: bool = False


@dataclass(frozen=True)
class VideoReport:
    """What was met while reading, up to now.

    Attributes
    ----------
    declared, decoded
        Number of frames by the header (0: not said) and in truth.
    doubled, damaged, interlaced
        How many frames were.
    errors
        Packets that did not decode.
    """

    declared: int
    decoded: int = 0
    doubled: int = 0
    damaged: int = 0
    interlaced: int = 0
    errors: int = 0

    @property
    def header_lied(self) -> bool:
        """Whether another number of frames was found than the header declares; of a video that was read to its end."""
        return self.declared not in (0, self.decoded)

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words, for a video that was read to its end."""
        found = {
            f"the header declares {self.declared} frames, {self.decoded} decode": self.header_lied,
            f"{self.errors} packets do not decode": self.errors > 0,
            f"{self.damaged} frames are damaged": self.damaged > 0,
            f"{self.doubled} frames repeat the one before": self.doubled > 0,
            f"{self.interlaced} frames are interlaced: their odd rows are of another time": self.interlaced > 0,
        }
        return tuple(text for text, holds in found.items() if holds)


def probe(path: str | os.PathLike[str]) -> VideoInfo:
    """What the header of a video, or the first frame in a folder, says.

    Raises
    ------
    InvalidInputError
        It cannot be read.
    """
    decoder = Decoder("probe", Path(path))
    try:
        return _info(decoder.told())
    finally:
        decoder.close()


def read(path: str | os.PathLike[str], timestamps: str | os.PathLike[str] | None = None) -> Reader:
    """The frames of a video, or of a folder, in the order of time; one at a time is in memory.

    Parameters
    ----------
    path
        The video, or the folder: there the names of the frames sort in time.
    timestamps
        CSV ``frame,t`` with a row for each frame: when it was taken, s.  It takes the place of the times in the
        video; with a folder it is needed.

    Raises
    ------
    InvalidInputError
        Here or while reading: it is no video, it has no times or they do not increase, the table does not have as many
        rows as there are frames, or it exceeds a limit of size, time or memory.
    """
    return Reader(Path(path), None if timestamps is None else Path(timestamps))


class Reader(Iterator[Frame]):
    """An iterator over frames; leaving its ``with`` block ends the decoder.

    Attributes
    ----------
    info
        What the header says.
    report
        What was met up to now.
    """

    def __init__(self, path: Path, timestamps: Path | None) -> None:
        self._path = path
        self._times = None if timestamps is None else read_timestamps(timestamps)
        self._last: Frame | None = None
        if path.is_dir() and timestamps is None:
            raise InvalidInputError(
                "timestamps", None, "a CSV file frame,t", f"{path.name} is a folder: its frames have no times"
            )
        self._decoder = Decoder("read", path)
        try:
            self.info = _info(self._decoder.told())
        except BaseException:
            self.close()
            raise
        self.report = VideoReport(self.info.declared)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the decoder."""
        self._decoder.close()

    def __next__(self) -> Frame:
        if self._decoder.closed:
            raise StopIteration
        try:
            told = self._decoder.told()
            if told["kind"] == "frame":
                self._last = self._frame(told)
                return self._last
            self._ended(told)
        except BaseException:
            self.close()
            raise
        self.close()
        raise StopIteration

    def _frame(self, told: dict[str, Any]) -> Frame:
        index, last = self.report.decoded, self._last
        image = _upright(self._decoder.picture(told), told, self._path)
        if last is not None and image.shape != last.image.shape:
            raise self._unusable(f"frames of one size, frame {index} has another than those before it", "")
        image.setflags(write=False)
        time = told["time"]
        if self._times is not None:
            if index >= len(self._times):
                raise self._rows(f"more than {index}")
            time = float(self._times[index])
        if time is None:
            raise self._unusable(f"a time for each frame, frame {index} has none", "give timestamps.csv")
        if last is not None and time <= last.time:
            raise self._unusable(
                f"times that increase, frame {index} is at {time:.6f} s after {last.time:.6f} s", "give timestamps.csv"
            )
        doubled = last is not None and np.array_equal(image, last.image)
        self.report = replace(
            self.report,
            decoded=index + 1,
            doubled=self.report.doubled + doubled,
            damaged=self.report.damaged + told["damaged"],
            interlaced=self.report.interlaced + told["interlaced"],
        )
        return Frame(index, time, image, doubled, told["damaged"])

    def _ended(self, told: dict[str, Any]) -> None:
        self.report = replace(self.report, errors=int(told["errors"]))
        decoded = self.report.decoded
        if not decoded:
            raise self._unusable("a video with pictures, none in it decodes", "save it again from its source")
        if self._times is not None and decoded < len(self._times):
            raise self._rows(str(decoded))

    def _unusable(self, allowed: str, advice: str) -> InvalidInputError:
        return InvalidInputError("video", str(self._path), allowed, advice)

    def _rows(self, frames: str) -> InvalidInputError:
        rows = 0 if self._times is None else len(self._times)
        return InvalidInputError(
            "timestamps", f"{rows} rows", f"one row per frame: {self._path.name} has {frames} frames"
        )


def read_timestamps(path: Path) -> Array:
    """Times of the frames, shape (n,), s, from a CSV ``frame,t`` whose frames count from 0.

    Raises
    ------
    InvalidInputError
        No such table, or frames or times out of order.
    """
    values = table("timestamps", path, "frame,t", (1, MOST_FRAMES))
    wrong = np.flatnonzero(values[:, 0] != np.arange(len(values)))
    if len(wrong):
        row = int(wrong[0])
        raise InvalidInputError(
            "frame", float(values[row, 0]), f"{row}: frames count from 0", f"row {row + 1} of {path.name}"
        )
    return ascending("t", values[:, 1], path)


def _info(told: dict[str, Any]) -> VideoInfo:
    base = told["time_base"]
    return VideoInfo(
        told["container"],
        told["codec"],
        (told["size"][0], told["size"][1]),
        told["declared"],
        told["rate"],
        Fraction(*base) if base else None,
        told["duration"],
    )


def _upright(image: Image, told: dict[str, Any], path: Path) -> Image:
    """The picture as it is shown: the range of its greys stretched to all, and turned as the file asks for."""
    if told["limited"]:
        image = np.asarray(cv2.convertScaleAbs(cv2.subtract(image, _BLACK), alpha=255.0 / 219.0), dtype=np.uint8)
    turn = told["turn"] % 360
    if turn % 90:
        raise InvalidInputError(
            "video", str(path), "pictures turned by a multiple of 90 degrees", f"it asks for {turn}"
        )
    return np.ascontiguousarray(np.rot90(image, turn // 90)) if turn else image

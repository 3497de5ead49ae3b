"""Frames of a recording with their true times, decoded one by one in a process with limits."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import weakref
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import cv2
import numpy as np

from stripfold.base.arrays import Array, Index, Mask, Picture
from stripfold.base.errors import InvalidInputError
from stripfold.files.tables import read_table
from stripfold.film import decoding
from stripfold.film.decoding import MAX_BYTES, MAX_FRAMES, MAX_SECONDS, SUFFIXES, Message, frame_files
from stripfold.film.pictures import Shown

TIMEOUT = 30.0
"""Longest time without a byte after which the decoder is ended, s."""
PIPE = 1 << 20
"""Bytes by which the decoder may be ahead."""
MAX_MISSING = 0.05
"""Share of a video's length that may be missing at its end; a recorder may count another stream, or the last frame."""
_ALLOWED = f"a video (mp4, avi, mkv, mov) or a folder of frames ({', '.join(SUFFIXES)})"
_DIFFERENCES = np.clip(128.0 + 3.0 * (np.arange(256) - 128.0), 0, 255).astype(np.uint8)
"""Colour differences magnified to the range of luma: few colours are pure."""
_DROPPED = 1.5
"""Interval over the usual one from which frames are missing."""
_UNEVEN, _MAX_UNEVEN = 0.25, 0.05
"""Deviation of an interval from a multiple of the usual one that is not jitter, and the share of such intervals from
which the rate is variable."""
SMALL_WIDTH, MAX_SMALL = 640, 450
"""Largest width of the small copies of frames, pixels, and most of them: of a longer film every second is kept."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame: its ``index`` in the order of presentation, its time by the camera, s, its read-only grey picture.

    ``doubled``: whether it repeats the frame before, pixel by pixel; ``damaged``: whether some of its data, or of a
    frame that it is predicted from, is missing.
    """

    index: int
    time: float
    image: Picture
    doubled: bool = False
    damaged: bool = False


@dataclass
class VideoReport:
    """Statistics of the reading: numbers of frames, and ``errors``: packets that could not be decoded.

    ``declared`` and ``duration``, s, are the header's, 0 where it does not say; ``predicted``: whether frames are
    compressed, with loss, by prediction from others; ``end``: time of the last, s; ``coloured``: whether the first is;
    ``turns``: quarter turns to the left by which the frames are shown, from the sensor's rows.
    """

    declared: int = 0
    duration: float = 0.0
    predicted: bool = False
    end: float = 0.0
    decoded: int = 0
    damaged: int = 0
    interlaced: int = 0
    coloured: bool = False
    errors: int = 0
    turns: int = 0

    @property
    def truncated(self) -> bool:
        """Whether the video ends well before its header says, once it was read to its end."""
        return self.end * (1.0 + 1.0 / max(self.decoded, 1)) < (1.0 - MAX_MISSING) * self.duration

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words, for a video that was read to its end."""
        found = {
            f"the header declares {self.declared} frames, {self.decoded} were decoded": (
                self.declared not in (0, self.decoded)
            ),
            f"{self.errors} packets could not be decoded": self.errors > 0,
            f"{self.damaged} frames are damaged": self.damaged > 0,
            f"{self.interlaced} frames are interlaced: their odd rows were taken at another time": self.interlaced > 0,
        }
        return tuple(text for text, holds in found.items() if holds)


def read(path: str | os.PathLike[str], timestamps: str | os.PathLike[str] | None = None, channel: int = 0) -> Reader:
    """Read the frames of a video, or of a folder whose names sort in time, one by one.

    ``timestamps``: CSV ``frame,t``, s, a row per frame, in place of the times in the video; required for a folder.
    ``channel``: index of :data:`.decoding.CHANNELS`.  Raises InvalidInputError, here or while reading: not a video, no
    times or times that do not increase, another number of rows, or a limit of size, time or memory exceeded.
    """
    return Reader(Path(path), None if timestamps is None else Path(timestamps), channel)


def shown(path: Path, timestamps: Path | None = None) -> Shown:
    """Read how a film is shown; arguments and errors as for :func:`read`."""
    with read(path, timestamps) as film:
        height, width = next(film).image.shape
        return Shown((width, height), film.report.turns)


class Reader(Iterator[Frame]):
    """An iterator over frames; leaving its ``with`` block ends the decoder.  ``report`` is updated with each frame."""

    def __init__(self, path: Path, timestamps: Path | None, channel: int) -> None:
        self._path, self._channel = path, channel
        self._times = None if timestamps is None else read_timestamps(timestamps)
        self._last: Frame | None = None
        self._check_source()
        if not sys.platform.startswith("linux"):
            raise InvalidInputError("video", str(path), "films on Linux only, whose limits the decoder needs")
        import fcntl

        # -P: a module in the user's working folder must not shadow a library.
        command = [sys.executable, "-P", "-m", decoding.__name__, str(channel), str(path.absolute())]
        none = subprocess.DEVNULL
        self._process = subprocess.Popen(command, bufsize=0, stdin=none, stdout=subprocess.PIPE, stderr=none)
        assert self._process.stdout is not None
        self._pipe: Any = self._process.stdout
        with suppress(OSError):  # what all processes of a user may have in pipes is limited
            fcntl.fcntl(self._pipe, fcntl.F_SETPIPE_SZ, PIPE)
        self._finalizer = weakref.finalize(self, _end, self._process)
        try:
            start, _ = self._receive()
            # A table of times has a row per frame, so with one the header's length does not matter.
            known = 0.0 if self._times is not None else start["duration"]
            self.report = VideoReport(start["declared"], known, start["predicted"])
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the decoder; it may be called again."""
        self._finalizer()

    def __next__(self) -> Frame:
        if not self._finalizer.alive:
            raise StopIteration
        try:
            message, picture = self._receive()
            if message["kind"] == "frame":
                self._last = self._frame(message, picture)
                return self._last
            self._finish(message)
        except BaseException:
            self.close()
            raise
        self.close()
        raise StopIteration

    def _check_source(self) -> None:
        try:
            self._path.stat()
            names = [path.name for path in frame_files(self._path)] if self._path.is_dir() else []
        except (OSError, ValueError) as error:
            raise self._refused(" ".join(str(error).split())) from error
        if not self._path.is_dir():
            if not self._path.is_file():
                raise self._refused("it is neither a file nor a folder")
            if self._path.stat().st_size == 0:
                raise self._refused("the file is empty")
            return
        if not names:
            raise self._refused("there is no frame in the folder")
        if len(names) > MAX_FRAMES:
            raise self._unusable(f"at most {MAX_FRAMES} frames", "cut it into shorter recordings")
        # frame2 sorts after frame10.
        other = next((name for name in names if len(Path(name).stem) != len(Path(names[0]).stem)), None)
        if other is not None:
            raise self._unusable(
                "frames with names of the same length, so that they sort in time",
                f"{names[0]} and {other} differ: pad the numbers with zeros",
            )
        if self._times is None:
            raise InvalidInputError("timestamps", None, "a CSV file frame,t", "frames in a folder have no times")

    def _receive(self) -> tuple[Message, Picture]:
        """The next message, and its picture's bytes."""
        size = int.from_bytes(self._bytes(4).tobytes(), "big")
        message: Message = json.loads(self._bytes(size, 10_000).tobytes())
        picture = self._bytes(message["bytes"])
        if message["kind"] == "refused":
            raise self._refused(message["reason"])
        return message, picture

    def _bytes(self, count: int, most: int = MAX_BYTES) -> Picture:
        if count > most:
            raise self._refused(f"the decoder announces {count} bytes")
        found = np.empty(count, np.uint8)
        rest = found.data
        while rest:
            if not select.select([self._pipe], [], [], TIMEOUT)[0]:
                raise self._refused(f"the decoder was silent for {TIMEOUT:g} s")
            read = self._pipe.readinto(rest)
            if not read:
                raise self._refused(self._crash())
            rest = rest[read:]
        return found

    def _crash(self) -> str:
        """Why the decoder ended before its end."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        code = self._process.returncode or 0
        if code == -signal.SIGXCPU:
            return f"decoding needs more than {MAX_SECONDS} s of CPU time"
        return f"the decoder crashed ({signal.Signals(-code).name if code < 0 else code})"

    def _frame(self, message: Message, picture: Picture) -> Frame:
        report, index, last = self.report, self.report.decoded, self._last
        image = self._upright(message, picture)
        if last is not None and image.shape != last.image.shape:
            raise self._unusable(f"frames of one size, frame {index} has another than those before it")
        time = message["time"]
        if self._times is not None:
            if index >= len(self._times):
                raise self._wrong_table(f"more than {index}")
            time = float(self._times[index])
        if time is None:
            raise self._unusable(f"a time for each frame, frame {index} has none", "give timestamps.csv")
        if last is not None and time <= last.time:
            raise self._unusable(
                f"times that increase, frame {index} is at {time:.6f} s after {last.time:.6f} s", "give timestamps.csv"
            )
        doubled = last is not None and all(np.array_equal(a, b) for a, b in zip(image, last.image, strict=True))
        report.decoded += 1
        report.coloured = report.coloured or message.get("coloured", False)
        report.end = time
        report.damaged += message["damaged"]
        report.interlaced += message["interlaced"]
        return Frame(index, time, image, doubled, message["damaged"])

    def _upright(self, message: Message, picture: Picture) -> Picture:
        """The picture with full range, rotated as the file asks for; read-only."""
        (width, height), stride = message["plane"], message["stride"]
        image = picture[: stride * height].reshape(height, stride)[:, :width]
        if self._channel:
            image = np.asarray(cv2.LUT(image, _DIFFERENCES), dtype=np.uint8)
        elif message["limited_range"]:
            image = full_range(image)
        if message["plane"] != message["size"]:
            image = np.asarray(cv2.resize(image, message["size"], interpolation=cv2.INTER_LINEAR), np.uint8)
        rotation = message["rotation"] % 360
        if rotation % 90:
            raise self._unusable("pictures rotated by a multiple of 90 degrees", f"it asks for {rotation}")
        self.report.turns = rotation // 90
        image = np.ascontiguousarray(np.rot90(image, self.report.turns))
        image.setflags(write=False)
        return image

    def _finish(self, message: Message) -> None:
        self.report.errors = int(message["errors"])
        decoded = self.report.decoded
        if not decoded:
            raise self._unusable("a video with frames, none in it could be decoded", "export it again from its source")
        if self._times is not None and decoded < len(self._times):
            raise self._wrong_table(str(decoded))

    def _refused(self, reason: str) -> InvalidInputError:
        return self._unusable(_ALLOWED, reason)

    def _unusable(self, allowed: str, advice: str = "") -> InvalidInputError:
        return InvalidInputError("video", str(self._path), allowed, advice)

    def _wrong_table(self, frames: str) -> InvalidInputError:
        rows = 0 if self._times is None else len(self._times)
        allowed = f"one row per frame: {self._path.name} has {frames} frames"
        return InvalidInputError("timestamps", f"{rows} rows", allowed)


def full_range(picture: Picture) -> Picture:
    """Stretch video levels, black at 16 and white at 235, to 0 and 255, limited and rounded."""
    # A table, whose accesses are one by one, takes twice as long.
    return np.asarray(cv2.addWeighted(picture, 255.0 / 219.0, picture, 0.0, -16.0 * 255.0 / 219.0), dtype=np.uint8)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


def read_timestamps(path: Path) -> Array:
    """Read the times of the frames, shape (n,), s, from a CSV file ``frame,t``; InvalidInputError: no such table."""
    table = read_table("timestamps", path, "frame,t", (1, MAX_FRAMES))
    frames, times = table.numbers().T
    wrong = np.flatnonzero(frames != np.arange(len(frames)))
    if len(wrong):
        row = int(wrong[0])
        allowed = f"{row}: frames count from 0"
        raise InvalidInputError("frame", float(frames[row]), allowed, table.place(row))
    table.check_increasing(times)
    return times


@dataclass(frozen=True, eq=False)
class Timing:
    """The times of a video's frames, shape (n,), s, and which repeat the one before (``doubled``).

    ``period``: the usual interval, s; ``dropped``: indices of the frames before which some are missing; ``variable``:
    whether the rate varies, so that a gap does not imply missing frames.
    """

    time: Array
    doubled: Mask
    period: float
    dropped: Index
    variable: bool

    @classmethod
    def of(cls, time: Array, doubled: Mask) -> Self:
        """Find period, dropped frames and regularity from the times of two frames or more."""
        intervals = np.diff(time)
        period = float(np.median(intervals))
        ratio = intervals / period
        uneven = np.abs(ratio - np.maximum(np.rint(ratio), 1.0)) > _UNEVEN
        dropped = np.flatnonzero(intervals > _DROPPED * period) + 1
        return cls(time, doubled, period, dropped, float(uneven.mean()) > _MAX_UNEVEN)

    @property
    def problems(self) -> tuple[str, ...]:
        """Each in words."""
        repeated = int(self.doubled.sum())
        found = {
            f"{repeated} frames repeat the one before": repeated > 0,
            f"frames are missing in {len(self.dropped)} places": len(self.dropped) > 0,
            "the frame rate varies": self.variable,
        }
        return tuple(text for text, holds in found.items() if holds)


class Thumbnails:
    """Small copies of every :attr:`every`-th frame of a film, for its report, the sides divided by :attr:`whole`."""

    def __init__(self, size: tuple[int, int]) -> None:
        # By a whole number: any other takes ten times as long to average over.
        self.whole = -(-size[0] // SMALL_WIDTH)
        self.size = size[0] // self.whole, size[1] // self.whole
        self.every = 1
        self.pictures: list[Picture] = []

    def add(self, frame: Frame) -> None:
        """Keep the next frame, if it is one of those to keep."""
        if frame.index % self.every:
            return
        if len(self.pictures) == MAX_SMALL:
            self.pictures, self.every = self.pictures[::2], 2 * self.every
            if frame.index % self.every:
                return
        self.pictures.append(self.small(frame.image))

    def small(self, picture: Picture) -> Picture:
        """Make a small copy of a picture of the film's size."""
        return np.asarray(cv2.resize(picture, self.size, interpolation=cv2.INTER_AREA), dtype=np.uint8)

"""Frames of a recording with their true times, decoded one by one in a process with limits."""

from __future__ import annotations

import json
import mmap
import multiprocessing
import os
import signal
import subprocess
import sys
import weakref
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np

from stripfold.base.arrays import Array, Picture
from stripfold.base.errors import InvalidInputError
from stripfold.files.tables import read_table
from stripfold.film import decoding
from stripfold.film.decoding import MAX_FRAMES, MAX_SECONDS, MEMORY, SUFFIXES, Message, frame_files
from stripfold.film.frames import Frame, VideoReport

_COPIED = b"copied"
TIMEOUT = 30.0
"""Longest time without a message after which the decoder is ended, s."""
_ALLOWED = f"a video (mp4, avi, mkv, mov) or a folder of frames ({', '.join(SUFFIXES)})"
_DIFFERENCES = np.clip(128.0 + 3.0 * (np.arange(256) - 128.0), 0, 255).astype(np.uint8)
"""Colour differences magnified to the range of luma: few colours are pure."""


def read(path: str | os.PathLike[str], timestamps: str | os.PathLike[str] | None = None, channel: int = 0) -> Reader:
    """The frames of a video, or of a folder, in temporal order; one at a time is in memory.

    ``path``: the video, or a folder of frames whose names sort in time.  ``timestamps``: CSV ``frame,t`` with one row
    per frame: when it was taken, s.  Replaces the times in the video; required for a folder.  ``channel``: index of
    :data:`.decoding.CHANNELS`: what the pictures show.  Raises InvalidInputError: here or while reading: not a video,
    no times or times that do not increase, a table without one row per frame, or a limit of size, time or memory
    exceeded.
    """
    return Reader(Path(path), None if timestamps is None else Path(timestamps), channel)


class Reader(Iterator[Frame]):
    """An iterator over frames; leaving its ``with`` block ends the decoder.  ``report`` is updated with each frame."""

    def __init__(self, path: Path, timestamps: Path | None, channel: int) -> None:
        self._path, self._channel = path, channel
        self._times = None if timestamps is None else read_timestamps(timestamps)
        self._last: Frame | None = None
        self._received: list[Message] = []
        self._check_source()
        if not hasattr(os, "memfd_create"):
            raise InvalidInputError("video", str(path), "films on Linux only, whose sealed memory the decoder needs")
        import fcntl

        connection, theirs = multiprocessing.Pipe()
        memory = os.memfd_create("stripfold", os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(memory, MEMORY)
            # Whatever happens in the decoder, the memory does not end before what is read here.
            fcntl.fcntl(memory, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW)
            self._memory = np.frombuffer(mmap.mmap(memory, MEMORY, prot=mmap.PROT_READ), np.uint8)
            descriptors = [theirs.fileno(), memory]
            # -P: a module in the user's working folder must not shadow a library.
            self._process = subprocess.Popen(
                [
                    sys.executable,
                    "-P",
                    "-m",
                    decoding.__name__,
                    *map(str, descriptors),
                    str(channel),
                    str(path.absolute()),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=descriptors,
            )
        finally:
            os.close(memory)
        theirs.close()
        self._connection = connection
        self._finalizer = weakref.finalize(self, _end, self._process, connection)
        try:
            start = self._receive()
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
            message = self._receive()
            if message["kind"] == "frame":
                self._last = self._frame(message)
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

    def _receive(self) -> Message:
        """The next message."""
        if not self._received:
            self._received = self._batch()
        message = self._received.pop(0)
        if message["kind"] == "refused":
            raise self._refused(message["reason"])
        return message

    def _batch(self) -> list[Message]:
        if not self._connection.poll(TIMEOUT):
            raise self._refused(f"the decoder was silent for {TIMEOUT:g} s")
        try:
            batch: list[Message] = json.loads(self._connection.recv_bytes(10_000))
        except (EOFError, OSError) as error:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(1.0)
            code = self._process.returncode or 0
            if code == -signal.SIGXCPU:
                raise self._refused(f"decoding needs more than {MAX_SECONDS} s of CPU time") from error
            reason = signal.Signals(-code).name if code < 0 else code
            raise self._refused(f"the decoder crashed ({reason})") from error
        return batch

    def _frame(self, message: Message) -> Frame:
        report, index, last = self.report, self.report.decoded, self._last
        image = self._upright(message)
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

    def _upright(self, message: Message) -> Picture:
        """The picture with full range, rotated as the file asks for; read-only."""
        (width, height), stride = message["plane"], message["stride"]
        shared = self._memory[message["start"] :][: stride * height].reshape(height, stride)[:, :width]
        if self._channel:
            image = np.asarray(cv2.LUT(shared, _DIFFERENCES), dtype=np.uint8)
        else:
            image = full_range(shared) if message["limited_range"] else shared.copy()
        if not self._received:
            with suppress(OSError):  # at the end the decoder does not wait for it
                self._connection.send_bytes(_COPIED)
        if message["plane"] != message["size"]:
            image = cv2.resize(image, message["size"], interpolation=cv2.INTER_LINEAR)
        rotation = message["rotation"] % 360
        if rotation % 90:
            raise self._unusable("pictures rotated by a multiple of 90 degrees", f"it asks for {rotation}")
        image = np.ascontiguousarray(np.rot90(image, rotation // 90))
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
    """From video levels, black at 16 and white at 235, to 0 and 255, limited and rounded."""
    # A table, whose accesses are one by one, takes twice as long.
    return np.asarray(cv2.convertScaleAbs(cv2.subtract(picture, 16), alpha=255.0 / 219.0), dtype=np.uint8)


def _end(process: subprocess.Popen[bytes], connection: Connection) -> None:
    process.kill()
    process.wait()
    connection.close()


def read_timestamps(path: Path) -> Array:
    """Times of the frames, shape (n,), s, from a CSV file ``frame,t`` whose frames count from 0.

    Raises InvalidInputError: not such a table, or frames or times out of order.
    """
    table = read_table("timestamps", path, "frame,t", (1, MAX_FRAMES))
    frames, times = table.numbers().T
    wrong = np.flatnonzero(frames != np.arange(len(frames)))
    if len(wrong):
        row = int(wrong[0])
        allowed = f"{row}: frames count from 0"
        raise InvalidInputError("frame", float(frames[row]), allowed, table.place(row))
    table.check_increasing(times)
    return times

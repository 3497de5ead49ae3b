"""The decoder as the reader of a video sees it: a process to start, to listen to, and to end."""

from __future__ import annotations

import fcntl
import json
import os
import select
import signal
import stat
import subprocess
import sys
import weakref
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stripfold.errors import InvalidInputError
from stripfold.vision.decoding import MOST_FRAMES, MOST_SECONDS, PICTURES, frame_files

PATIENCE = 30.0
"""How long the decoder may be silent before it is ended, s."""
_MOST_TEXT = 10_000
_PIPE = 1 << 20
"""Bytes in the pipe from the decoder, which is most of a frame: fewer changes from one process to the other."""
_ALLOWED = f"a video (mp4, avi, mkv, mov) or a folder of frames ({', '.join(PICTURES)})"

Image = NDArray[np.uint8]


@dataclass(eq=False)
class Decoder:
    """The process of :mod:`stripfold.vision.decoding`, and what it says.

    Attributes
    ----------
    mode
        "probe" for the header only, "read" for the frames too.
    path
        A video or a folder of frames.
    """

    mode: str
    path: Path
    _process: subprocess.Popen[bytes] = field(init=False)
    _end: weakref.finalize[Any, Any] = field(init=False)

    def __post_init__(self) -> None:
        try:
            mode = os.stat(self.path)
            frames = frame_files(self.path) if stat.S_ISDIR(mode.st_mode) else None
        except (OSError, ValueError) as error:
            raise self.refused(" ".join(str(error).split())) from error
        if frames is None and not stat.S_ISREG(mode.st_mode):
            raise self.refused("it is neither a file nor a folder")
        if frames is None and mode.st_size == 0:
            raise self.refused("the file is empty")
        if frames is not None:
            _check_names(frames, self.path)
        # -P: a module of the user's working folder must not take the place of a library's.
        command = [sys.executable, "-P", "-m", "stripfold.vision.decoding", self.mode, str(self.path.absolute())]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0
        )
        self._end = weakref.finalize(self, _stop, self._process)
        if hasattr(fcntl, "F_SETPIPE_SZ"):
            fcntl.fcntl(self._output, fcntl.F_SETPIPE_SZ, _PIPE)

    @property
    def closed(self) -> bool:
        """Whether it has been ended."""
        return not self._end.alive

    @property
    def _output(self) -> int:
        assert self._process.stdout is not None
        return self._process.stdout.fileno()

    def close(self) -> None:
        """End it; a second time does nothing."""
        self._end()

    def told(self) -> dict[str, Any]:
        """The next message.

        Raises
        ------
        InvalidInputError
            The decoder refused, broke, or was silent for too long.
        """
        size = int.from_bytes(self._bytes(4).tobytes(), "little")
        if size > _MOST_TEXT:
            raise self.refused("its decoder breaks")
        told: dict[str, Any] = json.loads(self._bytes(size).tobytes())
        if told["kind"] == "refused":
            raise self.refused(told["found"] + (f": {told['advice']}" if told["advice"] else ""))
        return told

    def picture(self, told: dict[str, Any]) -> Image:
        """The picture that follows a message, shape (h, w)."""
        width, height = told["size"]
        return self._bytes(width * height).reshape(height, width)

    def refused(self, why: str) -> InvalidInputError:
        """The error of a video that cannot be read."""
        return InvalidInputError("video", str(self.path), _ALLOWED, why)

    def _bytes(self, count: int) -> Image:
        received = np.empty(count, dtype=np.uint8)
        view, poll = received.data, select.poll()
        poll.register(self._output, select.POLLIN)
        while view:
            if not poll.poll(PATIENCE * 1000.0):
                raise self.refused(f"its decoder was silent for {PATIENCE:g} s")
            got = os.readv(self._output, [view])
            if not got:
                raise self.refused(self._why())
            view = view[got:]
        return received

    def _why(self) -> str:
        """Why the decoder ended before it had told all."""
        code = self._process.wait()
        if code == -signal.SIGXCPU:
            return f"decoding it takes more than {MOST_SECONDS} s of processor time"
        return f"its decoder breaks ({signal.Signals(-code).name if code < 0 else code})"


def _check_names(frames: list[Path], folder: Path) -> None:
    if not frames:
        raise InvalidInputError("video", str(folder), _ALLOWED, "there is no frame in the folder")
    if len(frames) > MOST_FRAMES:
        raise InvalidInputError("video", str(folder), f"at most {MOST_FRAMES} frames", "cut it into shorter recordings")
    # frame2 sorts behind frame10, and would be taken for a later one.
    other = next((path for path in frames if len(path.stem) != len(frames[0].stem)), None)
    if other is not None:
        raise InvalidInputError(
            "video",
            str(folder),
            "frames with names of the same length, so that they sort in time",
            f"{frames[0].name} and {other.name} differ: fill up with zeros",
        )


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()

"""The process that decodes: it reads what others made, so it has limits of its own and may be ended at any time.

A picture of a few megabytes can keep a decoder busy for minutes inside one call (a progressive JPEG with many scans
takes 1 ms per 31 bytes), and nothing in the same process could interrupt that.  So :mod:`stripfold.vision.video`
starts this module, ``python -m stripfold.vision.decoding probe|read PATH``, and reads messages from its output: the
length of a JSON text as four bytes, the text, and after a ``frame`` the picture, one byte per pixel.
"""

from __future__ import annotations

import json
import os
import resource
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import av
import numpy as np
from av.stream import Disposition
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

MOST_PIXELS = 36_000_000
"""Pixels of a frame: 8K fits."""
MOST_FRAMES = 200_000
"""Frames of a recording: nearly an hour at 60 per second."""
MOST_ERRORS = 100
"""Packets that do not decode."""
MOST_MEMORY = 4 << 30
"""Address space of this process, bytes."""
MOST_SECONDS = 3600
"""Processor time of this process, s."""

_KINDS = {".png": "png_pipe", ".jpg": "jpeg_pipe", ".jpeg": "jpeg_pipe"}
PICTURES = tuple(_KINDS)
"""How the names of frames in a folder end."""
# What cameras and common programs write.  Play lists, which would open other files, are not among them.
_FORMATS = "avi,matroska,webm,mov,mp4,m4a,3gp,3g2,mj2,mpegts,mpeg,asf,flv,ogg,nut,mxf,y4m,png_pipe,jpeg_pipe,mjpeg"
_LUMINANCE = {f"yuv{j}{kind}p" for j in ("", "j") for kind in (410, 411, 420, 422, 440, 444)} | {"nv12", "nv21", "gray"}
"""Formats whose first plane is the luminance, one byte per pixel."""


class Refusal(Exception):
    """What was found, and what to do about it."""

    def __init__(self, found: str, advice: str = "") -> None:
        super().__init__(found, advice)
        self.found, self.advice = found, advice


def frame_files(folder: Path) -> list[Path]:
    """The frames in a folder, sorted by name."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES and path.is_file())


def messages(mode: str, path: Path) -> Iterator[tuple[dict[str, Any], bytes]]:
    """What to tell about a video or a folder of frames: ``info``, every ``frame`` when reading, ``end``."""
    files = frame_files(path) if path.is_dir() else [path]
    errors = count = 0
    for number, file in enumerate(files):
        with _opened(file) as container:
            stream = _stream(container)
            if number == 0:
                yield _info(container, stream, len(files) if path.is_dir() else stream.frames), b""
            if mode == "probe":
                return
            torn = False
            for packet in container.demux(stream):
                fault, frames = packet.is_corrupt, []
                try:
                    with av.logging.Capture() as complaints:
                        frames = packet.decode()
                    # Some decoders patch up what they cannot read, and only say so.
                    fault = fault or bool(complaints)
                except (av.error.InvalidDataError, av.error.PatchWelcomeError, av.error.ArgumentError) as error:
                    errors, fault = errors + 1, True
                    if errors > MOST_ERRORS:
                        raise Refusal(f"more than {MOST_ERRORS} packets do not decode: {error}") from error
                # What follows a fault is built on what was there before it, up to the next whole picture.
                torn = torn or fault
                for frame in frames:
                    count += 1
                    if count > MOST_FRAMES:
                        raise Refusal(f"more than {MOST_FRAMES} frames", "cut it into shorter recordings")
                    torn = frame.is_corrupt or fault or (torn and not frame.key_frame)
                    yield _frame(frame, torn)
    yield {"kind": "end", "errors": errors}, b""


def _opened(file: Path) -> av.container.InputContainer:
    options = {"protocol_whitelist": "file", "format_whitelist": _FORMATS, "max_pixels": str(MOST_PIXELS)}
    try:
        return av.open(f"file:{file}", "r", _KINDS.get(file.suffix.lower()), options=options, metadata_errors="replace")
    except av.FFmpegError as error:
        advice = "save it again as mp4, avi or mkv" if file.suffix.lower() not in PICTURES else ""
        raise Refusal(f"{file.name} does not open as one ({error.strerror})", advice) from error


def _stream(container: av.container.InputContainer) -> VideoStream:
    """The moving pictures: not the picture of a cover."""
    found = [stream for stream in container.streams.video if not stream.disposition & Disposition.attached_pic]
    if not found:
        raise Refusal("no moving pictures in it")
    stream = found[0]
    context = stream.codec_context
    if context is None:
        raise Refusal("no decoder for its pictures")
    if not 0 < context.width * context.height <= MOST_PIXELS:
        size = f"{context.width} x {context.height} pixels" if context.width else "no size of its pictures"
        raise Refusal(f"its header declares {size}", f"at most {MOST_PIXELS} pixels can be read")
    # Before the decoder opens: no larger picture gets memory, whatever later frames declare.
    # Faults are looked for: where there is a check sum, by it.
    context.options = {"max_pixels": str(MOST_PIXELS), "err_detect": "crccheck+bitstream+buffer"}
    context.thread_count = 1
    return stream


def _info(container: av.container.InputContainer, stream: VideoStream, declared: int) -> dict[str, Any]:
    rate, base, context = stream.average_rate, stream.time_base, stream.codec_context
    return {
        "kind": "info",
        "container": container.format.name,
        "codec": context.name,
        "size": [context.width, context.height],
        "declared": max(declared, 0),
        "rate": float(rate) if rate else None,
        "time_base": [base.numerator, base.denominator] if base else None,
        "duration": container.duration / av.time_base if container.duration else None,
    }


def _frame(frame: VideoFrame, damaged: bool) -> tuple[dict[str, Any], bytes]:
    full = frame.color_range == 2 or frame.format.name.startswith("yuvj")
    limited = not full and frame.format.name in _LUMINANCE and (frame.format.name != "gray" or frame.color_range == 1)
    if frame.format.name not in _LUMINANCE:
        frame_grey = frame.reformat(format="gray", threads=1)
    else:
        frame_grey = frame
    plane = frame_grey.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8, count=plane.line_size * frame.height).reshape(
        frame.height, plane.line_size
    )
    told = {
        "kind": "frame",
        "time": float(frame.pts * frame.time_base) if frame.pts is not None and frame.time_base else None,
        "size": [frame.width, frame.height],
        "limited": limited,
        "damaged": damaged,
        "interlaced": bool(frame.interlaced_frame),
        "turn": int(frame.rotation),
    }
    return told, rows[:, : frame.width].tobytes()


def main(mode: str, path: str) -> None:
    """Tell everything about ``path`` on the standard output; what goes wrong is told too."""
    av.logging.set_level(av.logging.ERROR)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    # Nothing that a library prints may come between the messages.
    with os.fdopen(os.dup(1), "wb", buffering=0) as out:
        os.dup2(2, 1)
        try:
            for told, picture in messages(mode, Path(path)):
                _send(out, told, picture)
        except BrokenPipeError:
            return  # whoever asked has seen enough
        except Refusal as refusal:
            _send(out, {"kind": "refused", "found": refusal.found, "advice": refusal.advice})
        except MemoryError:
            _send(
                out, {"kind": "refused", "found": f"decoding it takes more than {MOST_MEMORY >> 30} GB", "advice": ""}
            )
        except Exception as error:
            # Libraries fail in ways of their own on files made to make them fail.
            _send(out, {"kind": "refused", "found": f"decoding it fails ({error!r:.200})", "advice": ""})


def _send(out: BinaryIO, told: dict[str, Any], picture: bytes = b"") -> None:
    text = json.dumps(told).encode()
    for part in (len(text).to_bytes(4, "little") + text, picture):
        view = memoryview(part)
        while view:
            view = view[out.write(view) :]


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

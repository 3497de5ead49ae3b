"""The decoder process: it reads untrusted files, so it has limits of its own and can be ended at any time.

A picture of a few megabytes can occupy a decoder for minutes inside one call (a progressive JPEG with many scans takes
1 ms per 31 bytes), which nothing in the same process could interrupt.  :mod:`stripfold.film.video` therefore starts
``python -m stripfold.film.decoding CHANNEL PATH`` and reads from its standard output: for each message the number of
its bytes, four of them, the message in JSON, and of a ``frame`` as many ``bytes`` of its grey picture as it says, one
per pixel, the rows ``stride`` bytes apart.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import av
from av.stream import Disposition
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

MAX_PIXELS = 36_000_000
"""Pixels of a frame: 8K fits."""
MAX_BYTES = MAX_PIXELS + (1 << 24)
"""Bytes of a frame whose rows a decoder has padded."""
MAX_FRAMES = 200_000
"""Frames of a recording: nearly an hour at 60 per second."""
MAX_ERRORS = 100
"""Packets that cannot be decoded."""
MAX_MEMORY = 4 << 30
"""Address space of this process, bytes."""
MAX_SECONDS = 3600
"""CPU time of this process, s."""

_DEMUXERS = {".png": "png_pipe", ".jpg": "jpeg_pipe", ".jpeg": "jpeg_pipe"}
SUFFIXES = tuple(_DEMUXERS)
"""File names of frames in a folder end in one of these."""
# What cameras and common programs write.  Playlists, which would open other files, are excluded.
_FORMATS = "avi,matroska,webm,mov,mp4,m4a,3gp,3g2,mj2,mpegts,mpeg,asf,flv,ogg,nut,mxf,y4m,png_pipe,jpeg_pipe,mjpeg"
_PLANAR = {f"yuv{j}{kind}p" for j in ("", "j") for kind in (410, 411, 420, 422, 440, 444)}
_LUMA = _PLANAR | {"nv12", "nv21", "gray"}
"""Pixel formats whose first plane is the luma, one byte per pixel."""
# Names and comments in a file need not be UTF-8.  PyAV 19 replaces what is not, and has no option for it.
_METADATA: dict[str, Any] = {} if int(av.__version__.split(".")[0]) >= 19 else {"metadata_errors": "replace"}
_NO_INDEX = "moov atom not found"
"""What the library logs of such an mp4."""
CHANNELS = ("luma", "blue", "red")
"""What can be decoded: luma, and the differences of blue and red from it, which a grey picture lacks."""
_COLOURED = 24
"""Least range of a difference in a coloured picture: compression makes one in a grey picture."""

Message = dict[str, Any]


class Refusal(Exception):
    """A video that cannot be used; the message says why."""


def frame_files(folder: Path) -> list[Path]:
    """The frames in a folder, sorted by name."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())


def messages(path: Path, channel: int = 0) -> Iterator[tuple[Message, memoryview | bytes]]:
    """The content of a video or a folder of frames: one ``start``, each ``frame`` with its picture, one ``end``.

    ``channel`` is an index of :data:`CHANNELS`.
    """
    files = frame_files(path) if path.is_dir() else [path]
    errors = count = 0
    for file in files:
        with _open(file) as container:
            stream = _stream(container)
            if file == files[0]:
                yield {"kind": "start", **_declared(container, stream, len(files) if path.is_dir() else 0)}, b""
            damaged = False
            for packet in container.demux(stream):
                fault, frames = packet.is_corrupt, []
                try:
                    with av.logging.Capture() as complaints:
                        frames = packet.decode()
                    # Some decoders conceal errors and only log them.
                    fault = fault or bool(complaints)
                except (av.error.InvalidDataError, av.error.PatchWelcomeError, av.error.ArgumentError) as error:
                    errors, fault = errors + 1, True
                    if errors > MAX_ERRORS:
                        raise Refusal(f"more than {MAX_ERRORS} packets cannot be decoded: {error}") from error
                # A fault persists in all frames predicted from the damaged one, up to the next key frame.
                damaged = damaged or fault
                for frame in frames:
                    count += 1
                    if count > MAX_FRAMES:
                        raise Refusal(f"more than {MAX_FRAMES} frames: cut it into shorter recordings")
                    damaged = frame.is_corrupt or fault or (damaged and not frame.key_frame)
                    message, picture = _frame(frame, damaged, channel)
                    if count == 1:
                        message["coloured"] = _coloured(frame)
                    yield message, picture
    yield {"kind": "end", "errors": errors}, b""


def _open(file: Path) -> av.container.InputContainer:
    options = {"protocol_whitelist": "file", "format_whitelist": _FORMATS, "max_pixels": str(MAX_PIXELS)}
    demuxer = _DEMUXERS.get(file.suffix.lower())
    try:
        with av.logging.Capture() as complaints:
            return av.open(f"file:{file}", "r", demuxer, options=options, **_METADATA)
    except av.FFmpegError as error:
        # An mp4 has its index at its end; within it, the file itself ends too early.
        if isinstance(error, av.error.EOFError) or any(_NO_INDEX in text for *_, text in complaints):
            cut = "it was cut off while it was copied or recorded: copy it again, or film again"
            raise Refusal(f"{file.name} cannot be opened, its index is missing: {cut}") from error
        advice = "" if demuxer else ": save it again as mp4, avi or mkv"
        raise Refusal(f"{file.name} cannot be opened ({error.strerror}){advice}") from error


def _stream(container: av.container.InputContainer) -> VideoStream:
    """The first video stream that is not a cover picture, with limits set before its decoder opens."""
    found = [stream for stream in container.streams.video if not stream.disposition & Disposition.attached_pic]
    if not found:
        raise Refusal("it contains no video stream")
    context = found[0].codec_context
    if context is None:
        raise Refusal("there is no decoder for its codec")
    if not 0 < context.width * context.height <= MAX_PIXELS:
        size = f"{context.width} x {context.height} pixels" if context.width else "no picture size"
        raise Refusal(f"its header declares {size}: at most {MAX_PIXELS} pixels can be read")
    # No memory is allocated for a larger picture, whatever later frames declare; check sums are verified.
    context.options = {"max_pixels": str(MAX_PIXELS), "err_detect": "crccheck+bitstream+buffer"}
    context.thread_count = 1
    return found[0]


def _declared(container: av.container.InputContainer, stream: VideoStream, files: int) -> Message:
    """What the header says, or the number of ``files``: frames, and length in s; 0 where it does not say.

    ``predicted``: whether frames are compressed, with loss, by prediction from others.
    """
    codec = stream.codec_context.codec
    predicted = codec.lossy and not codec.intra_only
    if files:
        return {"declared": files, "duration": 0.0, "predicted": predicted}
    if stream.duration is not None and stream.time_base is not None:
        duration = float(stream.duration * stream.time_base)
    else:
        duration = (container.duration or 0) / av.time_base
    # Of an avi that was cut off the length is estimated from its size.
    if stream.average_rate:
        duration = max(duration, stream.frames / float(stream.average_rate))
    return {"declared": max(stream.frames, 0), "duration": max(duration, 0.0), "predicted": predicted}


def _coloured(frame: VideoFrame) -> bool:
    name = frame.format.name
    if name.startswith("gray"):
        return False
    for channel in (1, 2):
        message, plane = _frame(frame, False, channel)
        (width, height), stride = message["plane"], message["stride"]
        rows = [plane[row * stride : row * stride + width] for row in range(height)]
        if max(map(max, rows)) - min(map(min, rows)) >= _COLOURED:
            return True
    return False


def _frame(frame: VideoFrame, damaged: bool, channel: int) -> tuple[Message, memoryview]:
    name = frame.format.name
    full_range = frame.color_range == 2 or name.startswith("yuvj") or (name == "gray" and frame.color_range != 1)
    if channel:
        picture = frame if name in _PLANAR else frame.reformat(format="yuvj444p", threads=1)
    else:
        picture = frame if name in _LUMA else frame.reformat(format="gray", threads=1)
    # Without NumPy: its import would take as long as a hundred frames.
    chosen = picture.planes[channel]
    plane, stride = memoryview(chosen), chosen.line_size
    message = {
        "kind": "frame",
        "time": float(frame.pts * frame.time_base) if frame.pts is not None and frame.time_base else None,
        "size": [frame.width, frame.height],
        "plane": [chosen.width, chosen.height],
        "stride": stride,
        "limited_range": name in _LUMA and not full_range and not channel,
        "damaged": damaged,
        "interlaced": bool(frame.interlaced_frame),
        "rotation": int(frame.rotation),
    }
    return message, plane[: stride * chosen.height]


def main(channel: int, path: Path) -> None:
    """Write a channel of ``path`` to the standard output; errors are written as the message ``refused``."""
    import resource  # not on Windows

    av.logging.set_level(av.logging.ERROR)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (MAX_SECONDS, MAX_SECONDS + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        try:
            for message, picture in messages(path, channel):
                _send(message, picture)
            return
        except BrokenPipeError:
            raise
        except Refusal as refusal:
            reason = str(refusal)
        except MemoryError:
            reason = f"decoding needs more than {MAX_MEMORY >> 30} GB"
        except Exception as error:
            # Malformed files raise errors of many types in the libraries.
            reason = f"decoding failed ({error!r:.200})"
        _send({"kind": "refused", "reason": reason}, b"")
    except BrokenPipeError:
        os._exit(0)  # the reader has stopped; nothing more is flushed


def _send(message: Message, picture: memoryview | bytes) -> None:
    if len(picture) > MAX_BYTES:
        raise Refusal(f"a frame has {len(picture)} bytes")
    header = json.dumps(message | {"bytes": len(picture)}).encode()
    out = sys.stdout.buffer
    out.write(len(header).to_bytes(4, "big") + header)
    out.write(picture)
    out.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))

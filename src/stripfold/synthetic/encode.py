"""Frames into a video file, each with its own time stamp."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.video.stream import VideoStream

from stripfold.synthetic.canvas import Grey
from stripfold.synthetic.scene import Filming

_PIXELS = {"ffv1": "gray", "mjpeg": "yuvj420p", "mpeg4": "yuv420p"}


def tick(filming: Filming) -> Fraction:
    """The step of the container's clock, s.

    Matroska counts milliseconds, AVI frames; MPEG-4 allows clocks of up to 65535 ticks per second.
    """
    if filming.container == "avi" or filming.timestamps:
        return 1 / Fraction(filming.frame_rate).limit_denominator(1001)
    return Fraction(1, 1000) if filming.container == "mkv" else Fraction(1, 60000)


def encode(path: Path, frames: Iterable[Grey], stamps: Iterable[int], filming: Filming) -> None:
    """Write a video.

    Parameters
    ----------
    path
        Where to; its suffix is the container's.
    frames
        Shape (height, width) each.
    stamps
        Time of each, in :func:`tick`.
    filming
        Size, rate, codec and quality.
    """
    base = tick(filming)
    rate = Fraction(filming.frame_rate).limit_denominator(1001)
    options = {"qmin": str(filming.quality), "qmax": str(filming.quality)} if filming.codec != "ffv1" else {}
    # No date and no version of the library: the same scene gives the same bytes.
    with av.open(str(path), "w", options={"fflags": "+bitexact"}) as container:
        container.metadata["title"] = "synthetic recording"
        stream = cast(VideoStream, container.add_stream(filming.codec, rate=rate, options=options))
        stream.width, stream.height = filming.size
        stream.pix_fmt = _PIXELS[filming.codec]
        stream.time_base = base
        stream.codec_context.time_base = base
        stream.codec_context.thread_count = 1
        stream.codec_context.bit_rate = 0
        stream.codec_context.gop_size = 12
        for picture, stamp in zip(frames, stamps, strict=True):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="gray")
            frame.pts, frame.time_base = int(stamp), base
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))

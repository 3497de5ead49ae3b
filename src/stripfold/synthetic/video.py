"""The frames of a synthetic film: when they are taken, which arrive, and their video file."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np

from stripfold.base.arrays import Array, Picture
from stripfold.files.store import literal
from stripfold.synthetic.scene import Filming

_PIXELS = {"ffv1": "gray", "mjpeg": "yuvj420p", "mpeg4": "yuv420p"}
_COLOUR_PIXELS = _PIXELS | {"ffv1": "yuv444p"}


class Timeline(NamedTuple):
    """The times of a film's frames, s.

    ``t``: shape (n,): time stamp of each frame that arrives.  ``shown``: shape (n,): when its content was filmed;
    earlier for a duplicate.  ``dropped``: shape (d,): frames that do not arrive.
    """

    t: Array
    shown: Array
    dropped: Array


def tick(filming: Filming) -> Fraction:
    """The time base of the container, s.

    Matroska counts milliseconds, AVI frames; MPEG-4 allows up to 65535 ticks per second.
    """
    if filming.container == "avi" or filming.timestamps:
        return 1 / Fraction(filming.frame_rate).limit_denominator(1001)
    return Fraction(1, 1000) if filming.container == "mkv" else Fraction(1, 60000)


def timeline(filming: Filming, end: float, fall: float, rng: np.random.Generator) -> Timeline:
    """The frames of a film of ``end`` seconds; ``fall`` is where the snap begins, s."""
    clock = 1e-6 if filming.timestamps else float(tick(filming))
    period = 1.0 / filming.frame_rate
    t = np.arange(int(end / period) + 1) * period
    # Frames keep their order, and the first is at 0.
    t[1:] += period * np.clip(filming.jitter * rng.standard_normal(len(t) - 1), -0.4, 0.4)
    t = np.rint(t / clock) * clock
    lost = rng.random(len(t)) < filming.dropped
    first = int(np.searchsorted(t, fall))
    lost[first : first + filming.dropped_at_event] = True
    doubled = (rng.random(len(t)) < filming.doubled) & ~lost
    lost[:2] = doubled[:2] = False
    shown = t.copy()
    for i in np.flatnonzero(doubled):
        shown[i] = shown[i - 1]
    return Timeline(t[~lost], shown[~lost], t[lost])


def encode(path: Path, frames: Iterable[Picture], stamps: Iterable[int], filming: Filming, coloured: bool) -> None:
    """Write frames, each with its time stamp in :func:`tick`, to a video file.

    Their shape is (height, width), or (height, width, 3) if ``coloured``.
    """
    rate = Fraction(filming.frame_rate).limit_denominator(1001)
    options = {"qmin": str(filming.quality), "qmax": str(filming.quality)} if filming.codec != "ffv1" else {}
    # No date and no version of the library: the same scene gives the same bytes.
    with av.open(literal(path), "w", options={"fflags": "+bitexact"}) as container:
        container.metadata["title"] = "synthetic recording"
        stream = container.add_stream(filming.codec, rate=rate, options=options)
        stream.width, stream.height = filming.size
        stream.pix_fmt = (_COLOUR_PIXELS if coloured else _PIXELS)[filming.codec]
        stream.time_base = stream.codec_context.time_base = tick(filming)
        stream.codec_context.thread_count = 1
        stream.codec_context.bit_rate = 0
        stream.codec_context.gop_size = 12
        for picture, stamp in zip(frames, stamps, strict=True):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24" if coloured else "gray")
            frame.pts, frame.time_base = int(stamp), tick(filming)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))

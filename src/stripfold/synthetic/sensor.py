"""From a scene to a film: exposure, rolling shutter, light, blur and noise; which frames arrive; the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
from scipy.special import ndtri

from stripfold.base.arrays import Array, Picture
from stripfold.files.store import literal
from stripfold.synthetic.history import History
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Filming
from stripfold.synthetic.view import Light

LABEL = "SYNTHETIC"
FLICKER = 100.0
"""Frequency of lamps on 50 Hz, Hz."""
_STEP, _BAND_STEP, _OCCLUDER_STEP = 0.7, 0.15, 0.6
"""Largest motion of the strip between partial exposures and between bands of rows, and of the occluder, pixels."""
_MAX_PARTS, _MAX_BANDS = 16, 32
_NORMAL: Light = ndtri((np.arange(2**16) + 0.5) / 2**16).astype(np.float32)
"""Equally probable values of a normal distribution: to choose among them is faster than to draw anew."""


class Sensor:
    """The camera that films a scene; ``rng`` is for its noise.

    Shadow and occluder cross the picture once in ``span``, the duration of the film, s.
    """

    def __init__(self, renderer: Renderer, span: float, rng: np.random.Generator) -> None:
        self._renderers, self._filming, self._span, self._rng = renderer.channels, renderer.scene.filming, span, rng
        self._phase = rng.uniform(-0.2, 0.2)

    def film(self, history: History, times: Iterable[float]) -> Iterator[Picture]:
        """The frames taken at ``times``, of the shape of :meth:`exposed`; the same time again gives the same frame."""
        last, frame = None, None
        for t in times:
            if frame is None or last != t:
                last, frame = t, self.delivered(self.exposed(history, float(t)), float(t))
            yield frame

    def exposed(self, history: History, t: float) -> Light:
        """The mean over the exposure of each row, 255 for white in full light.

        Shape (height, width), of a coloured strip (height, width, 3): red, green and blue.
        """
        channels = [self._exposed(renderer, history, t) for renderer in self._renderers]
        return np.dstack(channels) if len(channels) > 1 else channels[0]

    def _exposed(self, renderer: Renderer, history: History, t: float) -> Light:
        filming = self._filming
        width, height = filming.size
        shutter, exposure = filming.rolling_shutter, filming.exposure
        moved = history.displacement(t - 0.5 * exposure, t + shutter + 0.5 * exposure) * width / filming.field
        speed = moved / (shutter + exposure) if shutter + exposure > 0.0 else 0.0
        # The occluder is not measured: its steps need only be invisible.
        occluder = 1.4 * width / self._span if filming.occluder else 0.0
        rate = max(speed / _BAND_STEP, occluder / _OCCLUDER_STEP)
        bands = int(np.clip(np.ceil(rate * shutter), 1, _MAX_BANDS))
        parts = int(np.clip(np.ceil(speed * exposure / _STEP), 1, _MAX_PARTS))
        picture = np.zeros((height, width), dtype=np.float32)
        for first, end in pairwise(np.rint(np.linspace(0, height, bands + 1)).astype(int).tolist()):
            middle = t + shutter * 0.5 * (first + end - 1) / (height - 1)
            times = middle + exposure * ((np.arange(parts) + 0.5) / parts - 0.5)
            for time, curve, gripper in zip(times, *history.at(times), strict=True):
                seen = renderer.picture(curve, gripper, self._occluder(time), (first, end))
                picture[first:end] += seen[first:end]
        return picture if parts == 1 else picture / np.float32(parts)

    def delivered(self, seen: Light, t: float | None, free: Array | None = None) -> Picture:
        """The frame, of the shape of ``seen``: lit, out of focus, with noise, labelled.

        ``seen`` has 255 for white in full light; ``t`` is the time, s, None for steady light at rest; the label keeps
        away from the pixels ``free``, shape (n, 2).
        """
        filming = self._filming
        lighting = self._lighting(t)
        light = seen * (lighting if seen.ndim == 2 else lighting[..., None])
        if filming.defocus > 0.0:
            light = cv2.GaussianBlur(light, (0, 0), filming.defocus, borderType=cv2.BORDER_REPLICATE)
        noise = _NORMAL[self._rng.integers(0, len(_NORMAL), light.shape, np.uint16)]
        noise *= np.sqrt(np.float32(filming.shot_noise**2 / 255.0) * light + np.float32(filming.read_noise**2))
        # It rounds, and limits to 0 and 255.
        return labelled(np.asarray(cv2.add(light, noise, dtype=cv2.CV_8U), dtype=np.uint8), free)

    def _lighting(self, t: float | None) -> Light:
        filming = self._filming
        width, height = filming.size
        x = np.arange(width, dtype=np.float32) / width
        across = filming.light * (1.0 + filming.gradient * (0.5 - x))
        down = np.ones(height, dtype=np.float32)
        if t is not None:
            rows = t + filming.rolling_shutter * np.arange(height) / (height - 1)
            down += (filming.flicker * np.sin(2.0 * np.pi * FLICKER * rows)).astype(np.float32)
            across *= 1.0 - filming.shadow * np.exp(-0.5 * ((x + 0.2 - 1.4 * self._crossed(t)) / 0.12) ** 2)
        return np.asarray(np.outer(down, across), dtype=np.float32)

    def _crossed(self, t: float) -> float:
        """Share of the picture that shadow and occluder have crossed."""
        return t / self._span + self._phase

    def _occluder(self, t: float) -> float | None:
        filming = self._filming
        return filming.target[0] + filming.field * (1.4 * self._crossed(t) - 0.7) if filming.occluder else None


def labelled(picture: Picture, free: Array | None = None) -> Picture:
    """A copy with the label in the lower right corner, or in the corner that is farthest from ``free``."""
    height, width = picture.shape[:2]
    scale = max(0.3, width / 1600.0)
    (long, high), _ = cv2.getTextSize(LABEL, cv2.FONT_HERSHEY_PLAIN, 2.0 * scale, 1)
    corners = [(width - long - 3, height - 4), (3, height - 4), (width - long - 3, high + 3), (3, high + 3)]
    place = corners[0]
    if free is not None:
        middles = np.array([[x + 0.5 * long, y - 0.5 * high] for x, y in corners])
        gaps = np.linalg.norm(middles[:, None] - free[None], axis=2).min(axis=1)
        place = corners[int(np.argmax(gaps))]
    dark = float(picture[max(place[1] - high, 0) : place[1] + 1, place[0] : place[0] + long].mean()) < 128.0
    done = picture.copy()
    grey = (150 if dark else 60,) * 3
    cv2.putText(done, LABEL, place, cv2.FONT_HERSHEY_PLAIN, 2.0 * scale, grey, 1, cv2.LINE_AA)
    return done


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

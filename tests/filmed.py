"""Pictures of markers and videos with known content, for the tests of the vision part."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

CONTAINERS = {"ffv1": "mkv", "mjpeg": "avi", "mpeg4": "mp4", "libx264": "mp4"}
FORMATS = {"ffv1": "gray", "mjpeg": "yuvj420p"}


def write_video(
    path: Path,
    codec: str,
    images: Sequence[Image],
    pts: Sequence[int],
    base: Fraction,
    fmt: str | None = None,
    turns: int = 0,
) -> Path:
    """A video whose frames have the given time stamps, in units of ``base``, to be shown ``turns`` quarters left."""
    fmt = fmt or FORMATS.get(codec, "yuv420p")
    # With a check sum per slice, FFV1 knows of damage.
    options = {"libx264": {"crf": "10"}, "ffv1": {"level": "3", "slicecrc": "1"}}.get(codec, {})
    with av.open(path, "w") as container:
        stream: Any = container.add_stream(codec, rate=round(1 / base), options=options)
        stream.height, stream.width = images[0].shape
        stream.set_display_rotation(90 * turns)
        stream.pix_fmt, stream.codec_context.time_base, stream.codec_context.thread_count = fmt, base, 1
        if codec in ("mjpeg", "mpeg4"):
            stream.codec_context.qmin = stream.codec_context.qmax = 2
        for image, at in zip(images, pts, strict=True):
            frame = av.VideoFrame.from_ndarray(image, "gray").reformat(format=fmt)
            frame.pts, frame.time_base = at, base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def landscape(seed: int, height: int = 96, width: int = 160) -> Image:
    """A smooth random picture."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, (height, width))
    smooth = cv2.GaussianBlur(noise, (0, 0), 6.0)
    return np.clip(128.0 + 40.0 * smooth / smooth.std(), 0, 255).astype(np.uint8)


def marker_picture(
    known: cv2.aruco.Dictionary,
    number: int,
    centre: tuple[float, float],
    side: float,
    angle: float = 0.0,
    *,
    size: tuple[int, int] = (240, 200),
    blur: float = 0.7,
    motion: float = 0.0,
    perspective: float = 0.0,
) -> NDArray[np.float64]:
    """A marker on a white card on grey ground, not rounded; 16 samples per pixel.

    ``side``, ``blur`` and ``motion`` (a uniform smear along x) are in pixels, ``angle`` in rad.
    """
    cells, per, samples = int(known.markerSize) + 2, 32, 4
    bits = np.pad(cv2.aruco.generateImageMarker(known, number, cells), 1, constant_values=255)
    card = np.pad(np.where(bits > 0, 215.0, 30.0), 1, constant_values=90.0)
    card = np.kron(card, np.ones((per, per))).astype(np.float32)
    card = cv2.GaussianBlur(card, (0, 0), blur * per * cells / side, borderType=cv2.BORDER_REPLICATE)
    width, height = size
    rows, columns = np.mgrid[0 : height * samples, 0 : width * samples]
    x, y = (columns + 0.5) / samples - 0.5 - centre[0], (rows + 0.5) / samples - 0.5 - centre[1]
    u = (np.cos(angle) * x + np.sin(angle) * y) / side
    v = (-np.sin(angle) * x + np.cos(angle) * y) / side
    u, v = u / (1.0 + perspective * u), v / (1.0 + perspective * u)
    places = [((axis + 0.5) * cells + 2.0) * per - 0.5 for axis in (u, v)]
    seen = cv2.remap(card, *(p.astype(np.float32) for p in places), cv2.INTER_LINEAR, borderValue=90.0)
    if motion > 0.0:
        seen = cv2.blur(seen, (round(motion * samples) | 1, 1))
    return np.asarray(seen, dtype=np.float64).reshape(height, samples, width, samples).mean(axis=(1, 3))


def exposed(picture: NDArray[np.float64], noise: float, rng: np.random.Generator) -> Image:
    """A picture as a camera stores it."""
    return np.clip(np.rint(picture + rng.normal(0.0, noise, picture.shape)), 0, 255).astype(np.uint8)

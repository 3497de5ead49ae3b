"""Pictures of markers, videos with known content, and the truth of synthetic recordings, for the tests of films."""

from __future__ import annotations

import json
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from stripfold.base.arrays import Array
from stripfold.files import store

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


RAISED, SWING, FOLLOWING = 0.1, 0.35, 0.4
"""Height, over the gripper's, from which a point is raised; for how long, s, the strip swings after its gripper has
started; share of the time to the fastest motion in which it follows."""


def event_of(folder: Path) -> tuple[float, float]:
    """Onset, s, and lambda then, m, of the motion itself.

    The root of its kinetic energy, of the part of the strip that is raised at first, rises half-way from its median
    while the strip follows the gripper to its first peak: its maximum before it has halved, once the layers touch.
    """
    truth = store.read(folder / "truth.nc", ("time", "advance", "curve"))
    touch = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["events"]["touch"]["t"]
    t, lam, curve = truth["time"].values, truth["advance"].values, truth["curve"].values.astype(np.float64)
    return onset_of(t, lam, curve, touch)


def onset_of(t: Array, lam: Array, curve: Array, touch: float) -> tuple[float, float]:
    """The same of a motion: times, s, lambda, m, curves, shape (m, n, 2), m, and when the layers touch, s."""
    height = curve[0, :, 1]
    raised = slice(0, int(np.flatnonzero(height > RAISED * height[0])[-1]) + 1)
    speed = np.sqrt(np.mean(np.sum(np.gradient(curve[:, raised], t, axis=0) ** 2, axis=2), axis=1))
    rate = np.gradient(lam, t)
    steady = t[np.flatnonzero(rate > 0.8 * rate.max())[0]] + SWING
    used = t >= steady
    t, lam, speed = t[used], lam[used], speed[used]
    # The touch brakes a part of the strip: the rest may go on accelerating.
    ended = np.flatnonzero((t > touch) & (speed < 0.5 * np.maximum.accumulate(speed)))
    peak = int(np.argmax(speed[: int(ended[0])] if len(ended) else speed))
    following = np.median(speed[: max(int(FOLLOWING * peak), 1)])
    last = int(np.flatnonzero(speed[:peak] < 0.5 * (following + speed[peak]))[-1])
    return float(t[last]), float(lam[last])

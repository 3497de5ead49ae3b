"""Frames per second and memory of reading and measuring a video, in a process of its own that has one core."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from time import perf_counter
from typing import Any, cast

import av
import cv2
import numpy as np
import xarray as xr
from av.video.stream import VideoStream

from ..errors import StripfoldError
from ..vision.centreline import Centreline, find, refine
from ..vision.decoder import Image
from ..vision.gripper import GripperTracker
from ..vision.marker import DICTIONARIES
from ..vision.video import Frame, read

Stage = Callable[[Frame], object]

CODECS = {"h264": ("libx264", "mp4"), "mpeg4": ("mpeg4", "mp4"), "mjpeg": ("mjpeg", "avi"), "ffv1": ("ffv1", "mkv")}
"""What the videos are made with: encoder and container."""
SIZE = (1280, 720)
RATE = 60
_DICTIONARY, _NUMBER = "4x4_50", 7
_SIDE = 48.0
"""Side of the marker, pixels."""
_NOISE = 2.0
_BAND_TOP = 260.0
"""Row above which there is nothing of the band, only the marker's card."""
_OPTIONS = {"libx264": {"crf": "20", "threads": "1"}, "ffv1": {"level": "3", "slices": "4"}}


def stages() -> list[Stage]:
    """What is done with each frame, in turn: new stages of the measurement belong here."""
    return [GripperTracker(_DICTIONARY, _NUMBER), _strip()]


def _strip() -> Stage:
    """The strip from frame to frame: found in the first, below the marker's card, and followed."""
    last: list[Centreline] = []

    def strip(frame: Frame) -> None:
        if last:
            last[:] = [refine(frame.image, last[0])]
        else:
            covered = frame.image.copy()
            covered[: int(_BAND_TOP)] = int(np.median(frame.image))
            last[:] = [find(covered)]

    return strip


def run(frames: int) -> xr.Dataset:
    """Read videos of ``frames`` and of four times as many frames, one pair for each codec."""
    lengths = (frames, 4 * frames)
    shape = (len(CODECS), len(lengths))
    rate, seconds, memory = np.empty(shape), np.empty((len(CODECS), len(stages()) + 1)), np.empty(shape)
    for i, (codec, suffix) in enumerate(CODECS.values()):
        for j, length in enumerate(lengths):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"video.{suffix}"
                _make(path, codec, length)
                found = _measured(path)
            if found["frames"] != length:
                raise StripfoldError(f"the benchmark's video has {found['frames']} frames instead of {length}")
            rate[i, j], memory[i, j] = length / found["wall"], found["memory"]
            seconds[i] = np.array(found["seconds"]) / length
    return xr.Dataset(
        {
            "rate": (("codec", "length"), rate, {"units": "s-1", "long_name": "frames per second, on one core"}),
            "memory": (
                ("codec", "length"),
                memory,
                {"units": "MB", "long_name": "peak memory of the measuring process and of its decoder together"},
            ),
            "seconds": (
                ("codec", "stage"),
                seconds,
                {"units": "s", "long_name": "time per frame of decoding and of each stage after it"},
            ),
        },
        coords={
            "codec": ("codec", list(CODECS), {"units": "1", "long_name": "codec of the video"}),
            "length": ("length", list(lengths), {"units": "1", "long_name": "number of frames"}),
            "stage": (
                "stage",
                ["decoding", *(_name(stage) for stage in stages())],
                {"units": "1", "long_name": "what is done with a frame"},
            ),
        },
        attrs={"size": f"{SIZE[0]} x {SIZE[1]}"},
    )


def _name(stage: Stage) -> str:
    return getattr(stage, "__name__", type(stage).__name__)


def _measured(path: Path) -> dict[str, Any]:
    """What :func:`measure` finds in a process of its own."""
    command = [sys.executable, "-m", "stripfold.studies.video_benchmark", str(path)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        raise StripfoldError(f"the benchmark's process failed: {done.stderr.strip()}")
    return cast("dict[str, Any]", json.loads(done.stdout))


def measure(path: Path, work: Sequence[Stage]) -> dict[str, Any]:
    """Read a video to its end: frames, wall time from the second frame on, times of decoding and of each stage.

    The first frame, in which everything is searched for, is not counted, nor is the start of the decoder.
    """
    # The decoder starts later and inherits this: both share one core.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    cv2.setNumThreads(1)
    seconds, began, frames = np.zeros(len(work) + 1), 0.0, 0
    with read(path) as video:
        before = perf_counter()
        for frame in video:
            seconds[0] += perf_counter() - before
            for k, stage in enumerate(work, start=1):
                before = perf_counter()
                stage(frame)
                seconds[k] += perf_counter() - before
            frames += 1
            before = perf_counter()
            if frames == 1:
                seconds[:], began = 0.0, before
    wall = perf_counter() - began
    peaks = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    memory = float(np.round(sum(peaks) * 1024 / 1e6, 1))
    return {"frames": frames, "wall": wall, "seconds": seconds.tolist(), "memory": memory}


def _make(path: Path, codec: str, frames: int) -> None:
    """A video of a marker that advances over a bright band on a dark ground, with noise."""
    width, height = SIZE
    rng = np.random.default_rng(1)
    # A few pictures of noise, used in turn: making new ones would take longer than all else.
    noises = [rng.normal(0.0, _NOISE, (height, width)).astype(np.float32) for _ in range(7)]
    x = np.arange(width)
    ground = np.full((height, width), 60.0, np.float32)
    bend = 520.0 - 220.0 * np.exp(-(((x - 640.0) / 200.0) ** 2))
    cv2.polylines(ground, [np.column_stack([x, bend]).round().astype(np.int32)], False, 200.0, 9, cv2.LINE_AA)
    card = _card()
    with av.open(path, "w") as container:
        stream = cast(VideoStream, container.add_stream(codec, rate=RATE, options=_OPTIONS.get(codec, {})))
        stream.width, stream.height = SIZE
        stream.pix_fmt = {"mjpeg": "yuvj420p", "ffv1": "gray"}.get(codec, "yuv420p")
        if codec in ("mpeg4", "mjpeg"):
            stream.codec_context.qmin = stream.codec_context.qmax = 3
        for k in range(frames):
            centre = (140.0 + 1000.0 * k / frames, 200.0)
            frame = av.VideoFrame.from_ndarray(_picture(ground, card, centre, noises[k % 7]), "gray")
            frame = frame.reformat(format=stream.pix_fmt)
            frame.pts, frame.time_base = k, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _card() -> Image:
    """The marker with a white rim of one cell, 16 dots per cell."""
    known = cv2.aruco.getPredefinedDictionary(DICTIONARIES[_DICTIONARY])
    marker = cv2.aruco.generateImageMarker(known, _NUMBER, int(known.markerSize) + 2)
    return np.kron(np.pad(marker, 1, constant_values=255), np.ones((16, 16), np.uint8)).astype(np.uint8)


def _picture(ground: Any, card: Image, centre: tuple[float, float], noise: Any) -> Image:
    cells = len(card) // 16 - 2
    scale = _SIDE / cells / 16
    smooth = cv2.GaussianBlur(card, (0, 0), 0.6 / scale)
    middle = (len(card) - 1) / 2.0
    move = np.array([[scale, 0.0, centre[0] - scale * middle], [0.0, scale, centre[1] - scale * middle]])
    shown = cv2.warpAffine(smooth, move, SIZE, dst=ground.astype(np.uint8), borderMode=cv2.BORDER_TRANSPARENT)
    return np.clip(np.rint(shown + noise), 0, 255).astype(np.uint8)


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]), stages())))

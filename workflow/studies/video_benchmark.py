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
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any, cast

import av
import cv2
import numpy as np
import xarray as xr
from av.video.stream import VideoStream

from stripfold.arrays import Picture
from stripfold.errors import StripfoldError
from stripfold.synthetic.recording import history_of
from stripfold.synthetic.render import Renderer
from stripfold.synthetic.scene import Scene
from stripfold.synthetic.sensor import Sensor
from stripfold.synthetic.view import View
from stripfold.vision.gripper import Grip, GripperTracker
from stripfold.vision.mapping import Mapping, fit_homography
from stripfold.vision.strip_tracker import StripTracker
from stripfold.vision.video import Frame, read

Stage = Callable[[Frame], object]

CODECS = {"h264": ("libx264", "mp4"), "mpeg4": ("mpeg4", "mp4"), "mjpeg": ("mjpeg", "avi"), "ffv1": ("ffv1", "mkv")}
"""What the videos are made with: encoder and container."""
SIZE = (1280, 720)
RATE = 60
_DICTIONARY = "4x4_50"
BEGINS, DRAWN = 0.6, 45
"""When in the motion the video begins, s, and how many frames are drawn."""
_OPTIONS = {"libx264": {"crf": "20", "threads": "1"}, "ffv1": {"level": "3", "slices": "4"}}


def scene() -> Scene:
    """What is filmed: a strip before its snap, and the marker on its gripper."""
    return Scene.of({"filming": {"size": list(SIZE), "frame_rate": RATE}, "title": "benchmark"})


def stages() -> list[Stage]:
    """What is done with each frame, in turn: the marker is followed, then the strip from the gripped end on."""
    asked = scene()
    view, gripper = View.of(asked.filming), asked.gripper
    corners = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.15], [0.0, 0.15]])
    plane = fit_homography(view.camera.undistort(view.in_plane(corners)), corners)
    mapping = Mapping(view.camera, plane)
    follow_gripper = GripperTracker(_DICTIONARY, gripper.marker)
    follow_strip = StripTracker(mapping, asked.strip.length, "benchmark")
    last: list[Grip] = []

    def marker(frame: Frame) -> None:
        last[:] = [follow_gripper(frame)]

    def strip(frame: Frame) -> None:
        place = mapping.to_robot(last[0].centre[None]) + np.array(gripper.offset)
        follow_strip(frame, mapping.to_pixels(place)[0], last[0].corners)

    return [marker, strip]


def run(frames: int, repeats: int) -> xr.Dataset:
    """Read videos of ``frames`` and of four times as many frames, one pair for each codec, ``repeats`` times each."""
    lengths = (frames, 4 * frames)
    shape = (len(CODECS), len(lengths), repeats)
    rate, memory = np.empty(shape), np.empty(shape)
    seconds = np.empty((len(CODECS), len(stages()) + 1, repeats))
    for i, (codec, suffix) in enumerate(CODECS.values()):
        for j, length in enumerate(lengths):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"video.{suffix}"
                _make(path, codec, length)
                for k in range(repeats):
                    found = _measured(path)
                    if found["frames"] != length:
                        raise StripfoldError(f"the benchmark's video has {found['frames']} frames instead of {length}")
                    rate[i, j, k], memory[i, j, k] = length / found["wall"], found["memory"]
                    seconds[i, :, k] = np.array(found["seconds"]) / length
    return xr.Dataset(
        {
            "rate": (("codec", "length", "run"), rate, {"units": "s-1", "long_name": "frames per second, on one core"}),
            "memory": (
                ("codec", "length", "run"),
                memory,
                {"units": "MB", "long_name": "peak memory of the measuring process and of its decoder together"},
            ),
            "seconds": (
                ("codec", "stage", "run"),
                seconds,
                {"units": "s", "long_name": "time per frame of decoding and of each stage after it, longer video"},
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
    command = [sys.executable, "-m", "studies.video_benchmark", str(path)]
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
    """A video of the scene; its frames forwards and backwards in turn, as many as are asked for."""
    pictures = _pictures()
    there_and_back = [*range(len(pictures)), *range(len(pictures) - 2, 0, -1)]
    with av.open(path, "w") as container:
        stream = cast(VideoStream, container.add_stream(codec, rate=RATE, options=_OPTIONS.get(codec, {})))
        stream.width, stream.height = SIZE
        stream.pix_fmt = {"mjpeg": "yuvj420p", "ffv1": "gray"}.get(codec, "yuv420p")
        if codec in ("mpeg4", "mjpeg"):
            stream.codec_context.qmin = stream.codec_context.qmax = 3
        for k in range(frames):
            picture = pictures[there_and_back[k % len(there_and_back)]]
            frame = av.VideoFrame.from_ndarray(picture, "gray").reformat(format=stream.pix_fmt)
            frame.pts, frame.time_base = k, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


@cache
def _pictures() -> list[Picture]:
    asked = scene()
    history = history_of(asked)
    times = BEGINS + np.arange(DRAWN) / RATE
    sensor = Sensor(Renderer(asked, history.curve[0]), float(times[-1]), np.random.default_rng(1))
    return list(sensor.film(history, times))


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]), stages())))

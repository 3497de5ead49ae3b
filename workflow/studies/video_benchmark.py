"""Frames per second and memory of reading and tracking a video, in a process of its own on one core."""

from __future__ import annotations

import json
import os
import resource
import tempfile
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
from stripfold.vision.gripper import GripperTracker
from stripfold.vision.mapping import Mapping, fit_homography
from stripfold.vision.strip_tracker import StripTracker
from stripfold.vision.video import read
from studies.common import dataset, timed_process

CODECS = {"h264": ("libx264", "mp4"), "mjpeg": ("mjpeg", "avi"), "ffv1": ("ffv1", "mkv")}
"""Encoder and container of each codec."""
STAGES = ("decoding", "marker", "strip")
SIZE, RATE = (1280, 720), 60
START, DRAWN = 0.6, 45
"""Start of the video in the motion, s, and number of different frames."""
_OPTIONS = {"libx264": {"crf": "20", "threads": "1"}, "ffv1": {"level": "3", "slices": "4"}}
_SCENE = Scene.of({"filming": {"size": list(SIZE), "frame_rate": RATE}, "title": "benchmark"})
"""A strip before its snap, and the marker on its gripper."""


def run(frames: int, repeats: int) -> xr.Dataset:
    """Track videos of ``frames`` and of four times as many frames, one pair for each codec, ``repeats`` times each."""
    lengths = (frames, 4 * frames)
    shape = (len(CODECS), len(lengths), repeats)
    rate, memory, seconds = np.empty(shape), np.empty(shape), np.empty((*shape, len(STAGES)))
    for i, (codec, suffix) in enumerate(CODECS.values()):
        for j, length in enumerate(lengths):
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"video.{suffix}"
                _make(path, codec, length)
                call = f"json.dumps(measure({str(path)!r}))"
                for k in range(repeats):
                    _, (told,), peak = timed_process(
                        f"import json\nfrom studies.video_benchmark import measure\nprint({call})"
                    )
                    found = json.loads(told)
                    if found["frames"] != length:
                        raise StripfoldError(f"the benchmark's video has {found['frames']} frames instead of {length}")
                    rate[i, j, k], memory[i, j, k] = length / found["wall"], peak + found["decoder"]
                    seconds[i, j, k] = np.array(found["seconds"]) / length
    over = ("codec", "length", "run")
    per_frame = seconds[:, -1].swapaxes(1, 2)
    return dataset(
        "video_benchmark",
        {
            "rate": (over, rate),
            "memory": (over, memory),
            "seconds": (("codec", "stage", "run"), per_frame),
            "codec": ("codec", list(CODECS)),
            "length": ("length", lengths),
            "stage": ("stage", STAGES),
        },
        {"size": f"{SIZE[0]} x {SIZE[1]}"},
    )


def measure(path: str) -> dict[str, Any]:
    """Track a video to its end: frames, time of all but the first and of each stage, s, memory of the decoder, MB.

    The first frame, with the start of the decoder and the search for everything, is not counted.
    """
    # The decoder starts later and inherits this: both share one core.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    cv2.setNumThreads(1)
    view, gripper = View.of(_SCENE.filming), _SCENE.gripper
    corners = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.15], [0.0, 0.15]])
    mapping = Mapping(view.camera, fit_homography(view.camera.undistort(view.in_plane(corners)), corners))
    find_gripper = GripperTracker("4x4_50", gripper.marker)
    find_strip = StripTracker(mapping, _SCENE.strip.length, "benchmark")
    ends: list[float] = []
    with read(path) as video:
        for frame in video:
            ends.append(perf_counter())
            grip = find_gripper(frame)
            ends.append(perf_counter())
            place = mapping.to_robot(grip.centre[None]) + np.array(gripper.offset)
            find_strip(frame, mapping.to_pixels(place)[0], grip.corners)
            ends.append(perf_counter())
    first = len(STAGES) - 1
    seconds = np.diff(ends[first:]).reshape(-1, len(STAGES)).sum(axis=0)
    return {
        "frames": len(ends) // len(STAGES),
        "wall": perf_counter() - ends[first],
        "seconds": seconds.tolist(),
        # At least that of this process when it started the decoder.
        "decoder": round(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e6, 1),
    }


def _make(path: Path, codec: str, frames: int) -> None:
    """A video of the scene, its different frames forwards and backwards in turn."""
    pictures = _pictures()
    there_and_back = [*pictures, *pictures[-2:0:-1]]
    with av.open(path, "w") as container:
        stream = cast(VideoStream, container.add_stream(codec, rate=RATE, options=_OPTIONS.get(codec, {})))
        stream.width, stream.height = SIZE
        stream.pix_fmt = {"mjpeg": "yuvj420p", "ffv1": "gray"}.get(codec, "yuv420p")
        if codec == "mjpeg":
            stream.codec_context.qmin = stream.codec_context.qmax = 3
        for k in range(frames):
            picture = there_and_back[k % len(there_and_back)]
            frame = av.VideoFrame.from_ndarray(picture, "gray").reformat(format=stream.pix_fmt)
            frame.pts, frame.time_base = k, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


@cache
def _pictures() -> list[Picture]:
    history = history_of(_SCENE)
    times = START + np.arange(DRAWN) / RATE
    sensor = Sensor(Renderer(_SCENE, history.curve[0]), float(times[-1]), np.random.default_rng(1))
    return list(sensor.film(history, times))

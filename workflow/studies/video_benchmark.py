"""Processor time and memory of measuring a recording, up to its report; seconds of one that is rendered first."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import av
import numpy as np
import xarray as xr

from stripfold import elastica
from stripfold.measured import RecordingMeasurement
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.scene import Scene
from studies.common import command, dataset, processor_time, timed_process
from studies.recordings import scene_of

RATE = 60
REST = 1.9
"""Duration of a film apart from the gripper's way to lambda_c, s."""
BEFORE = 0.02
"""The gripper's way to lambda_c, m."""
_PIN = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
"""The decoder starts later and inherits this: both share one core."""
_MATERIAL = {"name": "eta3780", "eta_b": 3780.0, "eta_m": 1e-3}


def run(frames: int, repeats: int) -> xr.Dataset:
    """Measure h264 films of about ``frames`` and of four times as many frames ``repeats`` times each."""
    lengths = (frames, 4 * frames)
    rate, memory = np.empty((len(lengths), repeats)), np.empty(len(lengths))
    counts = []
    for j, length in enumerate(lengths):
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) / "film"
            counts.append(_make(folder, length))
            for k in range(repeats):
                before = processor_time()
                *_, memory[j] = timed_process(_PIN + command("measure", str(folder)))
                rate[j, k] = counts[j] / (processor_time() - before)
    moved, rendered, measured = _workflow()
    return dataset(
        "video_benchmark",
        {
            "rate": (("length", "run"), rate),
            "memory": ("length", memory),
            "length": ("length", counts),
            "motion_seconds": ((), moved),
            "render_seconds": ((), rendered),
            "measure_seconds": ((), measured),
        },
        {"size": "1280 x 720"},
    )


def _make(folder: Path, frames: int) -> int:
    """A recording whose film has about so many frames; how many."""
    scene = Scene.of(
        {
            "gripper": {"speed": BEFORE / (frames / RATE - REST)},
            "filming": {"size": [1280, 720], "frame_rate": RATE, "codec": "mpeg4", "container": "mp4", "quality": 2},
            "motion": {"before": BEFORE, "after": 0.5},
            "title": "benchmark",
        }
    )
    write_recording(history_of(scene), scene, folder)
    path, rendered = folder / "video.mp4", folder / "rendered.mp4"
    path.rename(rendered)
    with av.open(str(rendered)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream("libx264", rate=RATE, options={"crf": "20", "threads": "1"})
        stream.width, stream.height = scene.filming.size
        stream.pix_fmt = "yuv420p"
        for frame in source.decode(video=0):
            picture = av.VideoFrame.from_ndarray(frame.to_ndarray(), "yuv420p")
            target.mux(stream.encode(picture))
        target.mux(stream.encode())
        count = stream.frames
    rendered.unlink()
    return count


def _workflow() -> tuple[float, float, float]:
    """Seconds of the motion, of the film and of the measurement with its report, of a recording of the workflow."""
    scene = scene_of(_MATERIAL, 4.0, 1e-3, 0.03, 20.0, 1)
    elastica.critical(4.0)  # the compiled code is loaded
    began = perf_counter()
    history = history_of(scene)
    moved = perf_counter()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        write_recording(history, scene, folder)
        rendered = perf_counter()
        RecordingMeasurement.of(folder).report(folder / "report.html")
        return moved - began, rendered - moved, perf_counter() - rendered

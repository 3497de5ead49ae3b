"""Processor time and memory of measuring a recording, up to its report; seconds of one that is rendered first."""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import perf_counter

import av
import xarray as xr

from stripfold import elastica
from stripfold.film.measure import RecordingMeasurement
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.scene import Scene
from verification.common import command, dataset, processor_time, timed_process
from verification.numbers import Facts, Number
from verification.recordings import scene_of

UNITS = {"s": "motion render measure", "s-1": "rate"}

RATE = 60
REST = 1.9
"""Duration of a film apart from the gripper's way to lambda_c, s."""
BEFORE = 0.02
"""The gripper's way to lambda_c, m."""
_PIN = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
"""The decoder starts later and inherits this: both share one core."""
_MATERIAL = {"name": "eta3780", "eta_b": 3780.0, "eta_m": 1e-3}


def run(frames: int = 400, repeats: int = 1) -> xr.Dataset:
    """Measure an h264 film of about so many ``frames`` ``repeats`` times, and a recording of the workflow once."""
    with tempfile.TemporaryDirectory() as temporary:
        folder, rendered = Path(temporary) / "film", Path(temporary) / "rendered.mp4"
        _render(folder, frames, rendered)
        count = _encode(rendered, folder / "video.mp4")
        rate = []
        for _ in range(repeats):
            before = processor_time()
            timed_process(_PIN + command("measure", str(folder)))
            rate.append(count / (processor_time() - before))
    moved, rendering, measured = _workflow()
    return dataset(
        {
            "rate": ("run", rate),
            "frames": ((), count),
            "motion": ((), moved),
            "render": ((), rendering),
            "measure": ((), measured),
        },
        {"size": "1280 x 720"},
        UNITS,
    )


def _render(folder: Path, frames: int, rendered: Path) -> None:
    """A recording, and in a file of its own a film for it of about so many frames."""
    scene = Scene.of(
        {
            "speed": BEFORE / (frames / RATE - REST),
            "filming": {"size": [1280, 720], "frame_rate": RATE, "codec": "mpeg4", "container": "mp4", "quality": 2},
            "motion": {"before": BEFORE, "after": 0.5},
            "title": "benchmark",
        }
    )
    write_recording(history_of(scene), scene, folder)
    (folder / "video.mp4").rename(rendered)


def _encode(rendered: Path, path: Path) -> int:
    """Write a film as h264; the number of its frames."""
    with av.open(str(rendered)) as source, av.open(str(path), "w") as target:
        stream = target.add_stream("libx264", rate=RATE, options={"crf": "20", "threads": "1"})
        video = source.streams.video[0]
        stream.width, stream.height, stream.pix_fmt = video.width, video.height, "yuv420p"
        for frame in source.decode(video):
            picture = av.VideoFrame.from_ndarray(frame.to_ndarray(), "yuv420p")
            target.mux(stream.encode(picture))
        target.mux(stream.encode())
        return stream.frames


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


def facts(d: xr.Dataset) -> Facts:
    numbers = {name: d[name] for name in ("frames", "motion", "render", "measure")}
    return {"rate": d.rate.median(), "seconds": d.render + d.measure, **numbers}


# fmt: off
NUMBERS = {
    facts: (
        Number("tracking_rate", "rate", "1/s", ">= 150",
            "frames of 1280 x 720 (h264) over the processor time of the whole command `stripfold measure`, report "
            "included: film of {frames} frames, median of {d.sizes[run]} runs"),
        Number("measure_seconds", "seconds", "s", "<= 6",
            "a recording of the workflow rendered ({render:.1f} s) and measured with its report ({measure:.1f} s); its "
            "motion, a solution in time, takes {motion:.1f} s and does not count"),
    ),
}
# fmt: on

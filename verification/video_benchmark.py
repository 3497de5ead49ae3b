"""Speed of measuring a film: processor time of the whole command, its report included, and of each frame more."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import av
import xarray as xr

from stripfold.synthetic.recording import history_of, write_recording
from stripfold.synthetic.scene import Scene
from verification.common import command, dataset, processor_time, timed_process
from verification.numbers import Facts, Number

UNITS = {"s-1": "rate", "s": "time"}

RATE = 60
REST = 1.9
"""Duration of a film apart from the gripper's way to lambda_c, s."""
BEFORE = 0.02
"""The gripper's way to lambda_c, m."""
PIN = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
"""The decoder starts later and inherits this: both share one core."""


def run(frames: int = 400, repeats: int = 1, size: Sequence[int] = (1280, 720), short: int = 160) -> xr.Dataset:
    """Measure h264 films of about ``frames`` and ``short`` frames ``repeats`` times; ``size``: in pixels."""
    with tempfile.TemporaryDirectory() as temporary:
        films = [Path(temporary) / name for name in ("short", "long")]
        counts = [filmed(film, number, size) for film, number in zip(films, (short, frames), strict=True)]
        times = [[measured(film) for film in films] for _ in range(repeats)]
    rate = [(counts[1] - counts[0]) / (long - brief) for brief, long in times]
    return dataset(
        {"rate": ("run", rate), "time": ("run", [long for _, long in times]), "frames": ((), counts[1])}, units=UNITS
    )


def filmed(folder: Path, frames: int, size: Sequence[int]) -> int:
    """Write a recording of about so many ``frames`` as h264; the number that it has."""
    scene = Scene.of(
        {
            "speed": BEFORE / (frames / RATE - REST),
            "filming": {"size": list(size), "frame_rate": RATE, "codec": "mpeg4", "container": "mp4", "quality": 2},
            "motion": {"before": BEFORE, "after": 0.5},
            "title": "benchmark",
        }
    )
    write_recording(history_of(scene), scene, folder)
    rendered = (folder / "video.mp4").rename(folder / "rendered.mp4")
    return encode(rendered, folder / "video.mp4")


def measured(folder: Path) -> float:
    """Processor time in which a recording is measured, s."""
    before = processor_time()
    timed_process(PIN + command("measure", str(folder)))
    return processor_time() - before


def encode(rendered: Path, path: Path) -> int:
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


def facts(d: xr.Dataset) -> Facts:
    return {"rate": d.rate.median(), "time": d.time.median(), "length": d.frames / RATE}


# fmt: off
NUMBERS = {
    facts: (
        Number("tracking_rate", "rate", "1/s", ">= 150",
            "frames of 1280 x 720 (h264) over the processor time that they add to `stripfold measure`: film of "
            "{length:.1f} s against a short one, median of {d.sizes[run]} pairs"),
        Number("film_time", "time", "s", "<= 8",
            "processor time of the whole command, its report included, for the film of {length:.1f} s"),
    ),
}
# fmt: on

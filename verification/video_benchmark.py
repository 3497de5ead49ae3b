"""Speed of measuring a film: frames over the processor time of the whole command, its report included."""

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

UNITS = {"s-1": "rate"}

RATE = 60
REST = 1.9
"""Duration of a film apart from the gripper's way to lambda_c, s."""
BEFORE = 0.02
"""The gripper's way to lambda_c, m."""
PIN = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
"""The decoder starts later and inherits this: both share one core."""


def run(frames: int = 400, repeats: int = 1, size: Sequence[int] = (1280, 720)) -> xr.Dataset:
    """Measure an h264 film of about so many ``frames`` ``repeats`` times; ``size``: in pixels."""
    scene = Scene.of(
        {
            "speed": BEFORE / (frames / RATE - REST),
            "filming": {"size": list(size), "frame_rate": RATE, "codec": "mpeg4", "container": "mp4", "quality": 2},
            "motion": {"before": BEFORE, "after": 0.5},
            "title": "benchmark",
        }
    )
    with tempfile.TemporaryDirectory() as temporary:
        folder, rendered = Path(temporary) / "film", Path(temporary) / "rendered.mp4"
        write_recording(history_of(scene), scene, folder)
        (folder / "video.mp4").rename(rendered)
        count = encode(rendered, folder / "video.mp4")
        rate = []
        for _ in range(repeats):
            before = processor_time()
            timed_process(PIN + command("measure", str(folder)))
            rate.append(count / (processor_time() - before))
    return dataset({"rate": ("run", rate), "frames": ((), count)}, units=UNITS)


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
    return {"rate": d.rate.median(), "frames": d.frames}


# fmt: off
NUMBERS = {
    facts: (
        Number("tracking_rate", "rate", "1/s", ">= 150",
            "frames of 1280 x 720 (h264) over the processor time of the whole command `stripfold measure`, report "
            "included: film of {frames} frames, median of {d.sizes[run]} runs"),
    ),
}
# fmt: on

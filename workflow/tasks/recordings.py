"""Synthetic recordings, and the measurement of any recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.film.measure import RecordingMeasurement


def record(
    material: Mapping[str, Any],
    recordings: Sequence[Mapping[str, Any]],
    friction: float,
    length: float,
    output: Sequence[str],
    progress: Callable[[str], None],
) -> None:
    """Synthetic recordings of a material, as a folder each."""
    from stripfold.synthetic.recording import history_of, write_recording
    from verification.recordings import scene_of

    for of, folder in zip(recordings, output, strict=True):
        progress(f"{folder}: motion")
        scene = scene_of(material, of["height"], of["speed"], friction, length, of["number"])
        history = history_of(scene)
        progress(f"{folder}: film")
        write_recording(history, scene, Path(folder))


def measure(folders: Sequence[Path], output: Any, progress: Callable[[str], None]) -> list[xr.Dataset]:
    """Recordings measured; the page of each is written beside."""
    made = []
    for folder, page in zip(folders, output.report, strict=True):
        progress(str(folder))
        found = RecordingMeasurement.of(folder, progress)
        found.report(page)
        made.append(found.to_dataset())
    return made


def frames(folder: Path, measured: xr.Dataset) -> xr.Dataset:
    """The first frame of a synthetic recording, that at the onset of the snap, and the last."""
    from stripfold.film.video import read
    from verification.common import dataset

    with read(folder / "video.mkv") as film:
        every = [(frame.time, frame.image.copy()) for frame in film]
    times = np.array([time for time, _ in every])
    event = float(measured["event_time"])
    chosen = [0, int(np.abs(times - event).argmin()), len(every) - 1]
    values = {
        "frame": (("instant", "row", "column"), np.array([every[i][1] for i in chosen])),
        "instant": ("instant", times[chosen] - event),
    }
    return dataset(values, {"recording": str(measured.attrs["recording"])}, {"s": "instant"})

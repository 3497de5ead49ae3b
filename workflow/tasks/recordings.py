"""Synthetic recordings, and the measurement of any recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from stripfold import store
from stripfold.synthetic.recording import history_of, write_recording
from stripfold.vision import measure as measuring
from stripfold.vision import recording, report, results
from studies.recordings import scene_of


def record(
    material: Mapping[str, Any],
    of: Mapping[str, Any],
    friction: float,
    length: float,
    output: Sequence[str],
    progress: Callable[[str], None],
) -> None:
    """A synthetic recording of a material, as a folder."""

    scene = scene_of(material, of["height"], of["speed"], friction, length, of["number"])
    progress("motion")
    history = history_of(scene)
    progress("film")
    write_recording(history, scene, Path(output[0]))


def measure(folder: Path, output: Any, progress: Callable[[str], None]) -> xr.Dataset:
    """A recording measured; its page is written beside."""

    found = measuring.measure(recording.read(folder), progress)
    store.write_text(report.html(found), output.report)
    return results.as_dataset(found).assign_attrs(title=f"measured: {found.recording.entries.title}")

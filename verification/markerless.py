"""lambda without a marker and without a robot's log: a template of the gripper, given by a box in the first frame.

The recordings are those of :mod:`.camera_bump` before their camera is moved.  The box is about where the marker's card
is, which serves as a part of the gripper whose pattern is unknown.
"""

from __future__ import annotations

import csv
import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import yaml

from stripfold.base.arrays import Array
from stripfold.film import recording, video
from stripfold.film.calibration import calibrate_folder
from stripfold.film.holder import Marker
from stripfold.film.measure import RecordingMeasurement, measure
from stripfold.film.recording import NAME
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, covers, seed_of, share
from verification.recordings_common import event_of, write_still

UNITS = {"m": "event high low truth"}

BOX = 0.55, 0.75
"""Half sides of the box, relative to the marker's side: within its white rim, and beyond it."""
OFF = 0.1
"""By how much the box's middle misses the marker's, relative to its side."""


def run(cases: int = 4, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Measure ``cases`` recordings by a template; a dataset over ``case``."""
    rows = pooled(partial(measured, seed=seed), range(cases), threads, progress)
    return table("case", rows, {"seed": seed}, units=UNITS)


def measured(number: int, seed: int) -> dict[str, Any]:
    """The recording of this number, rendered, and measured by a template."""
    rng, chain = np.random.default_rng([seed, number, 6]), number % 2 == 1
    row: dict[str, Any] = {"case": number, "generator": "chain" if chain else "shapes", "message": "", "flags": ""}
    row |= dict.fromkeys(("event", "low", "high", "truth"), np.nan)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(lambda: write_still(number, seed, folder, chain))
        if message:
            return row | {"message": message}
        known = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        row["truth"] = known["lambda"] if chain else event_of(folder)[1]
        found, message = attempted(lambda: _by_template(folder, rng))
    if found is None or not found.snapped:
        return row | {"message": message or "no snap was seen"}
    low, high = found.interval
    return row | {"event": found.event, "low": low, "high": high, "flags": "; ".join(map(str, found.flags))}


def _by_template(folder: Path, rng: np.random.Generator) -> RecordingMeasurement:
    describe(folder, rng)
    return measure(folder)


def describe(folder: Path, rng: np.random.Generator) -> None:
    """Describe a template in place of the marker: a box around it, not quite in its middle."""
    asked = recording.read(folder)
    assert asked.entries.gripper.marker is not None
    marker = asked.entries.gripper.marker
    mapping = calibrate_folder(folder, asked.entries).mapping
    with video.read(asked.video, asked.timestamps) as film:
        corners = Marker(marker.dictionary, marker.id).corners(next(film).image)
    assert corners is not None
    side = float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).mean())
    half = np.rint(rng.uniform(*BOX, 2) * side)
    low = np.rint(corners.mean(axis=0) + rng.uniform(-OFF, OFF, 2) * side - half).astype(int)
    size = (2 * half).astype(int)
    places: Array = mapping.to_robot(np.array([corners.mean(axis=0), low + 0.5 * (size - 1.0)]))
    away = places[1] - places[0]
    told = yaml.safe_load((folder / NAME).read_text(encoding="utf-8"))
    offset = (np.array(marker.offset) - away).tolist()
    del told["gripper"]["marker"], told["robot_log"]
    told["gripper"]["template"] = {"box": [*low.tolist(), *size.tolist()], "offset": offset, "offset_uncertainty": 0.0}
    (folder / NAME).write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    grid = folder / told["robot"]["grid"]
    with grid.open(encoding="utf-8", newline="") as opened:
        header, *rows = csv.reader(opened)
    lines = [",".join(header)]
    lines += [f"{name},{float(x) + away[0]:.6f},{float(z) + away[1]:.6f}" for name, x, z in rows]
    grid.write_text("\n".join(lines) + "\n", encoding="utf-8")


def facts(d: xr.Dataset) -> Facts:
    """In mm."""
    off, inside = 1e3 * (d.event - d.truth).values, (d.low <= d.truth) & (d.truth <= d.high)
    known = np.isfinite(off)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "measured": known.sum(),
        "share": share(inside.values[known]),
        "rms": np.sqrt(np.mean(off[known] ** 2)) if known.any() else np.nan,
        "half": np.median(5e2 * (d.high - d.low).values[known]) if known.any() else np.nan,
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("markerless_coverage", "share", "1", ">= 0.85",
            "share of the 95 % intervals of lambda that contain the truth, {measured} measured of {cases} recordings "
            "without a marker and without a robot's log, by a template ({seed}); root mean square error {rms:.2f} mm, "
            "median half width {half:.2f} mm", lambda f: covers(f.share, f.measured, 0.85, 1.0)),
    ),
}
# fmt: on

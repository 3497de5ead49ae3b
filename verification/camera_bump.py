"""Recordings whose camera was moved between its calibration and the film, or during the film: whether that is noticed.

The frames of a synthetic recording are shifted from some moment on and written as pictures; there is no robot's log.
Every second recording is of the second generator (:mod:`second_generator`).
"""

from __future__ import annotations

import shutil
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import xarray as xr
import yaml

from stripfold.base.arrays import Array
from stripfold.film import camera_motion, recording, video
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.recording import NAME
from verification.common import Progress, attempted, pooled, table
from verification.numbers import Facts, Number, seed_of
from verification.recordings_common import measure_with, write_still

SIZES = 3.0, 10.0
"""Least and largest shift, pixels."""
LABEL = 0.05, 0.25
"""Height and width of the corner that a recorder writes on, as shares of the picture's: it does not move."""


def run(cases: int = 6, seed: int = 1, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Move the camera in ``cases`` recordings, half of them before the film; a dataset over ``case``."""
    with tempfile.TemporaryDirectory() as folder:
        one = partial(moved, seed=seed, calibrations=Path(folder))
        rows = [row for pair in pooled(one, range(-(-cases // 2)), threads, progress) for row in pair]
    return table("case", rows[:cases], {"seed": seed})


def moved(number: int, seed: int, calibrations: Path) -> list[dict[str, Any]]:
    """A recording whose camera is moved before its film, and once more in its film."""
    rng = np.random.default_rng([seed, number, 4])
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        still = Path(temporary) / "still"
        chain = number % 2 == 1
        camera = (calibrations, f"{number}")
        _, message = attempted(lambda: write_still(number, seed, still, chain))
        for before in (True, False):
            size, angle = rng.uniform(*SIZES), rng.uniform(0.0, 2.0 * np.pi)
            shift = size * np.array([np.cos(angle), np.sin(angle)])
            share = 0.0 if before else rng.uniform(0.02, 0.98)
            row = {"generator": "chain" if chain else "shapes", "before": before, "size": size, "share": share}
            said = message
            if not message:
                folder = Path(temporary) / ("before" if before else "during")
                write_moved(still, folder, shift, share)
                found, said = attempted(partial(_measured, folder, camera))
                said = said if found is None else "; ".join(map(str, found.flags))
            noticed = camera_motion.MOVED_BY in said
            rows.append({"case": 2 * number + (not before), **row, "noticed": float(noticed), "message": said})
    return rows


def _measured(folder: Path, camera: tuple[Path, str]) -> RecordingMeasurement:
    return measure_with(recording.read(folder), camera)


def write_moved(still: Path, folder: Path, shift: Array, share: float) -> None:
    """A copy of a recording in a new folder, its frames shifted, pixels, after a share of the film."""
    told = yaml.safe_load((still / NAME).read_text(encoding="utf-8"))
    folder.mkdir()
    shutil.copytree(still / "calibration", folder / "calibration")
    (folder / "frames").mkdir()
    stamps = still / told["timestamps"] if "timestamps" in told else None
    with video.read(still / told["video"], stamps) as film:
        frames = list(film)
    first = frames[0].time + share * (frames[-1].time - frames[0].time)
    lines = ["frame,t"]
    for frame in frames:
        seen = frame.image
        if frame.time >= first:
            matrix = np.column_stack([np.eye(2), shift])
            seen = cv2.warpAffine(
                seen, matrix, seen.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
            )
            high, wide = (-int(part * side) for part, side in zip(LABEL, seen.shape, strict=True))
            seen[high:, wide:] = frame.image[high:, wide:]
        cv2.imwrite(str(folder / "frames" / f"{frame.index:05d}.png"), seen)
        lines.append(f"{frame.index},{frame.time:.6f}")
    (folder / "timestamps.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    told |= {"video": "frames", "timestamps": "timestamps.csv"}
    told.pop("robot_log")
    (folder / NAME).write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")


def facts(d: xr.Dataset) -> Facts:
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "noticed": d.noticed.sum(),
        "before": d.before.sum(),
        "chain": np.sum(d.generator.values == "chain"),
        "share": d.noticed.mean(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("camera_bump", "share", "1", "= 1",
            "share of {cases} moves of the camera by 3 to 10 pixels ({seed}) that are noticed, {before} between its "
            "calibration and the film, the others in the film; {chain} of the second generator",
            lambda f: f.noticed == f.cases),
    ),
}
# fmt: on

"""What studies of recordings share: writing one of either generator, measuring it, and the truth of its event."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np

from stripfold.files import store
from stripfold.film import measure
from stripfold.film.calibration import Calibration, calibrate_folder
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.recording import Recording
from stripfold.film.tracking import track
from stripfold.synthetic import recording as synthetic
from verification.recordings_design import case as design_case
from verification.second_generator.recording import Design
from verification.second_generator.recording import write_calibration as write_chain_calibration

RAISED, SWING, FOLLOWING = 0.1, 0.35, 0.4
"""Height, over the gripper's, from which a point is raised; for how long, s, the strip swings after its gripper has
started; share of the time to the fastest motion in which it follows."""
_CALIBRATIONS: dict[tuple[Path, str], Calibration] = {}
"""Of each camera, in a folder of calibrations: its recordings share one."""


def measure_with(asked: Recording, camera: tuple[Path, str]) -> RecordingMeasurement:
    """As :func:`.measure.measure` does it, with the calibration of a camera evaluated once."""
    if camera not in _CALIBRATIONS:
        _CALIBRATIONS[camera] = calibrate_folder(asked.folder, asked.entries)
    tracks = track(asked, _CALIBRATIONS[camera])
    return measure.evaluate(asked, _CALIBRATIONS[camera], tracks)


def event_of(folder: Path) -> tuple[float, float]:
    """Onset, s, and lambda then, m, of the motion itself.

    The root of its kinetic energy, of the part of the strip that is raised at first, rises half-way from its median
    while the strip follows the gripper to its first peak: its maximum before it has halved, once the layers touch.
    """
    truth = store.read(folder / "truth.nc", ("time", "advance", "curve"))
    touch = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["events"]["touch"]["t"]
    t, lam, curve = truth["time"].values, truth["advance"].values, truth["curve"].values.astype(np.float64)
    height = curve[0, :, 1]
    raised = slice(0, int(np.flatnonzero(height > RAISED * height[0])[-1]) + 1)
    speed = np.sqrt(np.mean(np.sum(np.gradient(curve[:, raised], t, axis=0) ** 2, axis=2), axis=1))
    rate = np.gradient(lam, t)
    steady = t[np.flatnonzero(rate > 0.8 * rate.max())[0]] + SWING
    used = t >= steady
    t, lam, speed = t[used], lam[used], speed[used]
    # The touch brakes a part of the strip: the rest may go on accelerating.
    ended = np.flatnonzero((t > touch) & (speed < 0.5 * np.maximum.accumulate(speed)))
    peak = int(np.argmax(speed[: int(ended[0])] if len(ended) else speed))
    following = np.median(speed[: max(int(FOLLOWING * peak), 1)])
    last = int(np.flatnonzero(speed[:peak] < 0.5 * (following + speed[peak]))[-1])
    return float(t[last]), float(lam[last])


def write_still(number: int, seed: int, folder: Path, chain: bool) -> None:
    """A recording of either generator in a new folder, with its own calibration."""
    if not chain:
        scene = design_case(number, seed).scene
        synthetic.write_recording(synthetic.history_of(scene), scene, folder)
        return
    design = Design(number, seed)
    with tempfile.TemporaryDirectory() as calibration:
        write_chain_calibration(design.factors["camera"], seed, Path(calibration), design.tones)
        design.write(folder, Path(calibration))

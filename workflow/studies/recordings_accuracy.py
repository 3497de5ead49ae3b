"""The accuracy of measured values of lambda, from many small synthetic recordings, each with its truth.

The recordings are rendered, encoded and measured like any other.  The truth is from the kinetic energy of the motion
itself: the detector (:mod:`stripfold.film.snap`), with its window and its robust speed, has no part in it.
Where a strip moves by mechanics behind a slow gripper, eta_b by its motion is compared with the true one: with no
friction described, and with its friction, to an error as of a bending test, and an eta_b that is wrong.
Every fourth recording is of the second generator (:mod:`second_generator`), which brings its own truth.
"""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.base.arrays import Array
from stripfold.base.material import GRAVITY, Material
from stripfold.film import eta_motion, measure, recording
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.measure import RecordingMeasurement
from stripfold.film.recording import Entries, Recording
from studies.common import Progress, attempted, pooled, table
from studies.recordings_chain import ChainCase, is_chain
from studies.recordings_common import event_of, measure_with
from studies.recordings_design import Case, case

MEASURED, BOUND, REFUSED, NOT_MADE = "measured", "bound", "refused", "not made"
"""Outcomes: a value; a bound, since no snap was seen; an error of the measurement; one of the motion or the film."""
_NUMBERS = (
    "event",
    "truth",
    "sd",
    "ratio",
    "speed",
    "seconds_off",
    "tracked",
    "clock_offset",
    "clock_truth",
    "clock_sd",
    "moment",
    "fitted_moment",
)
ETA = "eta", "low", "high"
"""eta_b by the motion and the ends of its interval, over the true one; "fitted_" before: with no friction described."""
WRONG = 0.7, 1.4
"""Described eta_b over the true one."""
FRICTION_SD = 0.1
"""Standard deviation of the described friction, as a share."""
RHO_A = 0.2
"""Described areal density, kg m^-2: friction over it matters."""


def run(cases: int, seed: int, dynamics: float, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Render and measure the first cases of a design, see :func:`.recordings_design.case`; a dataset over ``case``."""
    with tempfile.TemporaryDirectory() as folder:
        # Before the processes start: two of them would render the same calibration.
        cameras = {asked.camera: asked for asked in (_case(number, seed, dynamics) for number in range(cases))}
        for asked in cameras.values():
            attempted(partial(asked.write_calibration, Path(folder)))
        one = partial(measured, seed=seed, dynamics=dynamics, calibrations=Path(folder))
        rows = pooled(one, range(cases), threads, progress)
    return table("recordings_accuracy", "case", rows, {"seed": seed, "dynamics": dynamics})


def measured(number: int, seed: int, dynamics: float, calibrations: Path) -> dict[str, Any]:
    """The case of this number, rendered and measured; ``calibrations`` is a folder that cases share."""
    asked = _case(number, seed, dynamics)
    numbers = *_NUMBERS, *ETA, *map("fitted_{}".format, ETA)
    row = {"case": number, **dict.fromkeys(numbers, np.nan), "message": "", "flags": "", **asked.factors}
    row |= {"generator": asked.generator, "sound": float(asked.sound), "moment": asked.moment}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(lambda: asked.write(folder, calibrations))
        if message:
            return row | {"outcome": NOT_MADE, "message": message}
        found, message = attempted(lambda: measure_with(recording.read(folder), (calibrations, asked.camera)))
        if found is None:
            return row | {"outcome": REFUSED, "message": message}
        if np.isfinite(asked.moment):
            row |= _ratios("fitted_", found, asked)
            told = _described(recording.read(folder), asked, np.random.default_rng([seed, number, 4]))
            again, _ = attempted(partial(measure.evaluate, told, found.calibration, found.tracks))
            row |= _ratios("", again, asked)
        known = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        onset, truth = asked.truth(folder) if isinstance(asked, ChainCase) else event_of(folder)
    # What moves without mechanics has no shape of a strip.
    expected = [eta_motion.doubted(found.eta_b)] if asked.generator == "shapes" else []
    if found.clock is not None:
        row |= {"clock_offset": found.clock.offset, "clock_truth": known["clock_offset"], "clock_sd": found.clock.sd}
    return row | {
        "outcome": MEASURED if found.snapped else BOUND,
        "event": found.event,
        "truth": truth,
        "sd": found.sd,
        "ratio": found.motion.ratio,
        "speed": found.speed,
        "seconds_off": found.event_time - onset,
        "flags": "; ".join(str(flag) for flag in found.flags if flag.text not in expected),
        "tracked": float(np.mean(found.tracks.score > 0.0)),
    }


def _described(told: Recording, asked: Case | ChainCase, random: np.random.Generator) -> Recording:
    """The same recording with a wrong eta_b of the strip, and its friction as of a bending test."""
    eta_b = asked.factors["eta_b"]
    true = asked.moment * RHO_A * GRAVITY * Material(eta_b).gravity_length ** 2
    strip = {"eta_b": eta_b * float(np.exp(random.uniform(*np.log(WRONG)))), "rho_a": RHO_A}
    strip["friction_moment"] = true * float(np.exp(random.normal(0.0, FRICTION_SD)))
    entries = told.entries.model_dump(mode="json", exclude_unset=True)
    return Recording(told.folder, Entries.of(entries | {"strip": entries["strip"] | strip}))


def _ratios(kind: str, found: RecordingMeasurement | None, asked: Case | ChainCase) -> dict[str, float]:
    """The numbers of :data:`ETA`, and M_0 where it is fitted; none where there is no eta_b."""
    if found is None or not isinstance(found.eta_b, MotionEtaB):
        return {}
    values = found.eta_b.eta_b, found.eta_b.low, found.eta_b.high
    ratios = {kind + name: value / asked.factors["eta_b"] for name, value in zip(ETA, values, strict=True)}
    return ratios if found.eta_b.known else ratios | {"fitted_moment": found.eta_b.friction}


def _case(number: int, seed: int, dynamics: float) -> Case | ChainCase:
    return ChainCase(number, seed) if is_chain(number) else case(number, seed, dynamics)


def error(data: xr.Dataset) -> Array:
    """Measured minus true lambda of the measured cases, m, shape (n,)."""
    chosen = data["outcome"].values == MEASURED
    return np.asarray((data["event"] - data["truth"]).values[chosen], dtype=np.float64)

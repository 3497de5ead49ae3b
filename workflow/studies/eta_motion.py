"""eta_b from the motion of strips before they snap, in synthetic recordings of strips with known eta_b and friction.

The motions are from the project's dynamics of a strip that stretches, in air, with friction; the fit knows of friction
only.  The described eta_b is wrong at random: the fit must not lean on it.  Each recording is measured twice: with the
friction described, to an error drawn at random as of a bending test, and with none described.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stripfold.material import GRAVITY
from stripfold.synthetic import recording as synthetic
from stripfold.synthetic.scene import DynamicsMotion, Scene
from stripfold.vision import measure, recording
from stripfold.vision.eta_motion import MotionEtaB
from stripfold.vision.measurement import Measurement
from stripfold.vision.recording import Entries, Recording
from studies.common import Progress, attempted, pooled, table
from studies.recordings_common import measure_with
from studies.recordings_design import _TONES, CAMERAS

ETA_B = 2500.0, 7000.0
"""m^-4 s^2: L* of 24 to 34 mm."""
HEIGHTS, HIGHEST = (3.0, 4.5), 0.15
"""L*; largest height in the pictures, m."""
FRICTIONS = 0.0, 0.01, 0.02, 0.03
"""M_0, rho_a g L*^2: with 0.05 the sag touches before the strip snaps at the least of these heights."""
BEFORE = 0.4, 0.7, 1.0
"""Start of the film before the static limit, L*."""
PACES = (0.002, 15.0), (0.002, 20.0), (0.003, 20.0), (0.004, 25.0)
"""Speed, m/s, and frame rate, 1/s."""
WRONG = 0.7, 1.4
"""Described eta_b over the true one."""
FRICTION_SD = 0.1
"""Standard deviation of the described friction, as a share."""
RHO_A = 0.2
"""Described areal density, kg m^-2: friction over it matters."""
PARTS = "eta", "low", "high"


def run(cases: int, seed: int, threads: int = 1, progress: Progress | None = None) -> xr.Dataset:
    """Render and measure ``cases`` recordings; a dataset over ``case``."""
    with tempfile.TemporaryDirectory() as folder:
        for i, camera in enumerate(CAMERAS[:cases]):
            scene = Scene.of({"filming": camera, "seed": seed + i})
            attempted(partial(synthetic.write_calibration, scene, Path(folder) / f"camera-{i}"))
        rows = pooled(partial(measured, seed=seed, calibrations=Path(folder)), range(cases), threads, progress)
    return table("eta_motion", "case", rows, {"seed": seed})


def scene_of(number: int, seed: int) -> Scene:
    """The recording of this number."""
    random = np.random.default_rng([seed, number])
    eta_b = float(np.exp(random.uniform(*np.log(ETA_B))))
    unit = (eta_b * GRAVITY) ** (-1.0 / 3.0)
    speed, rate = PACES[int(random.integers(len(PACES)))]
    strip, filming = _TONES[int(random.integers(len(_TONES)))]
    noise = float(random.choice([0.5, 1.5, 3.0]))
    return Scene.of(
        {
            "strip": {"eta_b": eta_b, "width": float(random.choice([0.015, 0.03, 0.045])), **strip},
            "gripper": {
                "height": min(float(random.uniform(*HEIGHTS)) * unit, HIGHEST),
                "speed": speed,
                "finger": float(random.choice([0.003, 0.01])),
            },
            "filming": {
                **CAMERAS[number % len(CAMERAS)],
                **filming,
                "codec": "mjpeg",
                "frame_rate": rate,
                "read_noise": noise,
                "shot_noise": 0.7 * noise,
                "defocus": float(random.choice([0.4, 0.8, 1.3])),
                "log_offset": 0.2,
            },
            "generator": "dynamics",
            "motion": {
                "friction": float(random.choice(FRICTIONS)),
                "before": float(random.choice(BEFORE)) * unit,
                "after": 0.4,
                "model": "rod",
                "refinement": 1.0,
            },
            "seed": int(random.integers(2**31)),
            "title": f"synthetic recording {number} of seed {seed}",
        }
    )


def measured(number: int, seed: int, calibrations: Path) -> dict[str, Any]:
    """The recording of this number, rendered and measured; ratios to the truth."""
    scene, random = scene_of(number, seed), np.random.default_rng([seed, number, 1])
    assert isinstance(scene.motion, DynamicsMotion)
    strip, moment = scene.strip, scene.motion.friction
    row: dict[str, Any] = {kind + part: np.nan for kind in ("", "fitted_") for part in PARTS}
    row |= {"case": number, "height": scene.gripper.height / strip.gravity_length, "moment": moment}
    row |= {"fitted_moment": np.nan, "depth": np.nan, "message": ""}
    camera = f"camera-{number % len(CAMERAS)}"
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recording"
        _, message = attempted(
            lambda: synthetic.write_recording(synthetic.history_of(scene), scene, folder, calibrations / camera)
        )
        if message:
            return row | {"message": message}
        asked = recording.read(folder)
        wrong = {"eta_b": strip.eta_b * float(np.exp(random.uniform(*np.log(WRONG))))}
        known = moment * RHO_A * GRAVITY * strip.gravity_length**2 * float(np.exp(random.normal(0.0, FRICTION_SD)))
        described = _described(asked, wrong | {"hysteresis": known, "rho_a": RHO_A})
        found, message = attempted(lambda: measure_with(described, (calibrations, camera)))
        if found is None:
            return row | {"message": message}
        other = measure.evaluate(_described(asked, wrong), found.calibration, found.tracks)
    return row | _ratios("", found, strip.eta_b) | _ratios("fitted_", other, strip.eta_b) | _details(other, strip.width)


def _described(asked: Recording, strip: Mapping[str, float]) -> Recording:
    entries = asked.entries.model_dump(mode="json", exclude_unset=True)
    return Recording(asked.folder, Entries.of(entries | {"strip": entries["strip"] | strip}))


def _ratios(kind: str, found: Measurement, truth: float) -> dict[str, Any]:
    """eta_b and the ends of its interval over the truth, or why there is none."""
    if not isinstance(found.eta_b, MotionEtaB):
        return {"message": str(found.eta_b)}
    values = (found.eta_b.eta_b, found.eta_b.low, found.eta_b.high)
    return {kind + part: value / truth for part, value in zip(PARTS, values, strict=True)}


def _details(found: Measurement, width: float) -> dict[str, float]:
    if not isinstance(found.eta_b, MotionEtaB):
        return {}
    return {"fitted_moment": found.eta_b.friction, "depth": found.eta_b.depth / width}

"""Many small synthetic recordings that differ in every factor that could disturb a measurement.

The design is a Latin hypercube in blocks: within each block of :data:`BLOCK` numbers every factor takes each of its
values about equally often.  The same number and seed give the same recording.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from stripfold.base.material import GRAVITY
from stripfold.synthetic import recording
from stripfold.synthetic.scene import DynamicsMotion, Filming, Scene

BLOCK = 40
CAMERAS: tuple[dict[str, Any], ...] = (
    {"size": [320, 240], "distortion": [-0.1, 0.03, 0.0, 0.0], "tilt": 4.0},
    {"size": [320, 240], "distortion": [0.05, -0.02, 1e-3, 0.0], "tilt": 2.5, "yaw": 3.0, "roll": -1.5},
    {"size": [400, 300], "distortion": [-0.2, 0.06, 0.0, -1e-3], "tilt": 6.0, "distance": 0.6},
    {"size": [400, 300], "distortion": [-0.05, 0.0, 5e-4, 5e-4], "tilt": 3.0, "yaw": -5.0, "behind": True},
    {"size": [400, 300], "distortion": [-0.12, 0.02, 0.0, 0.0], "tilt": 5.0, "roll": 2.5, "distance": 1.3},
    {"size": [480, 360], "distortion": [-0.15, 0.05, -1e-3, 1e-3], "tilt": 4.0, "board": "charuco"},
    {"size": [480, 360], "distortion": [0.0, 0.0, 0.0, 0.0], "tilt": 3.0, "yaw": 4.0, "board": "charuco"},
    {"size": [480, 360], "distortion": [-0.08, 0.01, 0.0, 1e-3], "tilt": 7.0, "roll": 1.0, "behind": True},
)
"""Each is calibrated once in a design."""
_TONES = (
    ({"grey": 0.85, "edge": 0.95}, {"background": 0.22, "table": 0.32}),
    ({"grey": 0.1, "edge": 0.14}, {"background": 0.75, "table": 0.65}),
)
_FILES: tuple[dict[str, Any], ...] = (
    {"codec": "ffv1", "container": "mkv"},
    {"codec": "mjpeg", "container": "mkv", "quality": 3},
    {"codec": "mpeg4", "container": "mp4", "quality": 3},
    {"codec": "mjpeg", "container": "avi", "quality": 7, "timestamps": True},
)
_PACES = (
    (0.002, 15.0),
    (0.002, 20.0),
    (0.004, 20.0),
    (0.004, 30.0),
    (0.006, 25.0),
    (0.006, 40.0),
    (0.01, 30.0),
    (0.01, 50.0),
)
"""Speed, m/s, and frame rate, 1/s, of recordings of about a hundred frames; at higher speeds no snap stands out."""
_MOTIONS: tuple[dict[str, Any], ...] = (
    {"law": "parabolic"},
    {"law": "parabolic", "inertia": 0.0, "drag": 0.15},
    {"law": "cubic", "cubic": 0.4, "inertia": 0.05},
    {"law": "power", "exponent": 0.42, "inertia": 0.05},
    {"law": "power", "exponent": 0.6},
    {"law": "two_modes"},
    {"law": "two_modes", "drag": 0.2, "inertia": 0.04},
)
SLOW = 0.004
"""Largest speed of the gripper for which docs/measuring.md promises its accuracy, m/s."""
FRICTIONS = (0.0, 0.01, 0.02)
"""M_0 of the motions from dynamics, rho_a g L*^2."""
BEFORE = 0.7
"""Start of the film of a slow one of them before the static limit, L*: its shapes give eta_b."""
FACTORS: Mapping[str, Sequence[Any]] = {
    "camera": range(len(CAMERAS)),
    "tone": range(len(_TONES)),
    "file": range(len(_FILES)),
    "pace": range(len(_PACES)),
    "motion": range(len(_MOTIONS)),
    "height": (3.0, 3.4, 3.8),
    "eta_b": (3000.0, 3800.0, 5500.0),
    "noise": (0.5, 1.5, 3.0),
    "defocus": (0.4, 0.8, 1.3),
    "exposure": (0.001, 0.005, 0.012),
    "rolling_shutter": (0.0, 0.008, 0.02),
    "light": (0.9, 0.6, 0.35),
    "gradient": (0.0, 0.3),
    "flicker": (0.0, 0.05),
    "shadow": (0.0, 0.0, 0.3),
    "occluder": (0.0, 0.0, 0.0, 0.008),
    "finger": (0.003, 0.01),
    "hairs": (0.0, 500.0),
    "jitter": (0.0, 0.12),
    "dropped": (0.0, 0.04),
    "dropped_at_event": (0, 0, 3),
    "doubled": (0.0, 0.04),
}
"""Every factor and its values; height in L*, noise in grey values, the rest as in a scene."""


class Case(NamedTuple):
    """One recording of the design of a seed: its scene, and the value of each of :data:`FACTORS`."""

    scene: Scene
    factors: Mapping[str, Any]
    seed: int

    @property
    def sound(self) -> bool:
        """Whether it is filmed as docs/measuring.md asks: a slow gripper, nothing passes, no frame lost at the snap."""
        disturbed = any(self.factors[name] for name in ("shadow", "occluder", "dropped_at_event"))
        return self.scene.speed <= SLOW and not disturbed

    @property
    def generator(self) -> str:
        """Name of the generator of the motion."""
        return str(self.scene.generator)

    @property
    def moment(self) -> float:
        """M_0, rho_a g L*^2, where the strip moves by mechanics and its gripper slowly: shapes give eta_b; else nan."""
        motion = self.scene.motion
        if isinstance(motion, DynamicsMotion) and self.scene.speed <= SLOW:
            return motion.friction_moment_star
        return nan

    @property
    def camera(self) -> str:
        """Name of the camera: cases with the same share a calibration."""
        return f"camera-{self.factors['camera']}"

    def write_calibration(self, calibrations: Path) -> Path:
        """The calibration of the camera, rendered into its place in a folder unless it is there."""
        kept = calibrations / self.camera
        if not kept.exists():
            camera = self.factors["camera"]
            # Anew for each design: the errors of a calibration are those of all recordings of its camera.
            drawn = int(np.random.default_rng([self.seed, camera]).integers(2**31))
            recording.write_calibration(Scene.of({"filming": CAMERAS[camera], "seed": drawn}), kept)
        return kept

    def write(self, folder: Path, calibrations: Path) -> None:
        """Render it into a new folder, with its camera's calibration from ``calibrations``."""
        kept = self.write_calibration(calibrations)
        recording.write_recording(recording.history_of(self.scene), self.scene, folder, kept)


def case(number: int, seed: int, dynamics: float = 0.0) -> Case:
    """One case of the design.

    ``number``: from 0.  ``seed``: of the whole design.  ``dynamics``: share of the cases whose motion is from the
    project's own dynamics; the others move without mechanics.
    """
    block, row = divmod(number, BLOCK)
    sampler = qmc.LatinHypercube(len(FACTORS), rng=np.random.default_rng([seed, block]))
    drawn = sampler.random(BLOCK)[row]
    factors = {
        name: values[int(share * len(values))] for (name, values), share in zip(FACTORS.items(), drawn, strict=True)
    }
    rng = np.random.default_rng([seed, block, row])
    speed, frame_rate = _PACES[factors["pace"]]
    strip_grey, filming_grey = _TONES[factors["tone"]]
    if (number * dynamics) % 1.0 + dynamics < 1.0:
        # About a hundred frames, of which those at rest, at the snap and after it take two seconds.
        before = float(np.clip(speed * (100.0 / frame_rate - 2.0), 0.008, 0.028))
        generator, motion = "shapes", {**_MOTIONS[factors["motion"]], "before": before, "after": 0.8}
    else:
        friction = FRICTIONS[number % len(FRICTIONS)]
        unit = (factors["eta_b"] * GRAVITY) ** (-1.0 / 3.0)
        before = BEFORE * unit if speed <= SLOW else 0.01
        generator, motion = "dynamics", {"friction_moment_star": friction, "before": before, "after": 0.5}
    scene = {
        "eta_b": factors["eta_b"],
        "height": round(factors["height"] * (factors["eta_b"] * 9.81) ** (-1 / 3), 4),
        "speed": speed,
        "strip": {"hairs": factors["hairs"], **strip_grey},
        "gripper": {"finger": factors["finger"]},
        "filming": {
            **CAMERAS[factors["camera"]],
            **filming_grey,
            **_FILES[factors["file"]],
            **{name: value for name, value in factors.items() if name in Filming.model_fields},
            "frame_rate": frame_rate,
            "read_noise": factors["noise"],
            "shot_noise": 0.7 * factors["noise"],
            "log_offset": float(rng.uniform(-0.5, 0.5)),
            "log_rate": float(rng.choice([50.0, 100.0, 125.0])),
        },
        "generator": generator,
        "motion": motion,
        "seed": int(rng.integers(2**31)),
        "title": f"synthetic recording {number} of design {seed}",
    }
    return Case(Scene.of(scene), factors, seed)

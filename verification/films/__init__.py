"""Films of known truth: their design, of the package's generator and of the second one, which shares nothing with it.

The design spreads its factors over the films, by blocks of :data:`BLOCK` numbers: in each every factor takes each of
its values about equally often.  The same number and seed give the same film.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from stripfold.base.arrays import Array
from stripfold.base.material import GRAVITY
from stripfold.files import store
from stripfold.synthetic import recording
from stripfold.synthetic.scene import Filming, Scene
from verification.films.second.recording import Design
from verification.films.second.recording import write_calibration as write_chain_calibration

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
CHAIN = "chain"
"""Name of the second generator."""
RAISED, SWING, FOLLOWING = 0.1, 0.35, 0.4
"""Height, over the gripper's, from which a point is raised; for how long, s, the strip swings after its gripper has
started; share of the time to the fastest motion in which it follows."""
SLOW = 0.004
"""Largest speed of the gripper for which docs/measuring.md promises its accuracy, m/s."""
TWISTED = 8e-4
"""Way of the strip's edge by a twist from which it counts as one, m."""
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


class Film(NamedTuple):
    """A film that can be written, see :func:`film`.

    ``camera``: films with the same share a calibration; ``sound``: filmed as docs/measuring.md asks: a slow gripper, no
    twist, nothing passes, no frame lost at the snap; ``moment``: M_0, rho_a g L*^2, where the strip moves by mechanics
    and its gripper slowly, so that shapes give eta_b; else nan; ``calibrated``: the scene in which the camera is
    calibrated.
    """

    scene: Scene | Design
    eta_b: float
    camera: str
    seed: int
    calibrated: Scene | None = None
    sound: bool = True
    moment: float = nan

    @property
    def generator(self) -> str:
        """Name of the generator of the motion."""
        return CHAIN if isinstance(self.scene, Design) else str(self.scene.generator)

    def write_calibration(self, calibrations: Path) -> Path:
        """Render the calibration of the camera into its place in a folder, unless it is there."""
        kept = calibrations / self.camera
        if kept.exists():
            return kept
        if isinstance(self.scene, Design):
            write_chain_calibration(self.scene.factors["camera"], self.seed, kept)
        elif self.calibrated is not None:
            recording.write_calibration(self.calibrated, kept)
        return kept

    def write(self, folder: Path, calibrations: Path) -> None:
        """Render it into a new folder, with its camera's calibration from ``calibrations``."""
        kept = self.write_calibration(calibrations)
        if isinstance(self.scene, Design):
            self.scene.write(folder, kept)
        else:
            recording.write_recording(recording.history_of(self.scene), self.scene, folder, kept)


def film(number: int, seed: int, dynamics: float = 0.0, chain: bool = False) -> Film:
    """One film of the design of a seed.

    ``number``: from 0.  ``dynamics``: share of the films whose motion is from the project's own dynamics; the others
    move without mechanics.  ``chain``: it is of the second generator.
    """
    if chain:
        design = Design(number, seed)
        drawn = design.factors
        slow = bool(drawn["speed"] <= SLOW)
        plane = drawn["twist"] * drawn["width"] < TWISTED
        moment = float(drawn["friction"]) if slow else nan
        return Film(design, drawn["eta_b"], f"chain-{drawn['camera']}", seed, None, slow and plane, moment)
    block, row = divmod(number, BLOCK)
    sampler = qmc.LatinHypercube(len(FACTORS), rng=np.random.default_rng([seed, block]))
    shares = sampler.random(BLOCK)[row]
    factors = {
        name: values[int(share * len(values))] for (name, values), share in zip(FACTORS.items(), shares, strict=True)
    }
    rng = np.random.default_rng([seed, block, row])
    speed, frame_rate = _PACES[factors["pace"]]
    strip_grey, filming_grey = _TONES[factors["tone"]]
    unit = (factors["eta_b"] * GRAVITY) ** (-1.0 / 3.0)
    mechanical = (number * dynamics) % 1.0 + dynamics >= 1.0
    friction = FRICTIONS[number % len(FRICTIONS)]
    motion: dict[str, Any]
    if mechanical:
        before = BEFORE * unit if speed <= SLOW else 0.01
        motion = {"friction_moment_star": friction, "before": before, "after": 0.5}
    else:
        # About a hundred frames, of which those at rest, at the snap and after it take two seconds.
        before = float(np.clip(speed * (100.0 / frame_rate - 2.0), 0.008, 0.028))
        motion = {**_MOTIONS[factors["motion"]], "before": before, "after": 0.8}
    camera = factors["camera"]
    filming = {
        **CAMERAS[camera],
        **filming_grey,
        **_FILES[factors["file"]],
        **{name: value for name, value in factors.items() if name in Filming.model_fields},
        "frame_rate": frame_rate,
        "read_noise": factors["noise"],
        "shot_noise": 0.7 * factors["noise"],
        "log_offset": float(rng.uniform(-0.5, 0.5)),
        "log_rate": float(rng.choice([50.0, 100.0, 125.0])),
    }
    scene = {
        "eta_b": factors["eta_b"],
        "height": round(factors["height"] * unit, 4),
        "speed": speed,
        "strip": {"hairs": factors["hairs"], **strip_grey},
        "gripper": {"finger": factors["finger"]},
        "filming": filming,
        "generator": "dynamics" if mechanical else "shapes",
        "motion": motion,
        "seed": int(rng.integers(2**31)),
        "title": f"synthetic recording {number} of design {seed}",
    }
    # Anew for each design: the errors of a calibration are those of all films of its camera.
    anew = int(np.random.default_rng([seed, camera]).integers(2**31))
    calibrated = Scene.of({"filming": CAMERAS[camera], "seed": anew})
    disturbed = any(factors[name] for name in ("shadow", "occluder", "dropped_at_event"))
    moment = friction if mechanical and speed <= SLOW else nan
    sound = speed <= SLOW and not disturbed
    return Film(Scene.of(scene), factors["eta_b"], f"camera-{camera}", seed, calibrated, sound, moment)


def truth_of(folder: Path) -> tuple[float, float]:
    """Onset, s by the video's clock, and lambda then, m, of the motion itself.

    The root of its kinetic energy, of the part of the strip that is raised at first, rises half-way from its median
    while the strip follows the gripper to its first peak: its maximum before it has halved, once the layers touch.
    """
    known = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    if "video_onset" in known:
        return known["video_onset"], known["lambda"]
    truth = store.read(folder / "truth.nc", ("time", "advance", "curve"))
    touch = known["events"]["touch"]["t"]
    t, lam, curve = truth["time"].values, truth["advance"].values, truth["curve"].values.astype(np.float64)
    return onset_of(t, lam, curve, touch)


def onset_of(t: Array, lam: Array, curve: Array, touch: float) -> tuple[float, float]:
    """The same of a motion: times, s, lambda, m, curves, shape (m, n, 2), m, and when the layers touch, s."""
    height = curve[0, :, 1]
    raised = slice(0, int(np.flatnonzero(height > RAISED * height[0])[-1]) + 1)
    speed = np.sqrt(np.mean(np.sum(np.gradient(curve[:, raised], t, axis=0) ** 2, axis=2), axis=1))
    rate = np.gradient(lam, t)
    used = t >= t[np.flatnonzero(rate > 0.8 * rate.max())[0]] + SWING
    t, lam, speed = t[used], lam[used], speed[used]
    # The touch brakes a part of the strip: the rest may go on accelerating.
    ended = np.flatnonzero((t > touch) & (speed < 0.5 * np.maximum.accumulate(speed)))
    peak = int(np.argmax(speed[: int(ended[0])] if len(ended) else speed))
    following = np.median(speed[: max(int(FOLLOWING * peak), 1)])
    last = int(np.flatnonzero(speed[:peak] < 0.5 * (following + speed[peak]))[-1])
    return float(t[last]), float(lam[last])

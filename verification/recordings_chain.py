"""The cases of the second generator (:mod:`second_generator`) in the study of measured recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from verification.recordings_design import FACTORS, SLOW
from verification.second_generator.recording import Design, write_calibration

CHAIN = "chain"
EVERY = 4
"""One case in so many is of the second generator."""
_SHARED = {
    "camera": "camera",
    "eta_b": "eta_b",
    "height": "height",
    "noise": "read",
    "defocus": "blur",
    "exposure": "exposure",
    "rolling_shutter": "shutter",
    "light": "gain",
}
"""Factors of the first design that the second has, too, and their names there; the others are nan."""


def is_chain(number: int) -> bool:
    """Whether a case is of the second generator."""
    return number % EVERY == 1


class ChainCase(NamedTuple):
    """One recording of the chain; like :class:`.recordings_design.Case`."""

    number: int
    seed: int

    @property
    def generator(self) -> str:
        """Name of the generator of the motion."""
        return CHAIN

    @property
    def factors(self) -> Mapping[str, Any]:
        """The value of each of the first design's factors, nan where it has none here."""
        mine = Design(*self).factors
        return dict.fromkeys(FACTORS, np.nan) | {name: float(mine[other]) for name, other in _SHARED.items()}

    @property
    def sound(self) -> bool:
        """Whether it is filmed as docs/measuring.md asks: nothing disturbs these but a fast gripper."""
        return bool(Design(*self).factors["speed"] <= SLOW)

    @property
    def moment(self) -> float:
        """M_0, rho_a g L*^2, where the gripper is slow; or nan."""
        return float(Design(*self).factors["friction"]) if self.sound else nan

    @property
    def camera(self) -> str:
        """Name of the camera: cases with the same share a calibration."""
        return f"chain-{Design(*self).factors['camera']}"

    def write_calibration(self, calibrations: Path) -> Path:
        """The calibration of the camera, rendered into its place in a folder unless it is there."""
        kept = calibrations / self.camera
        if not kept.exists():
            write_calibration(Design(*self).factors["camera"], self.seed, kept)
        return kept

    def write(self, folder: Path, calibrations: Path) -> None:
        """Render it into a new folder, with its camera's calibration from ``calibrations``."""
        Design(*self).write(folder, self.write_calibration(calibrations))

    def truth(self, folder: Path) -> tuple[float, float]:
        """Onset, s, by the video's clock, and lambda then, m."""
        known = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        return known["video_onset"], known["lambda"]

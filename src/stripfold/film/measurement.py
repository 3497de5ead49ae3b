"""The result of a recording: lambda at the onset of the snap, its parts and its flags."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

from scipy.special import ndtri

from stripfold.base.errors import MeasurementError
from stripfold.film import eta_motion
from stripfold.film.calibration import Calibration
from stripfold.film.clock import Clock
from stripfold.film.eta_motion import MotionEtaB
from stripfold.film.model import ModelValue
from stripfold.film.recording import Recording
from stripfold.film.snap import Speed
from stripfold.film.tracking import Tracks

PARTS = ("level", "frames", "mapping", "gripper", "clock", "flat_end", "offset", "manual")
"""Causes of uncertainty: peak and rise of the strip's speed, time between frames, calibration, noise of the marker,
synchronisation of the clocks, described flat end and offset, onset set by hand."""
WARNING, NOTE = "warning", "note"
"""Severities of a flag: the value or its interval is affected; for information."""


class Flag(NamedTuple):
    """What a user should know about a result."""

    severity: str
    text: str

    def __str__(self) -> str:
        return f"{self.severity}: {self.text}"


def half_width(share: float) -> float:
    """Half the width of the confidence interval with this probability, in standard deviations: errors are normal."""
    return float(ndtri(0.5 + 0.5 * share))


@dataclass(frozen=True, eq=False)
class Measurement:
    """The result of a recording; lengths in m, times in s by the video's clock.

    ``motion``, ``clock``: speed of the strip; the robot's clock against the video's, None without a log.  ``snapped``,
    ``event_time``, ``event``: whether there was a snap, its onset, and lambda then.  Without a snap ``event`` is a
    lower bound: the farthest advance of the gripper.  ``parts``: standard deviations of ``event`` by cause, see
    :data:`PARTS`.  ``by_video``, ``by_log``: lambda at the event from the video alone and from the log; nan without a
    log.  ``speed``: of the gripper around the event, m/s.  ``model``: lambda_c of the model for the described strip.
    ``eta_b``: that of the strip by its motion, or why there is none.  ``flags``, ``manual``: quality flags, warnings
    first; why the onset was set by hand, empty where it was not.
    """

    recording: Recording
    calibration: Calibration
    tracks: Tracks
    motion: Speed
    clock: Clock | None
    snapped: bool
    event_time: float
    event: float
    parts: dict[str, float]
    by_video: float
    by_log: float
    speed: float
    model: ModelValue
    eta_b: MotionEtaB | MeasurementError
    flags: tuple[Flag, ...]
    manual: str

    @property
    def sd(self) -> float:
        """Standard deviation of ``event``, m."""
        return hypot(*self.parts.values())

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of ``event``, m."""
        half = half_width(0.95) * self.sd
        return self.event - half, self.event + half

    def numbers(self) -> dict[str, float]:
        """The numbers of the result by their names in files; lengths in m, times in s."""
        low, high = self.interval
        return {
            "lambda_event": self.event,
            "lambda_low": low,
            "lambda_high": high,
            "event_time": self.event_time,
            "lambda_video": self.by_video,
            "lambda_log": self.by_log,
            "lambda_model": self.model.without_friction,
            "lambda_model_low": self.model.low,
            "lambda_model_high": self.model.high,
            "lambda_model_friction": self.model.with_friction,
            **eta_motion.numbers(self.eta_b),
        }

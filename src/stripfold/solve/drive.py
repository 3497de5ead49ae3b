"""The control parameter as a function of time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Protocol


class Drive(Protocol):
    """The control parameter and its rate as functions of time."""

    def lam(self, t: float) -> float: ...

    def rate(self, t: float) -> float: ...


@dataclass(frozen=True, slots=True)
class Moving:
    """At constant speed, up to ``end``."""

    start: float
    speed: float
    end: float = inf

    def lam(self, t: float) -> float:
        return min(self.start + self.speed * t, self.end)

    def rate(self, t: float) -> float:
        return self.speed if self.start + self.speed * t < self.end else 0.0


@dataclass(frozen=True, slots=True)
class Nudge:
    """Smoothly by ``rise`` within ``duration``, then held."""

    start: float
    rise: float = 0.0
    duration: float = 1.0

    def lam(self, t: float) -> float:
        s = min(t / self.duration, 1.0)
        return self.start + self.rise * s**2 * (3.0 - 2.0 * s)

    def rate(self, t: float) -> float:
        s = min(t / self.duration, 1.0)
        return self.rise / self.duration * 6.0 * s * (1.0 - s)

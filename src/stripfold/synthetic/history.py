"""A strip's motion as the renderer takes it, wherever it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from stripfold.arrays import Array

STATIONS = 100
"""Material points of a motion, at equal lengths: what is true of the median of them is true of the strip's."""


@dataclass(frozen=True, eq=False)
class History:
    """A motion, dense in time: at least 500 moments per second where the strip snaps.

    Attributes
    ----------
    t
        Shape (m,): s, ascending from 0.
    gripper
        Shape (m, 2): the gripped end, x and z of the robot, m.
    curve
        Shape (m, :data:`STATIONS`, 2): the mid-surface from the gripped end to the held end, m; the same material
        points throughout, at equal lengths.
    truth
        What is known of it: ``lambda_c`` (static, m, None where there is no snap), ``onset`` (s, when the gripper
        passes lambda_c), ``touch`` (s, when the raised part meets the lying one), both None where there is none.
    """

    t: Array
    gripper: Array
    curve: Array
    truth: Mapping[str, Any]

    def at(self, t: Array) -> tuple[Array, Array]:
        """Curve, shape (k, n, 2), and gripper, shape (k, 2), at times of shape (k,); the first and last state go on."""
        clamped = np.clip(t, self.t[0], self.t[-1])
        after = np.clip(np.searchsorted(self.t, clamped, side="right"), 1, len(self.t) - 1)
        before = after - 1
        share = ((clamped - self.t[before]) / (self.t[after] - self.t[before]))[:, None]
        gripper = (1.0 - share) * self.gripper[before] + share * self.gripper[after]
        curve = (1.0 - share[..., None]) * self.curve[before] + share[..., None] * self.curve[after]
        return curve, gripper

    def displacement(self, start: float, end: float) -> float:
        """Largest way of a material point between two moments, m."""
        curve, _ = self.at(np.array([start, end]))
        return float(np.linalg.norm(curve[1] - curve[0], axis=1).max())

    def events(self) -> dict[str, float | None]:
        """Moments of the snap, s: the truth's; ``fastest``, and ``fall``, from where on it has a quarter of that speed.

        Speeds are those of the fastest material point, relative to the gripper's.
        """
        onset, touch = self.truth["onset"], self.truth["touch"]
        if touch is None:
            return {"onset": onset, "fall": None, "fastest": None, "touch": None}
        rates = np.gradient(self.curve, self.t, axis=0)
        speed = np.linalg.norm(rates, axis=2).max(axis=1) - np.linalg.norm(rates[:, 0], axis=1)
        within = np.flatnonzero(self.t <= touch)
        top = int(within[np.argmax(speed[within])])
        slow = np.flatnonzero(speed[:top] < 0.25 * speed[top])
        start = int(slow[-1]) if len(slow) else 0
        return {"onset": onset, "fall": float(self.t[start]), "fastest": float(self.t[top]), "touch": touch}

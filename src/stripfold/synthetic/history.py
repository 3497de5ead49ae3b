"""The motion of a strip as the renderer takes it, from any generator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array

RATE = 500.0
"""Stored states per second."""
STATIONS = 100
"""Material points of a motion, equally spaced, so that their median is that of the strip."""


@dataclass(frozen=True, eq=False)
class History:
    """The states of a strip over time, :data:`RATE` per second.

    ``t``, shape (m,): s, ascending from 0.  ``gripper``, shape (m, 2): x and z of the gripped end, robot frame, m.
    ``curve``, shape (m, :data:`STATIONS`, 2): material points of the mid-surface from the gripped end to the held end,
    m.  ``lambda_c``, ``onset``, ``touch``: the static lambda_c, m; when the gripper passes it, and when the raised part
    meets the lying one, s.
    """

    t: Array
    gripper: Array
    curve: Array
    lambda_c: float
    onset: float
    touch: float

    def at(self, t: Array) -> tuple[Array, Array]:
        """Curves, shape (k, n, 2), and grippers, shape (k, 2), at times of shape (k,), limited to those stored."""
        clamped = np.clip(t, self.t[0], self.t[-1])
        after = np.clip(np.searchsorted(self.t, clamped, side="right"), 1, len(self.t) - 1)
        before = after - 1
        share = ((clamped - self.t[before]) / (self.t[after] - self.t[before]))[:, None]
        gripper = (1.0 - share) * self.gripper[before] + share * self.gripper[after]
        curve = (1.0 - share[..., None]) * self.curve[before] + share[..., None] * self.curve[after]
        return curve, gripper

    def displacement(self, start: float, end: float) -> float:
        """Largest displacement of a material point between two times, m."""
        curve, _ = self.at(np.array([start, end]))
        return float(np.linalg.norm(curve[1] - curve[0], axis=1).max())

    def events(self) -> dict[str, float]:
        """Times of the snap, s: ``onset``, ``touch``, ``fastest``, and ``fall``, the start of its fast part.

        The speed is that of the fastest material point less the gripper's, up to the touch; the fall begins at a
        quarter of its maximum.
        """
        speeds = np.linalg.norm(np.gradient(self.curve, self.t, axis=0), axis=2)
        speed = (speeds.max(axis=1) - speeds[:, 0])[self.t <= self.touch]
        top = int(np.argmax(speed))
        slow = np.flatnonzero(speed[:top] < 0.25 * speed[top])
        fall = self.t[slow[-1] if len(slow) else 0]
        return {"onset": self.onset, "fall": float(fall), "fastest": float(self.t[top]), "touch": self.touch}

"""The truth of a synthetic recording's event, by its motion alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from stripfold.base.arrays import Array
from stripfold.files import store

RAISED, SWING, FOLLOWING = 0.1, 0.35, 0.4
"""Height, over the gripper's, from which a point is raised; for how long, s, the strip swings after its gripper has
started; share of the time to the fastest motion in which it follows."""


def event_of(folder: Path) -> tuple[float, float]:
    """Onset, s, and lambda then, m, of the motion itself.

    The root of its kinetic energy, of the part of the strip that is raised at first, rises half-way from its median
    while the strip follows the gripper to its first peak: its maximum before it has halved, once the layers touch.
    """
    truth = store.read(folder / "truth.nc", ("time", "advance", "curve"))
    touch = json.loads((folder / "truth.json").read_text(encoding="utf-8"))["events"]["touch"]["t"]
    t, lam, curve = truth["time"].values, truth["advance"].values, truth["curve"].values.astype(np.float64)
    return onset_of(t, lam, curve, touch)


def onset_of(t: Array, lam: Array, curve: Array, touch: float) -> tuple[float, float]:
    """The same of a motion: times, s, lambda, m, curves, shape (m, n, 2), m, and when the layers touch, s."""
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

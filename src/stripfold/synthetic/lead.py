"""What comes before a motion in a film of the whole protocol: the strip flat, lifted, and drawn up to its start.

Static shapes of the thin strip without friction: nothing is measured in this part but where the gripper is.
"""

from __future__ import annotations

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica import with_friction
from stripfold.synthetic.history import RATE, History
from stripfold.synthetic.scene import Scene

FLAT, LIFT, REST = 1.2, 1.5, 0.3
"""Durations: flat, while it is lifted, and at rest before it is pulled, s."""
SPEED = 0.15
"""Of the gripper on its way to the start, m/s."""
LOW = 1.0
"""Height up to which the flat shape turns into that of a strip lifted so far, L*."""
KEYS = 30
"""Shapes between which others are interpolated."""


def with_lead(history: History, scene: Scene) -> History:
    """Begin a motion with the flat strip."""
    unit, flat_end = scene.gravity_length, scene.flat_end
    s = np.linspace(0.0, scene.length, history.curve.shape[1])
    flat = np.column_stack([flat_end + s, np.zeros_like(s)])
    height, start = scene.height / unit, history.curve[0]

    def shape(z: float, advance: float) -> Array:
        known = with_friction.branch(max(z, LOW)).shapes(0.0, np.array([advance / unit]), s / unit)[0] * unit
        known = known + np.array([flat_end, 0.0])
        return np.asarray(flat + (known - flat) * [(z / LOW) ** 1.5, z / LOW]) if z < LOW else known

    lifted = np.array([flat, *(shape(z, 0.0) for z in np.linspace(0.0, height, KEYS)[1:])])
    first, last = lifted[-1][0, 0] - flat_end, start[0, 0] - flat_end
    drawn = np.array([*(shape(height, advance) for advance in np.linspace(first, last, KEYS)[:-1]), start])
    parts = [
        np.repeat(flat[None], round(FLAT * RATE), axis=0),
        _between(lifted, round(LIFT * RATE)),
        _between(drawn, max(round((last - first) / SPEED * RATE), 2)),
        np.repeat(start[None], round(REST * RATE), axis=0),
    ]
    before = np.concatenate(parts)
    late = len(before) / RATE
    curve = np.concatenate([before, history.curve])
    times = np.arange(len(curve)) / RATE
    return History(times, curve[:, 0], curve, history.lambda_c, history.onset + late, history.touch + late)


def _between(keys: Array, count: int) -> Array:
    """Shapes between others, shape (count, n, 2), evenly."""
    place = np.linspace(0.0, len(keys) - 1.0, count)
    i = np.minimum(place.astype(int), len(keys) - 2)
    share = (place - i)[:, None, None]
    return np.asarray((1.0 - share) * keys[i] + share * keys[i + 1])

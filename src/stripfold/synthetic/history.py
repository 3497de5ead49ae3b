"""The motion of a strip as the renderer takes it, from any generator, and what comes before it in a whole film.

Before it the strip lies flat, is lifted, and drawn up to its start: static shapes of the thin strip without friction.
Nothing is measured in this part but where the gripper is.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from stripfold.ask.inputs import Strip
from stripfold.base.arrays import Array
from stripfold.elastica import with_friction
from stripfold.follow.statics import StripModel
from stripfold.follow.time import through_snap
from stripfold.solve.dynamics import TimeState
from stripfold.solve.schemes import Damping
from stripfold.synthetic.scene import DynamicsMotion, Scene

RATE = 500.0
"""Stored states per second."""
STATIONS = 100
"""Material points of a motion, equally spaced, so that their median is that of the strip."""
FLAT, LIFT, REST = 1.2, 1.5, 0.3
"""Durations: flat, while it is lifted, and at rest before it is pulled, s."""
SPEED = 0.15
"""Of the gripper on its way to the start, m/s."""
LOW = 1.0
"""Height up to which the flat shape turns into that of a strip lifted so far, L*."""
KEYS = 30
"""Shapes between which others are interpolated."""


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


def from_dynamics(scene: Scene) -> History:
    """The motion of a scene whose generator is ``dynamics``: with friction in bending and a moving gripper.

    Raises InvalidInputError: strip and eta_m do not go together; SolveError: there is no snap at this height, or a part
    could not be computed.
    """
    motion = scene.motion
    assert isinstance(motion, DynamicsMotion)  # the scene has checked it
    strip = Strip(length=scene.length, eta_b=scene.eta_b, eta_m=motion.eta_m)
    material, unit = strip.material, strip.gravity_length
    clock = sqrt(unit / material.gravity)
    found = through_snap(
        StripModel(strip.length_star, material.relative_thickness, kind=motion.model),
        scene.height / unit,
        motion.friction_moment_star,
        scene.speed * clock / unit,
        motion.before / unit,
        motion.after / clock,
        Damping(motion.air * clock, motion.stiffness / clock),
        motion.refinement,
    )
    assert found.touch is not None
    states = [state for _, state in found.states if isinstance(state, TimeState)]
    times = np.array([state.t for state in states]) * clock
    t = np.arange(0.0, times[-1], 1.0 / RATE)
    model = found.states[0].problem.model
    places = np.array([model.mid_surface(state.q) for state in states]) * unit
    rates = np.array([state.v[model.middle] for state in states]) * unit / clock
    # The mesh is much finer where the strip lifts off.
    even = np.linspace(0.0, float(model.s[-1]), STATIONS)
    places, rates = (CubicSpline(model.s, values, axis=1)(even) for values in (places, rates))
    curve: Array = CubicHermiteSpline(times, places, rates)(t)
    limit = found.events[0].travelled
    onset = (limit - states[0].lam) * unit / scene.speed
    return History(t, curve[:, 0], curve, limit * unit, onset, float(times[found.touch.index]))

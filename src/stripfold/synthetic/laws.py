"""One-degree-of-freedom laws by which a strip leaves a static branch that ends at lambda_c.

None of them is the mechanics of a strip: a measurement that is right for all of them does not rely on any of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.synthetic.history import RATE
from stripfold.synthetic.scene import ShapesMotion

WAIT, RAMP = 0.3, 0.2
"""Times for which the gripper rests at first, and over which it speeds up or slows down, s."""
AMPLITUDE = 0.6
"""Distance of the static shape from the critical one, one L* before it."""
LONGEST_FALL = 20.0
"""Longest time from lambda_c to the touch, s."""
_MODE_TIME = 0.25
"""Relaxation time of the second mode, s."""


def force(motion: ShapesMotion, q: float, mu: float) -> float:
    """F of T_i^2 q'' + T_d q' = F(q, mu), mu = (lambda_c - lambda) / scale; q = 0 is critical, q = 1 is the touch.

    The static shape, F = 0, is q = -AMPLITUDE mu^(1/2); mu^exponent for "power"; for "cubic" only close to lambda_c.
    """
    if motion.law == "power":
        return float(abs(q) ** (1.0 / motion.exponent) - AMPLITUDE ** (1.0 / motion.exponent) * mu)
    factor = 1.0 + motion.cubic * q if motion.law == "cubic" else 1.0
    return q * q * factor - AMPLITUDE**2 * mu


def _static(motion: ShapesMotion, mu: float) -> float:
    """The stable static q at ``mu`` >= 0."""
    lowest = -2.0 / (3.0 * motion.cubic) if motion.law == "cubic" else -AMPLITUDE * (1.0 + mu)
    if force(motion, lowest, mu) <= 0.0:
        raise InvalidInputError("motion.before", motion.before, "a start closer to lambda_c", "no static state there")
    return float(brentq(lambda q: force(motion, q, mu), lowest, 0.0, xtol=1e-14))


class Trajectory(NamedTuple):
    """A solution of a law.

    ``t``, ``advance``, ``q``, ``second``: shape (m,): time, s; lambda, m; q, which is 1 from the touch on; the second
    mode, 0 for laws with one.  ``onset``, ``touch``: when lambda = lambda_c and when q = 1, s.
    """

    t: Array
    advance: Array
    q: Array
    second: Array
    onset: float
    touch: float


def travelled(t: ArrayLike, stop: float = np.inf) -> Array:
    """Integral of the gripper's speed over its nominal speed, s; from ``stop`` on the gripper slows down."""
    return _ramp(np.asarray(t) - WAIT) - _ramp(np.asarray(t) - stop)


def _ramp(t: Array) -> Array:
    """Integral of a cosine ramp from 0 to 1 that starts at t = 0."""
    part = np.clip(t, 0.0, RAMP)
    return np.asarray(0.5 * (part - RAMP / np.pi * np.sin(np.pi * part / RAMP)) + np.clip(t - RAMP, 0.0, None))


def solve(motion: ShapesMotion, lambda_c: float, scale: float, speed: float) -> Trajectory:
    """Drive the gripper at ``speed``, m/s, through the critical point of a law; ``lambda_c`` and ``scale`` in m.

    Raises InvalidInputError: the law has no static state at the start, or its strip does not touch.
    """
    start = lambda_c - motion.before
    distance = motion.before / speed
    onset = float(brentq(lambda t: float(travelled(t)) - distance, 0.0, WAIT + RAMP + distance + 1.0, xtol=1e-14))

    def rates(t: float, y: Array) -> list[float]:
        mu = (lambda_c - start - speed * float(travelled(t))) / scale
        pull = force(motion, float(y[0]), mu)
        rate = float(y[1]) if motion.inertia else pull / motion.drag
        acceleration = (pull - motion.drag * rate) / motion.inertia**2 if motion.inertia else 0.0
        return [rate, acceleration, (mu - y[2] + 0.7 * rate) / _MODE_TIME]

    def touches(t: float, y: Array) -> float:
        return float(y[0]) - 1.0

    touches.terminal = True  # type: ignore[attr-defined]
    mu = motion.before / scale
    found = solve_ivp(
        rates,
        (0.0, onset + LONGEST_FALL),
        [_static(motion, mu), 0.0, mu],
        events=touches,
        dense_output=True,
        method="DOP853",
        max_step=0.02,
        rtol=1e-9,
        atol=1e-11,
    )
    if not len(found.t_events[0]):
        raise InvalidInputError("motion.drag", motion.drag, "a strip that touches", "change inertia or drag")
    touch = float(found.t_events[0][0])
    end, stop = touch + motion.after, touch + 0.5 * motion.after
    t = np.arange(int(end * RATE) + 1) / RATE
    q, _, second = found.sol(np.minimum(t, found.t[-1]))
    q = np.where(t >= touch, 1.0, q)
    second = second * np.exp(-np.clip(t - touch, 0.0, None) / _MODE_TIME)
    second = second if motion.law == "two_modes" else np.zeros_like(t)
    return Trajectory(t, start + speed * travelled(t, stop), q, second, onset, touch)

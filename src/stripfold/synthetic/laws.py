"""Made-up laws by which a strip's shape leaves a static state that ends at lambda_c.

None of them is mechanics of a strip: a measurement that holds on all of them does not live on the law of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

LAWS = ("parabolic", "cubic", "power", "two_modes")
_ACCURACY = {"rtol": 1e-9, "atol": 1e-11}
_LONGEST = 20.0
"""How long after lambda_c a strip may take to touch, s."""


@dataclass(frozen=True, slots=True)
class Law:
    """T_i^2 q'' + T_d q' = F(q, mu) with mu = (lambda_c - lambda) / reach; q = 0 is critical, q = 1 lies.

    Statically, F = 0, the shape is q = -amplitude mu^(1/2) ("power": mu^exponent), for "cubic" only close to lambda_c.

    Parameters
    ----------
    kind
        One of :data:`LAWS`; "two_modes" is parabolic with a second, slow mode that follows.
    lambda_c
        Static critical advance, m.
    reach
        m.
    amplitude
        How far from critical the shape is one reach before it.
    inertia, drag
        T_i and T_d, s.  Without inertia the motion is overdamped.
    cubic
        Of q^2 (1 + cubic q), for "cubic".
    exponent
        For "power".
    """

    kind: str
    lambda_c: float
    reach: float
    amplitude: float
    inertia: float
    drag: float
    cubic: float = 0.3
    exponent: float = 0.5

    def force(self, q: float, mu: float) -> float:
        """F."""
        if self.kind == "power":
            return float(abs(q) ** (1.0 / self.exponent) - self.amplitude ** (1.0 / self.exponent) * mu)
        bend = 1.0 + self.cubic * q if self.kind == "cubic" else 1.0
        return q * q * bend - self.amplitude**2 * mu

    def static(self, mu: float) -> float:
        """The static q before lambda_c; ``mu`` is not negative."""
        lowest = -2.0 / (3.0 * self.cubic) if self.kind == "cubic" else -self.amplitude * (1.0 + mu)
        if self.force(lowest, mu) <= 0.0:
            far = self.reach * mu
            raise InvalidInputError("motion.before", far, "a start closer to lambda_c", "this law has no state there")
        return float(brentq(lambda q: self.force(q, mu), lowest, 0.0, xtol=1e-14))


@dataclass(frozen=True, eq=False)
class Passage:
    """What the law says.

    Attributes
    ----------
    t
        Shape (m,), s.
    advance
        Shape (m,): lambda, m.
    q
        Shape (m,): 1 from the touch on.
    second
        Shape (m,): the second mode, 0 for all laws but one.
    onset, touch
        When the gripper passes lambda_c, and when q = 1, s; None where that does not happen.
    """

    t: Array
    advance: Array
    q: Array
    second: Array
    onset: float | None
    touch: float | None


@dataclass(frozen=True, slots=True)
class Drive:
    """The gripper's advance: at rest, then at ``speed``, then at rest again; it speeds up and slows down for ``ramp``.

    Attributes
    ----------
    start
        First advance, m.
    speed
        m/s.
    stop
        When it begins to slow down, s.
    wait, ramp
        s.
    """

    start: float
    speed: float
    stop: float = np.inf
    wait: float = 0.3
    ramp: float = 0.2

    def advance(self, t: Array) -> Array:
        """Lambda at times of any shape, m."""
        moved = self._ramped(t - self.wait)
        if np.isfinite(self.stop):
            moved = moved - self._ramped(t - self.stop)
        return np.asarray(self.start + self.speed * moved)

    def _ramped(self, t: Array) -> Array:
        """Integral of a cosine ramp from 0 to 1."""
        share = np.clip(t, 0.0, self.ramp)
        smooth = 0.5 * (share - self.ramp / np.pi * np.sin(np.pi * share / self.ramp))
        return np.asarray(smooth + np.clip(t - self.ramp, 0.0, None))

    def time_of(self, advance: float) -> float:
        """When the gripper, that does not stop, has this advance, s."""
        longest = self.wait + self.ramp + (advance - self.start) / self.speed
        return float(brentq(lambda t: float(self.advance(np.array(t))) - advance, 0.0, longest + 1.0, xtol=1e-14))


def passage(law: Law, before: float, short: float, speed: float, after: float, rate: float) -> Passage:
    """Drive a law through its critical point.

    Parameters
    ----------
    law
        The law.
    before
        From where on, m before lambda_c.
    short
        How far before lambda_c the gripper stops, m; 0 to go on past it.
    speed
        Speed of the gripper, m/s.
    after
        How long to go on after the touch, or after the stop, s.
    rate
        Moments per second.

    Raises
    ------
    InvalidInputError
        The law has no static state at the start, or its strip does not come to lie.
    """
    drive = Drive(law.lambda_c - before, speed)

    def rates(t: float, y: Array, drive: Drive) -> Array:
        mu = (law.lambda_c - float(drive.advance(np.array(t)))) / law.reach
        force = law.force(float(y[0]), mu)
        fall = float(y[1]) if law.inertia else force / law.drag
        gain = (force - law.drag * fall) / law.inertia**2 if law.inertia else 0.0
        return np.array([fall, gain, (mu - y[2] + 0.7 * fall) / 0.25])

    def lies(t: float, y: Array, drive: Drive) -> float:
        return float(y[0]) - 1.0

    lies.terminal = True  # type: ignore[attr-defined]
    mu = before / law.reach
    first = np.array([law.static(mu), 0.0, mu])
    onset: float | None = None
    if short:
        drive = Drive(drive.start, speed, drive.time_of(law.lambda_c - short))
        end = drive.stop + drive.ramp + after
    else:
        onset = drive.time_of(law.lambda_c)
        end = onset + _LONGEST
    found = solve_ivp(
        rates,
        (0.0, end),
        first,
        args=(drive,),
        events=lies,
        dense_output=True,
        method="DOP853",
        max_step=0.02,
        **_ACCURACY,
    )
    touch = float(found.t_events[0][0]) if len(found.t_events[0]) else None
    if (touch is None) != bool(short):
        raise InvalidInputError("motion.short", short, "0, or a stop that the strip survives", "change inertia or drag")
    if touch is not None:
        end = touch + after
        drive = Drive(drive.start, speed, end - 0.5 * after)
    t = np.arange(int(end * rate) + 1) / rate
    states = found.sol(np.minimum(t, found.t[-1]))
    lying = t >= (np.inf if touch is None else touch)
    q = np.where(lying, 1.0, states[0])
    second = states[2] if law.kind == "two_modes" else np.zeros_like(t)
    if touch is not None:
        second = np.where(lying, second * np.exp(-np.clip(t - touch, 0.0, None) / 0.25), second)
    return Passage(t, drive.advance(t), q, second, onset, touch)

"""Motions of a strip whose shape is made of arcs and straight pieces, without mechanics: an independent generator.

From the held end the strip lies flat up to where it lifts off; then follow a bend of more than half a turn, a straight
descent, a sag just over the lying part and a straight rise to the gripper.  A shape is the integral of its direction,
so its length is exact.  The height of the sag follows a law of one degree of freedom that leaves a static branch at
lambda_c.  None of the laws is the mechanics of a strip: a measurement that is right for all of them relies on none.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.synthetic.history import RATE, STATIONS, History
from stripfold.synthetic.scene import Scene, ShapesMotion

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


def driven(motion: ShapesMotion, lambda_c: float, scale: float, speed: float) -> Trajectory:
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


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_SLOPES = (0.02, 1.3)
"""Least and greatest slope of the descent, rad."""
_GAP = 0.25
"""Height of the sag over the lying part in the critical shape, L*."""
_DRIFT = 0.15
"""Rise of the sag before lambda_c in addition to the law's."""


@dataclass(frozen=True, eq=False)
class Family:
    """Shapes of one strip; lengths in m.

    ``length``, ``height``, ``flat_end``: length of the strip, height of the gripper, x of the gripped end of the flat
    strip; ``bend``, ``sag``: arc lengths of the bend and of the sag; ``rise``: direction at the gripper, rad.
    """

    length: float
    height: float
    flat_end: float
    bend: float
    sag: float
    rise: float

    def curves(self, advance: Array, gap: Array, flat: Array, bulge: Array) -> Array:
        """Mid-surfaces from the gripped end to the held end, shape (m, :data:`STATIONS`, 2), m.

        For each of m states: lambda, the lowest height of the sag's mid-surface, the length over which the sag lies
        flat, m, and the relative excess length of the bend.

        Raises InvalidInputError: no such shape has this advance.
        """
        bend = self.bend * (1.0 + bulge)
        slope, descent, up = self._solve(advance, gap, flat, bend)
        raised = bend + descent + self.sag + flat + up
        if raised.max() > self.length:
            raise InvalidInputError("length", self.length, f"at least {raised.max():.3g} m", "it is lifted whole")
        lowest = _lowest(slope, self.rise)
        # Arc length from the lift-off; negative on the table.
        arc = raised[:, None] - np.linspace(0.0, self.length, STATIONS)
        x, z = np.where(arc < 0.0, -arc, 0.0), np.zeros_like(arc)
        zero, one, turn = np.zeros_like(slope), np.ones_like(slope), slope + self.rise
        # Length, first direction, change of direction, and the part of that change: from the lift-off to the gripper.
        pieces = (
            (bend, np.pi * one, -slope - np.pi, zero, one),
            (descent, -slope, zero, zero, one),
            (self.sag * lowest, -slope, turn, zero, lowest),
            (flat, zero, zero, zero, one),
            (self.sag * (1.0 - lowest), -slope, turn, lowest, one),
            (up, self.rise * one, zero, zero, one),
        )
        start = zero
        for size, angle, change, first, last in pieces:
            share = np.clip((arc - start[:, None]) / np.where(size > 0.0, size, 1.0)[:, None], 0.0, 1.0)
            share[size <= 0.0] = 0.0
            dx, dz = _integrate(angle, change, first, last, share)
            x += size[:, None] * dx
            z += size[:, None] * dz
            start = start + size
        return np.stack([(self.flat_end + raised)[:, None] + x, z], axis=-1)

    def advance(self, slope: float, gap: float) -> float:
        """Lambda, m, of the shape with this slope of the descent, rad, and height of the sag, m."""
        one = np.ones(1)
        return float(self._lengths(slope * one, gap * one, self.bend * one)[2][0])

    @cached_property
    def _table(self) -> CubicSpline:
        """Over the slope: extents of bend and sag along x and z, and the depth of the sag, per length of the piece."""
        slopes = np.linspace(*_SLOPES, 400)
        one, zero = np.ones_like(slopes), np.zeros_like(slopes)
        lowest = _lowest(slopes, self.rise)
        bend = _integrate(np.pi * one, -slopes - np.pi, zero, one, one[:, None])
        sag = _integrate(-slopes, slopes + self.rise, zero, one, one[:, None])
        deep = _integrate(-slopes, slopes + self.rise, zero, lowest, one[:, None])[1] * lowest[:, None]
        return CubicSpline(slopes, np.concatenate([*bend, *sag, deep], axis=1))

    def _lengths(self, slope: Array, gap: Array, bend: Array) -> tuple[Array, Array, Array]:
        """Lengths of the descent and of the rise, and the advance, of shapes without a flat part; each (m,), m."""
        over, high, along, rise, deep = self._table(slope).T
        descent = (bend * high + self.sag * deep - gap) / np.sin(slope)
        up = (self.height - gap - self.sag * (rise - deep)) / np.sin(self.rise)
        reached = bend * (1.0 + over) + descent * (1.0 + np.cos(slope)) + self.sag * (1.0 + along)
        return descent, up, reached + up * (1.0 + np.cos(self.rise))

    def _solve(self, advance: Array, gap: Array, flat: Array, bend: Array) -> tuple[Array, Array, Array]:
        """Slope and length of the descent and length of the rise that put the end at the gripper, by bisection."""
        wanted = advance - 2.0 * flat
        low, high = (np.full_like(gap, slope) for slope in _SLOPES)
        # The advance decreases with the slope.
        inside = np.all(self._lengths(low, gap, bend)[2] >= wanted) and np.all(
            self._lengths(high, gap, bend)[2] <= wanted
        )
        if inside:
            for _ in range(48):
                middle = 0.5 * (low + high)
                longer = self._lengths(middle, gap, bend)[2] > wanted
                low, high = np.where(longer, middle, low), np.where(longer, high, middle)
            descent, up, _ = self._lengths(low, gap, bend)
        if not inside or descent.min() < 0.0 or up.min() < 0.0:
            raise InvalidInputError("motion", float(advance.max()), "an advance of which such a strip is capable")
        return low, descent, up


def _lowest(slope: Array, rise: float) -> Array:
    """Where in the sag the direction is level: the inverse of 3 u^2 - 2 u^3."""
    return np.asarray(0.5 - np.sin(np.arcsin(1.0 - 2.0 * slope / (slope + rise)) / 3.0))


def _integrate(angle: Array, change: Array, first: Array, last: Array, share: Array) -> tuple[Array, Array]:
    """Integrals of the direction's cosine and sine from 0 to ``share`` of a piece, shape (m, k), per length.

    The direction is ``angle`` + ``change`` (3 u^2 - 2 u^3), where u goes from ``first`` to ``last``; each shape (m,).
    """
    if not change.any():
        return share * np.cos(angle)[:, None], share * np.sin(angle)[:, None]
    # Most points lie on the table or beyond the piece, where the integrals are those over the whole piece.
    inside = np.nonzero((share > 0.0) & (share < 1.0))
    rows = np.concatenate([np.arange(len(share)), inside[0]])
    part = np.concatenate([np.ones(len(share)), share[inside]])[:, None]
    u = first[rows, None] + (last - first)[rows, None] * part * 0.5 * (1.0 + _NODES)
    direction = angle[rows, None] + change[rows, None] * u * u * (3.0 - 2.0 * u)
    x, z = (0.5 * part[:, 0] * (values @ _WEIGHTS) for values in (np.cos(direction), np.sin(direction)))
    beyond = share >= 1.0
    dx, dz = (np.where(beyond, values[: len(share), None], 0.0) for values in (x, z))
    dx[inside], dz[inside] = x[len(share) :], z[len(share) :]
    return dx, dz


def history(scene: Scene) -> History:
    """The motion of a scene whose generator is ``shapes``.

    Raises InvalidInputError: there is no such motion.
    """
    motion = scene.motion
    assert isinstance(motion, ShapesMotion)  # the scene has checked it
    unit, thickness = scene.gravity_length, scene.strip.thickness
    rng = np.random.default_rng([scene.seed, 3])
    bend, sag, rise, slope = np.array([1.95 * unit, 2.9 * unit, 1.5, 0.3]) * (1.0 + 0.04 * rng.uniform(-1.0, 1.0, 4))
    family = Family(scene.length, scene.height, scene.flat_end, bend, sag, rise)
    # Which shape is critical is a free choice, and with it lambda_c.
    lambda_c = family.advance(slope, thickness + _GAP * unit)
    found = driven(motion, lambda_c, unit, scene.speed)
    smooth = 0.5 * unit
    ahead = smooth * (np.logaddexp(0.0, (lambda_c - found.advance) / smooth) - np.log(2.0))
    gap = thickness + (1.0 - found.q) * (_GAP * unit + _DRIFT * ahead)
    flat = 0.25 * unit * -np.expm1(-np.clip(found.t - found.touch, 0.0, None) / 0.15)
    curve = family.curves(found.advance, gap, flat, 0.08 * found.second + 0.15 * ahead / unit)
    end = np.column_stack([scene.flat_end + found.advance, np.full_like(found.t, scene.height)])
    return History(found.t, end, curve, lambda_c, found.onset, found.touch)

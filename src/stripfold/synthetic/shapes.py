"""Shapes of a strip drawn with bends, straights and no mechanics: the second, independent source of recordings.

From the held end the strip lies flat as far as it was peeled off; then a bend of more than half a turn, a straight
descent, a sag just over the lying part and a straight rise to the gripper.  Lengths are kept exactly, since a shape is
the integral of its direction.  How close the sag comes is told by q of :mod:`.laws`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.synthetic.checking import checked
from stripfold.synthetic.history import STATIONS, History
from stripfold.synthetic.laws import LAWS, Law, passage
from stripfold.synthetic.scene import Scene

RATE = 500.0
"""Moments per second."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_SLOPES = (0.02, 1.3)
"""Least and greatest slope of the descent, rad."""
_GAP = 0.25
"""Height of the sag over the lying part in the critical shape, L*."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What the generator ``shapes`` is asked for, in m and s."""

    law: str = "parabolic"
    before: float = 0.02
    """How far before lambda_c the film begins."""
    short: float = 0.0
    """How far before lambda_c the gripper stops; 0 to go on past it."""
    after: float = 1.0
    """How long the film goes on after the touch, or after the stop."""
    inertia: float = 0.07
    drag: float = 0.05
    amplitude: float = 0.6
    cubic: float = 0.3
    exponent: float = 0.5
    drift: float = 0.15
    """How much higher the sag is per way before lambda_c, beside what the law says."""


_RANGES = {
    **{"before": (1e-3, 1.0), "short": (0.0, 1.0), "after": (0.2, 20.0)},
    **{"inertia": (0.0, 1.0), "drag": (1e-3, 5.0), "amplitude": (0.1, 3.0), "cubic": (0.01, 1.0)},
    **{"exponent": (0.3, 0.8), "drift": (0.0, 2.0)},
}


@dataclass(frozen=True, eq=False)
class Family:
    """Shapes of one strip; lengths in m.

    Attributes
    ----------
    length, height, thickness, flat_end
        Of the strip and the gripper.
    bend, sag
        Arc lengths of the bend over half a turn and of the sag.
    rise
        Direction of the end at the gripper, rad.
    """

    length: float
    height: float
    thickness: float
    flat_end: float
    bend: float
    sag: float
    rise: float

    def curves(self, advance: Array, gap: Array, flat: Array, bulge: Array) -> Array:
        """Mid-surfaces from the gripped end to the held end.

        Parameters
        ----------
        advance
            Shape (m,): lambda, m.
        gap
            Shape (m,): lowest height of the sag's mid-surface, m.
        flat
            Shape (m,): length along which the sag lies flat, m.
        bulge
            Shape (m,): by what share the bend is longer.

        Returns
        -------
        Shape (m, :data:`STATIONS`, 2), m; equal arc lengths from one point to the next.

        Raises
        ------
        InvalidInputError
            No such shape has this advance.
        """
        bend = self.bend * (1.0 + bulge)
        slope, descent, up = self._solve(advance, gap, flat, bend)
        raised = bend + descent + self.sag + flat + up
        if raised.max() > self.length:
            raise InvalidInputError("strip.length", self.length, f"at least {raised.max():.3g} m", "it is lifted whole")
        lowest = _lowest(slope, self.rise)
        # Arc length from where the strip leaves the table; negative on the table.
        arc = raised[:, None] - np.linspace(0.0, self.length, STATIONS)
        x = np.where(arc < 0.0, -arc, 0.0)
        z = np.zeros_like(x)
        start = np.zeros_like(raised)
        halves = (self.sag * lowest, self.sag * (1.0 - lowest))
        whole = -slope - np.pi
        turn = slope + self.rise
        pieces = (
            (bend, (np.full_like(slope, np.pi), whole), (0.0, 1.0)),
            (descent, (-slope, 0.0 * slope), (0.0, 1.0)),
            (halves[0], (-slope, turn), (0.0, lowest)),
            (flat, (0.0 * slope, 0.0 * slope), (0.0, 1.0)),
            (halves[1], (-slope, turn), (lowest, 1.0)),
            (up, (np.full_like(slope, self.rise), 0.0 * slope), (0.0, 1.0)),
        )
        for size, (angle, change), (first, last) in pieces:
            share = np.clip((arc - start[:, None]) / np.where(size > 0.0, size, 1.0)[:, None], 0.0, 1.0)
            share[size <= 0.0] = 0.0
            dx, dz = _walk(angle, change, first, last, share)
            x += size[:, None] * dx
            z += size[:, None] * dz
            start = start + size
        left = self.flat_end + raised
        return np.stack([left[:, None] + x, z], axis=-1)

    def advance(self, slope: float, gap: float) -> float:
        """Lambda of the shape whose descent has this slope, rad, and whose sag is this high, m."""
        one = np.ones(1)
        return float(self._lengths(self._table, slope * one, gap * one, self.bend * one)[2][0])

    @cached_property
    def _table(self) -> CubicSpline:
        """Over the slope: extents of bend and sag along x and z, and how deep the sag goes, per length of the piece."""
        slopes = np.linspace(*_SLOPES, 400)
        one = np.ones((len(slopes), 1))
        bend = _walk(np.full_like(slopes, np.pi), -slopes - np.pi, 0.0, 1.0, one)
        lowest = _lowest(slopes, self.rise)
        sag = _walk(-slopes, slopes + self.rise, 0.0, 1.0, one)
        deep = _walk(-slopes, slopes + self.rise, 0.0, lowest, one)[1] * lowest[:, None]
        return CubicSpline(slopes, np.concatenate([*bend, *sag, deep], axis=1))

    def _lengths(self, table: CubicSpline, slope: Array, gap: Array, bend: Array) -> tuple[Array, Array, Array]:
        """Lengths of the descent and of the rise, and the advance, of shapes without a flat part; each (m,), m."""
        over, high, along, rise, deep = table(slope).T
        descent = (bend * high + self.sag * deep - gap) / np.sin(slope)
        up = (self.height - gap - self.sag * (rise - deep)) / np.sin(self.rise)
        reached = bend * (1.0 + over) + descent * (1.0 + np.cos(slope)) + self.sag * (1.0 + along)
        return descent, up, reached + up * (1.0 + np.cos(self.rise))

    def _solve(self, advance: Array, gap: Array, flat: Array, bend: Array) -> tuple[Array, Array, Array]:
        """Slope and length of the descent and length of the rise, with which the end is where the gripper is."""
        table = self._table

        def lengths(slope: Array) -> tuple[Array, Array, Array]:
            descent, up, reached = self._lengths(table, slope, gap, bend)
            return descent, up, reached + 2.0 * flat - advance

        low_slope, high_slope = np.full_like(gap, _SLOPES[0]), np.full_like(gap, _SLOPES[1])
        if np.any(lengths(low_slope)[2] < 0.0) or np.any(lengths(high_slope)[2] > 0.0):
            raise InvalidInputError("motion.lambda_c", float(advance.max()), "an advance that such a strip can have")
        for _ in range(48):  # the advance falls as the descent grows steeper
            middle = 0.5 * (low_slope + high_slope)
            longer = lengths(middle)[2] > 0.0
            low_slope, high_slope = np.where(longer, middle, low_slope), np.where(longer, high_slope, middle)
        descent, up, _ = lengths(low_slope)
        if descent.min() < 0.0 or up.min() < 0.0:
            raise InvalidInputError("motion.lambda_c", float(advance.max()), "an advance that such a strip can have")
        return low_slope, descent, up


def _lowest(slope: Array, rise: float) -> Array:
    """Where in the sag the direction is level: the inverse of 3 u^2 - 2 u^3."""
    return np.asarray(0.5 - np.sin(np.arcsin(1.0 - 2.0 * slope / (slope + rise)) / 3.0))


def _walk(angle: Array, change: Array, first: Array | float, last: Array | float, share: Array) -> tuple[Array, Array]:
    """Integrals of direction from 0 to ``share`` of a piece, shape (m, k), per length of the piece.

    The direction goes from ``angle`` by ``change`` times 3 u^2 - 2 u^3, where u goes from ``first`` to ``last``.
    """
    first, last = (np.broadcast_to(np.asarray(value, dtype=float), angle.shape) for value in (first, last))
    x, z = share.copy(), np.zeros_like(share)
    # Only where there is something to integrate: most points lie on the table or beyond the piece.
    rows, columns = np.nonzero(share > 0.0)
    part = share[rows, columns]
    u = first[rows, None] + (last - first)[rows, None] * part[:, None] * 0.5 * (1.0 + _NODES)
    direction = angle[rows, None] + change[rows, None] * u * u * (3.0 - 2.0 * u)
    x[rows, columns] = part * 0.5 * (np.cos(direction) @ _WEIGHTS)
    z[rows, columns] = part * 0.5 * (np.sin(direction) @ _WEIGHTS)
    return x, z


def history(scene: Scene) -> History:
    """The motion of a scene whose generator is ``shapes``.

    Raises
    ------
    InvalidInputError
        ``scene.motion`` has an unknown key, or asks for what no such strip can do.
    """
    asked = checked(Motion, scene.motion, "motion", _RANGES, {"law": LAWS})
    unit, strip, gripper = scene.strip.gravity_length, scene.strip, scene.gripper
    rng = np.random.default_rng([scene.seed, 3])
    vary = 1.0 + 0.04 * rng.uniform(-1.0, 1.0, 4)
    bend, sag, rise, slope = np.array([1.95 * unit, 2.9 * unit, 1.5, 0.3]) * vary
    family = Family(strip.length, gripper.height, strip.thickness, strip.flat_end, bend, sag, rise)
    # Which shape is critical is a free choice here, and with it lambda_c.
    lambda_c = family.advance(slope, strip.thickness + _GAP * unit)
    law = Law(asked.law, lambda_c, unit, asked.amplitude, asked.inertia, asked.drag, asked.cubic, asked.exponent)
    found = passage(law, asked.before, asked.short, gripper.speed, asked.after, RATE)
    soft = 0.5 * unit
    ahead = soft * (np.logaddexp(0.0, (lambda_c - found.advance) / soft) - np.log(2.0))
    gap = strip.thickness + (1.0 - found.q) * (_GAP * unit + asked.drift * ahead)
    flat = np.zeros_like(gap)
    if found.touch is not None:
        flat = 0.25 * unit * -np.expm1(-np.clip(found.t - found.touch, 0.0, None) / 0.15)
    curve = family.curves(found.advance, gap, flat, 0.08 * found.second + 0.15 * ahead / unit)
    truth = {
        "lambda_c": None if asked.short else lambda_c,
        "onset": found.onset,
        "touch": found.touch,
        "generator": "shapes",
        "motion": asdict(asked),
    }
    return History(
        found.t, np.stack([strip.flat_end + found.advance, np.full_like(found.t, gripper.height)], 1), curve, truth
    )

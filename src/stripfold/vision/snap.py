"""The snap in a recording: when it sets in, whether there is one, and where its quasi-static branch ends.

A definition that depends on neither the frame rate nor the scale: the strip's speed u is the median, over points fixed
in the part that is raised when the film begins, of how far each gets within a fixed window of time, per time.  (Of the
mean, a few points that were taken for the other layer would make a snap.)  Before the snap it follows the gripper, u_0;
the snap sets in when u has come half the way from u_0 to its first peak.  The slower the gripper, the nearer that is to
the static critical point; past it by a lag of order v^(2/3) to v^(4/5) (docs/physics.md, section 7).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import isotonic_regression, least_squares

from stripfold.arrays import Array

WINDOW = 0.15
"""Window of the speed, s: four or five frames at the usual 30 per second, three at 20."""
GRID = 0.005
"""Spacing of the moments at which the speed is evaluated, s."""
REFERENCE = 0.4
"""Share of the recording before the peak that tells how fast the strip follows its gripper."""
LEAST_RATIO = 1.6
"""Peak over u_0 below which a recording shows no snap that can be told from following."""
CLEAR_RATIO = 2.0
"""Peak over u_0 from which the first such peak is the snap; where none is, the largest."""
STANDS_OUT = 8.0
"""How far a peak has to be above the speed of following, in standard deviations of that."""
FALLEN = 0.6
"""Share of its height to which the speed has to fall behind a peak: less is a ripple on the way up."""
DWARFED = 0.3
"""Height of a peak above u_0, as a share of the largest, below which it is no snap: something that passed, a ripple."""
SETTLING = 0.2
"""How long a strip swings after its gripper has started, s."""
RETURNS = 0.4
"""For how long after a burst of speed the strip is looked at, s."""
KEPT = 0.5
"""Share of the way gone in it that has to be kept."""
LYING = 0.1
"""Height below which the strip counts as lying, in the gripper's."""
FIRST_FRAMES = 5
SEVERAL = 0.7
"""A second peak this high, as a share of the first above u_0, with a rest between them, makes several snaps."""
RESTED = 0.25
"""What counts as a rest between two peaks, as a share of the peak above u_0."""
APART = 0.3
"""Least time between two peaks that are two snaps, s."""


@dataclass(frozen=True, eq=False)
class Speed:
    """The strip's speed in time; m, s.

    Attributes
    ----------
    t, u
        Shape (m,): moments, and the speed in the window around each.
    following
        u_0: median while the strip followed its gripper.
    peak
        Index of the largest.
    """

    t: Array
    u: Array
    following: float
    peak: int

    @property
    def half(self) -> float:
        """Half the way from following to the peak."""
        return 0.5 * (self.following + float(self.u[self.peak]))

    @property
    def ratio(self) -> float:
        """Peak over following."""
        return float(self.u[self.peak]) / self.following

    @cached_property
    def rise(self) -> Array:
        """Shape (peak + 1,): the speed up to its peak, m/s, as it would be if it only rose.

        Of a level that noise or a swing makes the speed pass several times, this is the middle one; the last one
        would be late.
        """
        return np.asarray(isotonic_regression(self.u[: self.peak + 1]).x)

    @property
    def onset(self) -> float:
        """When the snap sets in: when the speed rises through the half."""
        return self.passes(self.half)

    def passes(self, level: float) -> float:
        """When the speed rises through ``level``, m/s; nan where it does not."""
        i = int(np.searchsorted(self.rise, level)) - 1
        if not 0 <= i < self.peak:
            return float("nan")
        share = (level - self.rise[i]) / (self.rise[i + 1] - self.rise[i])
        return float(self.t[i] + share * (self.t[i + 1] - self.t[i]))

    def slack(self, share: float) -> float:
        """By how much the onset moves, s, where the level half-way to the peak is wrong by a share of its height."""
        off = share * (self.half - self.following)
        return 0.5 * abs(self.passes(self.half + off) - self.passes(self.half - off))

    @property
    def several(self) -> bool:
        """Whether there is another peak like this one, with a rest between them."""
        above = (self.u - self.following) / (self.u[self.peak] - self.following)
        for other in np.flatnonzero((above > SEVERAL) & (np.abs(self.t - self.t[self.peak]) > APART)):
            first, last = sorted((int(other), self.peak))
            if above[first:last].min() < RESTED:
                return True
        return False


def speed(t: Array, points: Array) -> Speed:
    """The speed of points fixed in the material.

    Parameters
    ----------
    t
        Shape (n,): s, ascending; need not be equally spaced.
    points
        Shape (n, k, 2): m.
    """
    path = PchipInterpolator(t, points.reshape(len(t), -1))
    moments = np.arange(t[0] + 0.5 * WINDOW, t[-1] - 0.5 * WINDOW, GRID)
    way = (path(moments + 0.5 * WINDOW) - path(moments - 0.5 * WINDOW)).reshape(len(moments), -1, 2)
    u = np.median(np.linalg.norm(way, axis=2), axis=1) / WINDOW
    peak = _first_peak(u, lambda first, last: _got_away(path, moments, first, last))
    following = float(np.median(u[: max(int(REFERENCE * peak), 1)]))
    return Speed(moments, u, following, peak)


def _got_away(path: PchipInterpolator, t: Array, first: int, last: int) -> float:
    """How near, m, the strip comes, for a while after a burst of speed, to where it was before: mistakes go back."""
    start, end = t[first] - 0.5 * WINDOW, t[-1] + 0.5 * WINDOW
    before = path(start).reshape(-1, 2)
    later = np.minimum(t[last] + np.linspace(0.5 * WINDOW, RETURNS, 9), end)
    after = path(later).reshape(len(later), -1, 2)
    return float(np.median(np.linalg.norm(after - before, axis=2), axis=1).min())


def _first_peak(u: Array, got_away: Callable[[int, int], float]) -> int:
    """Index of the first maximum that stands out, from which the speed falls again, and that got the strip somewhere.

    The largest without one.  Something that passes in front of the strip takes it along and gives it back.
    """
    early = u[: max(int(REFERENCE * len(u)), 1)]
    usual = float(np.median(early))
    noise = 1.4826 * float(np.median(np.abs(early - usual)))
    least = max(CLEAR_RATIO * usual, usual + STANDS_OUT * noise, usual + DWARFED * (float(u.max()) - usual))
    peak, given_back = 0, 0
    for i, value in enumerate(u):
        if i < given_back or value > u[peak]:
            peak = i
        elif u[peak] > least and value < usual + FALLEN * (u[peak] - usual):
            slow = np.flatnonzero(u[:peak] < usual + RESTED * (u[peak] - usual))
            first = int(slow[-1]) if len(slow) else 0
            if got_away(first, i) > KEPT * GRID * float(u[first:i].sum()):
                return peak
            # What it took along is given back before long, in another burst.
            peak, given_back = i, i + round(RETURNS / GRID)
    return int(np.argmax(u))


def underway(t: Array, x: Array) -> tuple[float, float]:
    """From when to when a gripper is under way at its speed; x in m, shape (n,), at times t, s.

    Moments of starting and stopping are left out: there the strip swings.
    """
    path = PchipInterpolator(t, x)
    moments = np.arange(t[0] + WINDOW, t[-1] - WINDOW, 0.5 * WINDOW)
    speed = np.abs(path(moments + WINDOW) - path(moments - WINDOW)) / (2.0 * WINDOW)
    moving = np.flatnonzero(speed > 0.8 * np.quantile(speed, 0.8))
    return float(moments[moving[0]] + SETTLING), float(moments[moving[-1]])


def raised(points: Array, stations: Array, height: float) -> NDArray[np.bool_]:
    """Which stations are on the part that is raised in the first frames.

    Parameters
    ----------
    points
        Shape (n, k, 2): x and z, m.
    stations
        Shape (k,): lengths along the strip, m.
    height
        Of the gripper, m.
    """
    z = np.median(points[:FIRST_FRAMES, :, 1], axis=0)
    above = np.flatnonzero(z > z.min() + LYING * height)
    return np.asarray(np.arange(len(stations)) <= (above[-1] if len(above) else -1))


@dataclass(frozen=True, slots=True)
class StaticFit:
    """The quasi-static branch as a square root that ends at ``lam``, m; ``sd`` is what the fit says of it."""

    lam: float
    sd: float
    residual: float


FIT_BELOW = 0.25
"""The fit takes the frames until the speed has come this share of the way from following to its peak."""
LEAST_FRAMES = 12
VAGUE = 0.2
"""Standard deviation from which the end is out of sight, as a share of the way of the gripper that is fitted."""


def static_fit(lam: Array, points: Array) -> StaticFit | None:
    """Where the branch would end without a lag: points = a + b lam - c sqrt(lambda_c - lam), least squares.

    The lag that is left pushes it up, the more the faster the gripper.

    Parameters
    ----------
    lam
        Shape (n,): advance of the gripper, m, in the frames before the snap.
    points
        Shape (n, k, 2), m.

    Returns
    -------
    StaticFit or None
        None where the branch does not bend: its end is out of sight.
    """
    if len(lam) < LEAST_FRAMES:
        return None
    values = points.reshape(len(lam), -1)
    span = float(np.ptp(lam))
    # One coordinate is enough: the one that says most of the motion.
    left, singular, _ = np.linalg.svd(values - values.mean(axis=0), full_matrices=False)
    coordinate = left[:, 0] * singular[0]

    def basis(end: float) -> Array:
        return np.column_stack([np.ones_like(lam), lam - lam[0], np.sqrt(np.maximum(end - lam, 0.0))])

    def residual(ahead: Array) -> Array:
        matrix = basis(float(lam.max() + span * np.exp(ahead[0])))
        fitted = matrix @ np.linalg.lstsq(matrix, coordinate, rcond=None)[0]
        return np.asarray(coordinate - fitted)

    found = min((least_squares(residual, [guess]) for guess in (-6.0, -4.0, -2.0, 0.0)), key=lambda r: float(r.cost))
    distance = span * float(np.exp(found.x[0]))
    if distance > span or distance < 1e-6 * span:
        return None
    noise = float(np.sqrt(2.0 * found.cost / max(len(lam) - 4, 1)))
    slope = float(np.linalg.norm(found.jac[:, 0]))
    sd = distance * noise / slope if slope else float("inf")
    return StaticFit(float(lam.max() + distance), sd, noise) if sd < VAGUE * span else None

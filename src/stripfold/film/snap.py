"""The snap in a recording: its onset, and whether there is one.

The strip's speed u is the root mean square over material points of the part that is raised when the film begins: u^2
is its kinetic energy over half its mass.  Before the snap u follows the gripper, u_0; the onset is when u has risen
half-way from u_0 to its first peak.  It comes after the static critical point by a lag of order v^(2/3) to v^(4/5) in
the gripper's speed (docs/physics.md, section 6).

The definition depends on neither frame rate nor scale.  In a film u is estimated from the displacements within a fixed
window of time before each moment.  The snap accelerates and ends abruptly in the touch: of a speed that grows
exponentially up to its peak such a window shifts no relative level, a centred one shifts all by half its length.  Of
one that rises steadily it shifts them, too: see :attr:`Speed.delay`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import isotonic_regression

from stripfold.base.arrays import Array, Mask

WINDOW = 0.15
"""Window of the speed, s: four or five frames at the usual 30 per second, three at 20."""
LEVEL = 0.5
"""Share of the way to the peak at which the onset is, by its definition."""
SLOPE_SHARE = 0.4
"""Share of the onset's level, to either side, over which the slope of the speed is taken there."""
SLOW_RISE = 0.3
"""Time around the onset's level, within :data:`SLOPE_SHARE`, above which the window shifts the onset, s."""
STEP = 0.005
"""Spacing of the times at which the speed is evaluated, s."""
REFERENCE_SHARE = 0.4
"""Share of the recording before the peak from which u_0 is taken."""
MIN_RATIO = 1.6
"""Peak over u_0 below which a snap cannot be told from following."""
CLEAR_RATIO = 2.0
"""Peak over u_0 from which the first such peak is the snap; without one, the largest peak is."""
MIN_PEAK_SIGMA = 8.0
"""Least height of a peak above u_0, in standard deviations of the speed of following."""
MIN_PEAK_SHARE = 0.5
"""Least height of a peak above u_0, as a share of the largest: lower ones are ripples, swings or passing objects."""
PEAK_END = 0.35
"""Share of a peak's height to which the speed falls behind it: less is a ripple on the way up, or a late frame."""
MIN_ADVANCE = 0.002
"""Least motion of the gripper that has a direction, m."""
SETTLING_TIME = 0.1
"""For how long after its start, as a window sees it, the gripper's motion is left out, s: the strip swings."""
RETURN_TIME, MIN_NET_MOTION = 0.4, 0.5
"""A snap is irreversible: for so long after a burst of speed, s, this share of its path must remain."""
LYING_HEIGHT = 0.1
"""Height below which the strip counts as lying, as a share of the gripper's."""
LANDED_HEIGHT = 0.05
"""Height of the upper layer, as a share of the gripper's, that it has only past the loss of stability."""
FIRST_FRAMES, END_FRAMES = 5, 3
REST = 0.25
"""Share of a peak's height below which the strip rests."""
SECOND_PEAK, SECOND_PEAK_DELAY = 0.7, 0.3
"""Height, as a share of the peak's, and distance, s, from which another peak is a snap too, with a rest between."""


@dataclass(frozen=True, eq=False)
class Speed:
    """The strip's speed over time.

    ``t``, s, and ``u``, the speed in the window before it, m/s, have shape (m,); ``following`` is u_0, the median while
    the strip followed its gripper, m/s; ``peak`` is the index of the peak.
    """

    t: Array
    u: Array
    following: float
    peak: int

    def level(self, share: float) -> float:
        """Speed at a share of the way from following to the peak, m/s."""
        return self.following + share * (float(self.u[self.peak]) - self.following)

    @property
    def ratio(self) -> float:
        """Peak over following."""
        return float(self.u[self.peak]) / self.following

    @cached_property
    def rise(self) -> Array:
        """Isotonic regression of the speed up to its peak, m/s: of several crossings of a level it has the middle."""
        return np.asarray(isotonic_regression(self.u[: self.peak + 1]).x)

    @property
    def onset(self) -> float:
        """Onset of the snap, s: when the speed rises half-way to its peak; nan where it does not."""
        return self.crossing(self.level(LEVEL))

    def crossing(self, level: float) -> float:
        """When the speed rises through ``level``, m/s; nan where it does not."""
        i = int(np.searchsorted(self.rise, level)) - 1
        if not 0 <= i < self.peak:
            return float("nan")
        share = (level - self.rise[i]) / (self.rise[i + 1] - self.rise[i])
        return float(self.t[i] + share * (self.t[i + 1] - self.t[i]))

    def onset_shift(self, error: float) -> float:
        """By how much the onset moves, s, if its level is wrong by this share of the level's height above u_0.

        From the mean slope around the onset: at a single level a disturbance may have made the speed jump.
        """
        return 0.5 * self._rise_time * error / SLOPE_SHARE

    @property
    def fall(self) -> float:
        """Largest fall of the speed between the onset and the peak, as a share of the peak's height above u_0.

        A snap accelerates up to the touch: where the speed falls before, the peak may be wrong by as much.
        """
        u = self.u[int(np.searchsorted(self.t, self.onset)) : self.peak + 1]
        return float((np.maximum.accumulate(u) - u).max(initial=0.0) / (self.level(1.0) - self.following))

    @property
    def drift(self) -> float:
        """How well u_0 is known, as a share of the peak's height above it: what its first window of time changes.

        A strip that does not follow yet where the film begins is slower there.
        """
        used = self.u[: _reference(self.peak)]
        later = used[min(round(WINDOW / STEP), len(used) // 2) :]
        return float(abs(np.median(later) - self.following) / (self.level(1.0) - self.following))

    @property
    def delay(self) -> float:
        """The window, s, as far as the rise takes longer than it.

        Of a speed that rises steadily the window delays all levels by half its length and lowers the peak and, half as
        much, the level of the onset: together a quarter of it.  Of a rise within the window only the end counts.
        """
        return WINDOW / (1.0 + (SLOW_RISE / self._rise_time) ** 2)

    @property
    def _rise_time(self) -> float:
        """For how long the speed is around the onset's level, s; nan where it starts above."""
        low, high = (self.crossing(self.level(LEVEL * (1.0 + sign * SLOPE_SHARE))) for sign in (-1.0, 1.0))
        return high - low

    @property
    def several(self) -> bool:
        """Whether there is another peak like this one, with a rest between them."""
        height = (self.u - self.following) / (self.u[self.peak] - self.following)
        others = np.flatnonzero((height > SECOND_PEAK) & (np.abs(self.t - self.t[self.peak]) > SECOND_PEAK_DELAY))
        return any(height[min(i, self.peak) : max(i, self.peak)].min() < REST for i in others)


def speed(t: Array, points: Array) -> Speed:
    """The speed of material points, shape (n, k, 2), m, at ascending times, shape (n,), s."""
    path = PchipInterpolator(t, points.reshape(len(t), -1))
    times = np.arange(t[0] + WINDOW, t[-1], STEP)
    steps = round(WINDOW / STEP)
    places = path(times[0] - WINDOW + STEP * np.arange(len(times) + steps))
    u, median = (distance / WINDOW for distance in _distances(places[steps:], places[:-steps]))
    # Of the median, which an object that hides the strip in part does not change.
    first = _first_peak(path, times, median)
    near = slice(max(first - steps, 0), first + steps + 1)
    peak = near.start + int(np.argmax(u[near]))
    following = float(np.median(u[: _reference(peak)]))
    return Speed(times, u, following, peak)


def _reference(peak: int) -> int:
    """How many speeds before the peak u_0 is taken from."""
    return max(int(REFERENCE_SHARE * peak), 1)


def _distances(a: Array, b: Array) -> tuple[Array, Array]:
    """Distances between shapes, each (m, 2 k): root mean square and median over their points."""
    x, z = np.moveaxis((a - b).reshape(len(a), -1, 2), 2, 0)
    squares, middle = x * x + z * z, x.shape[1] // 2
    return np.sqrt(squares.mean(axis=1)), np.sqrt(np.partition(squares, middle, axis=1)[:, middle])


def _first_peak(path: PchipInterpolator, t: Array, u: Array) -> int:
    """Index of the first outstanding maximum that displaced the strip for good; the largest without one.

    An object that passes in front of the strip takes it along and gives it back.
    """
    early = u[: max(int(REFERENCE_SHARE * len(u)), 1)]
    usual = float(np.median(early))
    sigma = 1.4826 * float(np.median(np.abs(early - usual)))
    least = max(CLEAR_RATIO * usual, usual + MIN_PEAK_SIGMA * sigma, usual + MIN_PEAK_SHARE * (float(u.max()) - usual))
    peak, resume = 0, 0
    for i, value in enumerate(u):
        if i < resume or value > u[peak]:
            peak = i
        elif u[peak] > least and value < usual + PEAK_END * (u[peak] - usual):
            resting = np.flatnonzero(u[:peak] < usual + REST * (u[peak] - usual))
            first = int(resting[-1]) if len(resting) else 0
            later = np.minimum(t[i] + np.linspace(0.0, RETURN_TIME, 9), t[-1])
            net = _distances(path(later), path(t[first] - WINDOW)[None])[1].min()
            if net > MIN_NET_MOTION * STEP * float(u[first:i].sum()):
                return peak
            # The strip comes back before long, in another burst.
            peak, resume = i, i + round(RETURN_TIME / STEP)
    return int(np.argmax(u))


def advances(advance: Array) -> list[slice]:
    """Find the frames of each advance of a gripper that between them returns, by its advance, shape (n,), m.

    The first begins with the film and the last ends with it, unless the gripper moves back then.
    """
    found: list[slice] = []
    begin = top = 0
    rising = True
    for i, value in enumerate(advance):
        if rising and value >= advance[top]:
            top = i
        elif rising and advance[top] - value > MIN_ADVANCE:
            if advance[top] - advance[begin] > MIN_ADVANCE:
                found.append(slice(begin, top + 1))
            rising, begin = False, i
        elif not rising and value <= advance[begin]:
            begin = i
        elif not rising and value - advance[begin] > MIN_ADVANCE:
            rising, top = True, i
    if rising:
        found.append(slice(begin, len(advance)))
    return found


def steady_advance(t: Array, advance: Array) -> tuple[float, float]:
    """First and last time, s, at which a gripper advances, m, at its speed, without starting and stopping."""
    path = PchipInterpolator(t, advance)
    times = np.arange(t[0] + WINDOW, t[-1] - WINDOW, 0.5 * WINDOW)
    speed = (path(times + WINDOW) - path(times - WINDOW)) / (2.0 * WINDOW)
    moving = np.flatnonzero(speed > 0.8 * np.quantile(speed, 0.8))
    return float(times[moving[0]] + SETTLING_TIME), float(times[moving[-1]])


def raised(points: Array, height: float) -> Mask:
    """Which points, shape (n, k, 2), m, are raised in the first frames, shape (k,); ``height`` is the gripper's, m."""
    z = np.median(points[:FIRST_FRAMES, :, 1], axis=0)
    above = np.flatnonzero(z > z.min() + LYING_HEIGHT * height)
    return np.asarray(np.arange(len(z)) <= (above[-1] if len(above) else -1))


def landed(points: Array, height: float) -> tuple[bool, bool]:
    """Whether the upper layer is close to the table in the first and in the last frames: it may hide the lower one.

    ``points``, shape (n, k, 2), m, are the raised ones, under a gripper at this ``height``, m.
    """

    def close(frames: Array) -> bool:
        x, z = np.median(frames, axis=0).T
        bend = int(np.argmax(np.abs(x - x[0])))
        return float(z[: bend + 1].min()) < LANDED_HEIGHT * height

    return close(points[:END_FRAMES]), close(points[-END_FRAMES:])

"""The critical point of the x-axis continuation: the first maximum of the gripper's advance, a limit point.

Results for heights of 0.1 to 100 L* (docs/physics.md, section 4):

* From the state without horizontal force the advance grows monotonically up to one event. Below ``touch_limit()`` =
  1.58617085 L* that is contact of the sag with the lower layer; the free strip's branch has its maximum beyond it.
  For z -> 0 the touching state tends to the folded one (advance 7.168090).
* Above it, it is the maximum, with the sag clear of the lower layer; from z = 60.57 on nothing sags.
* The strip is compressed before, most at low heights: F_x falls to about -2.75 / z^2 and the curvature reaches about
  2.5 / z, as in an elastica without weight. Buckling of the lying part is not considered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from stripfold.arrays import Array, Mask
from stripfold.elastica._checks import height
from stripfold.elastica._continuation import Point, at_height, polish, regrid, zero_between
from stripfold.elastica._system import next_count
from stripfold.elastica.branch import coarse_branch
from stripfold.elastica.state import State

Event = Callable[[Point], float]
"""A test function: positive on the branch up to the event."""


@dataclass(frozen=True, eq=False)
class CriticalPoint:
    """The end of the monotonic advance at one gripper height; lengths in L*.

    ``snap`` is True if the advance has its maximum, a limit point, where the strip snaps through, and False if the sag
    touches the lower layer first. ``state`` is the critical state, or the one at first contact (``clearance`` 0).
    """

    z: float
    snap: bool
    state: State

    @property
    def advance(self) -> float:
        """lambda_c; nan without a snap."""
        return self.state.advance if self.snap else np.nan

    @property
    def length(self) -> float:
        """Length l of the free part at the critical point; nan without a snap."""
        return self.state.length if self.snap else np.nan

    @property
    def x(self) -> float:
        """X of the gripper at the critical point; nan without a snap."""
        return self.state.gripper[0] if self.snap else np.nan

    @property
    def clearance(self) -> float:
        """Height of the sag at the critical point, ``inf`` where nothing sags; nan without a snap."""
        return self.state.clearance if self.snap else np.nan


def critical(z: float) -> CriticalPoint:
    """First maximum of the advance at gripper height ``z`` (0.1 to 100 L*), or contact of the sag if that comes first.

    Located to 1e-10 in arc length of the branch.

    Raises
    ------
    InvalidInputError
        ``z`` outside its range or not a number.
    SolveError
        The branch could not be followed, or the event not located.

    Examples
    --------
    >>> point = critical(3.0)
    >>> point.snap, round(point.advance, 6), round(point.length, 6), round(point.x, 6)
    (True, 9.856908, 7.133077, -2.723831)
    >>> critical(1.0).snap
    False
    """
    z = height(z)
    event, point = _first_event(z)
    return CriticalPoint(z, event is _rate, State._from(point.e))


def advance_on_finer_grid(point: CriticalPoint) -> float:
    """The advance at the same event, solved with about twice the nodes, for an estimate of the discretisation error."""
    event, located = _first_event(point.z)
    family = at_height(point.z)
    finer = regrid(located, family, next_count(next_count(located.e.grid.n)))
    return State._from(polish(finer, family, event).e).advance


@lru_cache(maxsize=1)
def touch_limit() -> float:
    """The height z / L* at which the sag of the critical state just touches the lower layer.

    Above it the strip snaps through at the maximum of the advance, below it the sag touches first.

    Examples
    --------
    >>> round(touch_limit(), 6)
    1.586171
    """

    def gap(z: float) -> float:
        before, after = _bracket(z, lambda point: point.rate < 0.0)
        return State._from(zero_between(before, after, at_height(z), _rate).e).clearance

    return float(brentq(gap, 1.5, 1.7, xtol=1e-11, rtol=1e-12))


@dataclass(frozen=True, eq=False)
class MasterCurve:
    """Critical points over the gripper height, shape (m,) each, in L*: the fields of :class:`CriticalPoint`."""

    z: Array
    snap: Mask
    advance: Array
    length: Array
    x: Array
    clearance: Array


def master_curve(z: Iterable[float]) -> MasterCurve:
    """The critical points at gripper heights ``z``, L*: one curve for all materials. Raises as :func:`critical`.

    Examples
    --------
    >>> master_curve([2.0, 3.0]).advance.round(6).tolist()
    [8.97838, 9.856908]
    """
    points = [critical(value) for value in z]
    names = ("z", "snap", "advance", "length", "x", "clearance")
    return MasterCurve(*(np.array([getattr(point, name) for point in points]) for name in names))


def clearance(point: Point) -> float:
    """Clearance of a state, without a jump where a sag appears, which is at the gripper."""
    state = State._from(point.e)
    return min(state.gripper[1], state.clearance)


def _rate(point: Point) -> float:
    return point.rate


def _touches(point: Point) -> bool:
    """Whether the sag has reached the lower layer."""
    e = point.e
    minima = np.flatnonzero((e.sin[:-1] < 0.0) & (e.sin[1:] >= 0.0))
    # A lower bound of Z at each minimum, from the slope at the node before it: cheap, and mostly positive.
    fall = 2.0 * np.diff(e.grid.nodes)[minima] * e.sin[minima]
    lower_bound = e.length * (e.grid.integral[minima] @ e.sin + fall)
    return bool(np.any(lower_bound <= 0.0)) and clearance(point) <= 0.0


def _bracket(z: float, passed: Callable[[Point], bool]) -> tuple[Point, Point]:
    """The first two successive points of the branch between which the event occurs."""
    return next(pair for pair in pairwise(coarse_branch(z)) if passed(pair[1]))


def _first_event(z: float) -> tuple[Event, Point]:
    """The event that ends the advance, zero rate or zero clearance, and its point."""
    before, after = _bracket(z, lambda point: point.rate < 0.0 or _touches(point))
    if _rate(after) < 0.0:
        point = zero_between(before, after, at_height(z), _rate)
        if clearance(point) > 0.0:
            return _rate, point
    return clearance, zero_between(before, after, at_height(z), clearance)

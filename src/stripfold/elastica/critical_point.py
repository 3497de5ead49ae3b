"""The critical point of the x-axis continuation: where the gripper's advance has its first maximum.

What was found over the heights 0.1 to 100 L* (docs/physics.md, section 4):

* From the state without horizontal force the advance grows steadily up to one event.  Below
  ``touch_limit()`` = 1.58617085 L* that is the touch of the sag, at every height down to 0.1; the
  maximum of the advance still exists on the branch of the free strip, but only behind the touch.
  For z -> 0 the touching state tends to the folded one (advance 7.168090).
* Above it, it is the maximum, with the sag hanging clear; from z = 60.57 on nothing sags any more.
* On the way the strip is pushed, hardest at low heights: F_x falls to about -2.75 / z^2 and the
  curvature reaches about 2.5 / z, the elastica without weight.  Whether the lying part can carry that
  push without a ruck is not asked here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from stripfold.arrays import Array
from stripfold.elastica._checks import height
from stripfold.elastica._continuation import Point, at_height, locate, march, polish, regridded
from stripfold.elastica._system import next_count
from stripfold.elastica.branch import COARSE, FIRST_STEP, MAX_STEP, first_point
from stripfold.elastica.state import State
from stripfold.errors import InvalidInputError

Event = Callable[[Point], float]
"""Positive on the branch up to where it happens."""

ROUGHLY = 1e-3
"""How near an event is located before the branch is resolved there, in arc length."""


@dataclass(frozen=True, eq=False)
class Touch:
    """First touch of the sag and the layer below, before the advance has had a maximum.

    Parameters
    ----------
    advance
        lambda at the touch, in L*.
    state
        The state; its ``clearance`` is 0.
    s, x
        Arc length and X of the touching point, in L*.
    """

    advance: float
    state: State
    s: float
    x: float


@dataclass(frozen=True, eq=False)
class Critical:
    """What ends the smooth advance at one gripper height; lengths in L*.

    Parameters
    ----------
    z
        Gripper height.
    snap
        True: the advance has a maximum, the free strip snaps through there.
        False: the sag touches first; ``touch`` says where, and the numbers below are nan.
    reason
        The same in words.
    advance, length, x
        lambda_c, length l of the free part and X of the gripper at the critical point.
    clearance
        Height of the sag over the lower layer there; ``inf`` where nothing sags.
    state
        The critical state, or None.
    touch
        The first touch, or None.
    """

    z: float
    snap: bool
    reason: str
    advance: float
    length: float
    x: float
    clearance: float
    state: State | None
    touch: Touch | None


def _clearance(point: Point, z: float) -> float:
    """Clearance that is continuous: a sag appears at the gripper, at its height."""
    return min(z, State._from(point.e).clearance)


def _down(point: Point, z: float) -> bool:
    """Whether the sag has come down to the lower layer."""
    e = point.e
    at = np.flatnonzero((e.sin[:-1] < 0.0) & (e.sin[1:] >= 0.0))
    # The sag is not lower than twice the slope at the node before it can take it there: mostly that settles the matter.
    fall = 2.0 * np.diff(e.grid.nodes)[at] * e.sin[at]
    lowest = e.length * (e.grid.integral[at] @ e.sin + fall)
    return bool(np.any(lowest <= 0.0)) and _clearance(point, z) <= 0.0


def _rate(point: Point) -> float:
    return point.rate


def _bracket(z: float, passed: Callable[[Point], bool]) -> tuple[Point, Point]:
    """The first neighbours on the branch of which the second one has passed the event."""
    before = first_point(z, COARSE)
    for point in march(before, at_height(z), step=FIRST_STEP, max_step=MAX_STEP, tolerance=COARSE):
        if passed(point):
            return before, point
        before = point
    raise AssertionError("march does not end without raising")


def _resolved(before: Point, after: Point, z: float, event: Event) -> Point:
    """The point between two neighbours where ``event`` vanishes."""
    return polish(locate(before, after, at_height(z), event, ROUGHLY), at_height(z), event)


def critical(z: float) -> Critical:
    """First maximum of the advance along the x-axis branch, or the touch that comes before it.

    Parameters
    ----------
    z
        Gripper height in L*, from 0.1 to 100.

    Returns
    -------
    Critical
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
    event, end = _first_event(z)
    state = State._from(end.e)
    if event is _rate:
        reason = "the advance has a maximum: the strip snaps through"
        x = state.gripper[0]
        return Critical(z, True, reason, state.advance, state.length, x, state.clearance, state, None)
    s = state.length if state.sag is None else state.sag.s
    touch = Touch(state.advance, state, s, float(state.at(s).x))
    reason = "the sag touches the lower layer before the advance has a maximum: no snap of this kind"
    nan = float("nan")
    return Critical(z, False, reason, nan, nan, nan, nan, None, touch)


def _first_event(z: float) -> tuple[Event, Point]:
    """What ends the advance, its rate or the clearance becoming zero, and where."""

    def clearance(point: Point) -> float:
        return _clearance(point, z)

    before, after = _bracket(z, lambda p: p.rate < 0.0 or _down(p, z))
    passed = [event for event in (_rate, clearance) if event(after) <= 0.0]
    # Where one step has passed both, that which a straight line meets first is tried first.
    passed.sort(key=lambda event: event(before) / (event(before) - event(after)))
    for event in passed:
        end = _resolved(before, after, z, event)
        if all(other(end) > 0.0 for other in passed if other is not event):
            break
    return event, end


def resolved_again(found: Critical) -> float:
    """The advance at the end that was found, solved once more on a grid of about twice the nodes: what it is off by.

    Raises
    ------
    SolveError
        The finer grid has no such state near.
    """
    event, near = _first_event(found.z)
    family = at_height(found.z)
    finer = regridded(near, family, next_count(next_count(near.e.grid.n)))
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
        return State._from(_resolved(*_bracket(z, lambda p: p.rate < 0.0), z, _rate).e).clearance

    return float(brentq(gap, 1.5, 1.7, xtol=1e-11, rtol=1e-12))


@dataclass(frozen=True, eq=False)
class MasterCurve:
    """Critical points over the gripper height, shape (m,) each, in L*.

    ``advance``, ``length``, ``x`` and ``clearance`` are nan where the sag touches first
    (``snap`` False); see :class:`Critical`.
    """

    z: Array
    snap: NDArray[np.bool_]
    advance: Array
    length: Array
    x: Array
    clearance: Array


def master_curve(z: ArrayLike) -> MasterCurve:
    """The critical advance over the gripper height: one curve for all materials.

    Parameters
    ----------
    z
        Gripper heights in L*, shape (m,), each from 0.1 to 100.

    Raises
    ------
    InvalidInputError
        Not a list of numbers, or a height outside the range.
    SolveError
        A point could not be computed; nothing is filled in for it.

    Examples
    --------
    >>> master_curve([2.0, 3.0]).advance.round(6).tolist()
    [8.97838, 9.856908]
    """
    try:
        heights = np.array(z, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError("z", z, "a list of numbers, in units of L*") from None
    if heights.ndim != 1:
        raise InvalidInputError("z", z, "a list of numbers, in units of L*")
    points = [critical(float(value)) for value in heights]
    columns = {
        name: np.array([getattr(point, name) for point in points], dtype=np.float64)
        for name in ("advance", "length", "x", "clearance")
    }
    return MasterCurve(heights, np.array([point.snap for point in points], dtype=np.bool_), **columns)

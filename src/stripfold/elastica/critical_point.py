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

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import ContinuationError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import MAX_HEIGHT, MIN_HEIGHT, height
from stripfold.elastica._events import SNAP, SNAP_AT_HEIGHT, TOUCH
from stripfold.elastica._starts import START_OF_SNAPS, start
from stripfold.elastica._system import gripper_at, no_lift_off_moment, solve
from stripfold.elastica.branch import state_at
from stripfold.elastica.state import State


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

    By Newton's method on the equilibrium and the event, from a stored approximation (:mod:`._starts`). At the maximum
    the sag must be clear of the lower layer, at contact the advance must still grow.

    Raises InvalidInputError: ``z`` outside its range or not a number; SolveError: the event was not found.

    Examples
    --------
    >>> point = critical(3.0)
    >>> point.snap, round(point.advance, 6), round(point.length, 6), round(point.x, 6)
    (True, 9.856908, 7.133077, -2.723831)
    >>> critical(1.0).snap
    False
    """
    z = height(z)
    expected = z > START_OF_SNAPS
    for snap in (expected, not expected):
        e = solve(start(z, snap), (*gripper_at(z), (SNAP if snap else TOUCH).condition))
        state = State._from(e)
        if (state.clearance if snap else SNAP_AT_HEIGHT.sign(e, e.y)) > 0.0:
            return CriticalPoint(z, snap, state)
    raise ContinuationError(f"neither a maximum of the advance nor contact was found at z = {z:g}", parameter=z)


def touch_limit() -> float:
    """The height z / L* at which the sag of the critical state just touches the lower layer.

    Above it the strip snaps through at the maximum of the advance, below it the sag touches first.

    Examples
    --------
    >>> round(touch_limit(), 6)
    1.586171
    """
    return touch_limit_state().gripper[1]


@lru_cache(maxsize=1)
def touch_limit_state() -> State:
    """The critical state whose sag just touches the lower layer."""
    return State._from(solve(start(START_OF_SNAPS, True), (no_lift_off_moment, TOUCH.condition, SNAP.condition)))


NODES = 64
"""Solved heights on either side of the touch limit: what is between them is within 1e-10 L*, half of them would do for
1e-8 L*."""


class EndOfAdvance(NamedTuple):
    """A snap or, without one, the first touch of the sag; lambda and the length of the free part then, L*."""

    snap: bool
    advance: float
    length: float


def end_of_advance(z: float) -> EndOfAdvance:
    """What :func:`critical` finds, without its state, interpolated between solved heights in a hundredth of the time.

    Raises InvalidInputError: ``z`` outside its range or not a number; SolveError: the elastica could not be solved.

    Examples
    --------
    >>> end = end_of_advance(3.0)
    >>> end.snap, round(end.advance, 9) == round(critical(3.0).advance, 9)
    (True, True)
    """
    z = height(z)
    snap = z > touch_limit()
    low, high = _range(snap)
    advance, length = grid(NODES).interpolate(_solved(snap), np.log(z / low) / np.log(high / low))
    return EndOfAdvance(snap, float(advance), float(length))


def _range(snap: bool) -> tuple[float, float]:
    return (touch_limit(), MAX_HEIGHT) if snap else (MIN_HEIGHT, touch_limit())


@lru_cache(maxsize=2)
def _solved(snap: bool) -> Array:
    """Advance and length at the nodes of the height's logarithm, shape (n, 2)."""
    low, high = _range(snap)
    inner = [critical(float(z)).state for z in low * (high / low) ** grid(NODES).nodes[1:-1]]
    limit, other = touch_limit_state(), critical(high if snap else low).state
    states = [limit, *inner, other] if snap else [other, *inner, limit]
    return np.array([(state.advance, state.length) for state in states])


def friction_delay(z: float, difference: float = 1e-4) -> float:
    """Rise of lambda_c over the friction moment M_0 for small M_0, L* per rho_a g L*^2; nan without a snap.

    At the maximum of lambda each section bends on as in the critical mode.  By virtual work on that mode the friction
    shifts the maximum by M_0 times the integral of |d kappa|, at fixed places of the strip, over the change of the
    horizontal force; both are differences of states of the branch, ``difference`` L* of free length to either side.

    Examples
    --------
    >>> round(friction_delay(3.0), 2)
    9.6
    """
    point = critical(z)
    if not point.snap:
        return float("nan")
    at = point.state
    before, after = (state_at(z, at.length + d, at) for d in (-difference, difference))
    # From the gripper, so that places belong to the strip.
    s = np.linspace(0.0, before.length, 4001)
    change = after.at(after.length - s).curvature - before.at(before.length - s).curvature
    return float(np.trapezoid(np.abs(change), s)) / abs(after.force_x - before.force_x)

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
from pathlib import Path
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import ContinuationError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._continuation import SNAP, SNAP_AT_HEIGHT, TOUCH
from stripfold.elastica._system import LENGTH, SCALARS, gripper_at, next_count, no_lift_off_moment, refine, solve
from stripfold.elastica.branch import MAX_HEIGHT, MIN_HEIGHT, checked_height, state_at
from stripfold.elastica.state import State

TABLE = Path(__file__).with_name("starts.csv")
"""Approximations of the critical and touching states, from which Newton starts; ``make starts`` computes them anew."""
START_OF_SNAPS = 1.586
"""Height up to which contact is expected to come first."""
RANGES = (0.1, 1.7), (1.5, 100.0)
"""Heights of the touching and of the critical states."""
HEIGHTS, NODES = 14, 40
"""Numbers of heights in each range, at Chebyshev nodes of the logarithm, and of nodes of each state."""
SOLVED = 64
"""Solved heights on either side of the touch limit: what is between them is within 1e-10 L*."""


def start(z: float, snap: bool) -> Array:
    """Approximate unknowns of the critical state at height ``z``, or of the touching one, with about enough nodes."""
    low, high = np.log(RANGES[snap])
    y = grid(HEIGHTS).interpolate(_table()[int(snap)], (np.log(z) - low) / (high - low))
    y[:-SCALARS] *= y[LENGTH] ** 2
    return refine(y, next_count(int(61.5 + 1.6 * z)))


@lru_cache(maxsize=1)
def _table() -> Array:
    """d^2 theta / ds^2 at the nodes and the three scalars: of each range, height and unknown."""
    return np.loadtxt(TABLE, delimiter=",").reshape(2, HEIGHTS, NODES + SCALARS)


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

    By Newton's method on the equilibrium and the event, from a stored approximation (:data:`TABLE`). At the maximum
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
    z = checked_height(z)
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
    z = checked_height(z)
    snap = z > touch_limit()
    low, high = _range(snap)
    advance, length = grid(SOLVED).interpolate(_solved(snap), np.log(z / low) / np.log(high / low))
    return EndOfAdvance(snap, float(advance), float(length))


def _range(snap: bool) -> tuple[float, float]:
    return (touch_limit(), MAX_HEIGHT) if snap else (MIN_HEIGHT, touch_limit())


@lru_cache(maxsize=2)
def _solved(snap: bool) -> Array:
    """Advance and length at the nodes of the height's logarithm, shape (n, 2)."""
    low, high = _range(snap)
    inner = [critical(float(z)).state for z in low * (high / low) ** grid(SOLVED).nodes[1:-1]]
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

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

import numpy as np

from stripfold.elastica._checks import height
from stripfold.elastica._events import SNAP, SNAP_AT_HEIGHT, TOUCH
from stripfold.elastica._starts import START_OF_SNAPS, start
from stripfold.elastica._system import gripper_at, no_lift_off_moment, solve
from stripfold.elastica.state import State
from stripfold.errors import ContinuationError


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

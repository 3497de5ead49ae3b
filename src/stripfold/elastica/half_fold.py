"""Families of states of a half fold, from which the R-path is planned (docs/physics.md, section 9).

The free part is lifted without horizontal force to the free length of the folded state, then the gripper moves over
with the lift-off point fixed until the sag touches the lower layer. The contact that follows is in
:mod:`.point_contact`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.elastica._continuation import Family, Point, between, march, point_at, to_event, until
from stripfold.elastica._events import SNAP_AT_HEIGHT, TOUCH, Event
from stripfold.elastica._system import FORCE_X, LENGTH, SCALARS, evaluate, fixed, no_lift_off_moment, refine, solve
from stripfold.elastica.branch import LIMIT_REACTION, no_force_guess
from stripfold.elastica.state import State

SHORTEST = 0.2  # free length, L*, below which a lifted strip counts as flat: its gripper is 7e-5 L* high
SPACING = 0.1  # largest distance of successive states, in free length or arc length
EXTRAPOLATION = np.array([4.0, -6.0, 4.0, -1.0])  # by a cubic, from equally spaced states, the last first


def states_no_horizontal_force(length: float) -> Iterator[State]:
    """States without horizontal force, the free length growing from :data:`SHORTEST` to ``length``, L* (up to 80)."""
    if length <= SHORTEST:
        return
    known: list[Array] = []
    for free in np.linspace(SHORTEST, length, int(np.ceil((length - SHORTEST) / SPACING)) + 1).tolist():
        y = _no_force(free, known)
        known = [y, *(refine(before, y.size - SCALARS) for before in known[: len(EXTRAPOLATION) - 1])]
        yield State._from(evaluate(y))


def _no_force(length: float, before: Sequence[Array] = ()) -> Array:
    """Unknowns of the state without horizontal force; ``before`` are those of equally spaced lengths, last first."""
    conditions = (no_lift_off_moment, fixed(FORCE_X, 0.0), fixed(LENGTH, length))
    if len(before) == len(EXTRAPOLATION):
        guess = EXTRAPOLATION @ np.array(before)
    else:
        guess = no_force_guess(min(length**4 / 24.0, max(length - LIMIT_REACTION, 0.6)))
    guess[LENGTH] = length
    return solve(guess, conditions).y


def states_fixed_lift_off(length: float) -> Iterator[State]:
    """States with a free part of ``length``, L*, from the one without horizontal force to first contact of the sag.

    By continuation in arc length: gripper position and force have turning points on the way.
    """
    family, points = _fixed_length_branch(length)
    return (State._from(point.e) for point in to_event(points, family, TOUCH))


def states_drawn_taut(length: float, force: float) -> Iterator[State]:
    """States with a free part of ``length``, L*, from the one without horizontal force to a tension of ``force``."""
    family, points = _fixed_length_branch(length, -1.0)
    taut = Event(lambda e, _: force - float(e.y[FORCE_X]), fixed(FORCE_X, force))
    return (State._from(point.e) for point in to_event(points, family, taut))


def critical_state_fixed_lift_off(length: float) -> State:
    """The state of :func:`states_fixed_lift_off` that becomes unstable: the gripper is at lambda_c of its height.

    An independent way to lambda_c(z), and the point where the R-path meets the stability boundary.

    Raises SolveError: the strip is stable up to contact.
    """
    family, points = _fixed_length_branch(length)
    for before, after in pairwise(until(points, TOUCH)):
        if SNAP_AT_HEIGHT.sign(before.e, before.tangent) > 0.0 > SNAP_AT_HEIGHT.sign(after.e, after.tangent):
            return State._from(between(before, after, family, SNAP_AT_HEIGHT).e)
    raise SolveError(f"with a free length of {length:g} L* the strip touches before it becomes unstable")


def _fixed_length_branch(length: float, way: float = 1.0) -> tuple[Family, Iterator[Point]]:
    """The family of states with this free length, and its points from the one without horizontal force on.

    ``way`` is 1 towards compression and -1 towards tension.
    """
    family = Family((no_lift_off_moment, fixed(LENGTH, length)), f"a free length of {length:g}")
    e = evaluate(_no_force(length))
    forward = np.zeros(e.y.size)
    forward[FORCE_X] = -way  # as the gripper moves over, it compresses the strip
    return family, march(point_at(e, family, forward), family, step=SPACING, max_step=SPACING)

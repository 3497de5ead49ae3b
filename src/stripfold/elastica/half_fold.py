"""Families of states of a half fold, from which the R-path is planned (docs/physics.md, section 9).

The free part is lifted without horizontal force to the free length of the folded state, then the gripper moves over
with the lift-off point fixed until the sag touches the lower layer.  The contact point rolls on until the curvature
there vanishes; from then on the strip lies flat behind it and the loop is the folded one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._continuation import (
    SNAP_AT_HEIGHT,
    TOUCH,
    Event,
    Family,
    Point,
    between,
    march,
    point_at,
    to_event,
    until,
)
from stripfold.elastica._system import (
    FORCE_X,
    LENGTH,
    SCALARS,
    Condition,
    end_angle,
    end_height,
    evaluate,
    fixed,
    linear,
    no_lift_off_moment,
    refine,
    solve,
)
from stripfold.elastica.branch import LIMIT_REACTION, no_force_guess
from stripfold.elastica.state import State

SHORTEST = 0.2  # free length, L*, below which a lifted strip counts as flat: its gripper is 7e-5 L* high
SPACING = 0.1  # largest distance of successive states, in free length, arc length or curvature at the contact
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


@dataclass(frozen=True, eq=False)
class PointContact:
    """A free part in contact with the lower layer at one point.

    ``loop`` is the part from lift-off to the contact, where its curvature does not vanish; ``upper`` the part from the
    contact, where its arc length starts, to the gripper, in the loop's frame; ``reaction`` that of the floor at the
    contact.
    """

    loop: State
    upper: State
    reaction: float

    @property
    def gripper(self) -> tuple[float, float]:
        """Position (X, Z) of the gripper."""
        return self.upper.gripper


def states_point_contact(first: State, height: float | None = None) -> Iterator[PointContact]:
    """States of one free length or one ``height``: the curvature at the contact goes from that of ``first`` to zero.

    ``first`` is the state at first contact, such as the last of :func:`.states_fixed_lift_off`.

    Raises SolveError: no convergence.
    """
    sag = first.sag
    if sag is None:
        raise SolveError("the state does not sag: it cannot touch")
    start = float(first.at(sag.s).curvature)
    loop, upper = _reversed(_cut(first, 0.0, sag.s), -np.pi), _mirrored(_cut(first, sag.s, first.length))
    for bend in start * np.linspace(1.0, 0.0, int(np.ceil(abs(start) / SPACING)) + 1):
        loop = _solve(loop, bend, end_angle(-np.pi))
        end = fixed(LENGTH, first.length - loop.length) if height is None else end_height(height)
        upper = _solve(upper, bend, end)
        before = _reversed(loop, np.pi)
        yield PointContact(before, _mirrored(upper, before.gripper), -loop.force_0 - upper.force_0)


# Seen from the contact, with X reversed, both parts are free parts that begin horizontally with a moment: the loop is
# turned by pi, so that its weight acts upwards, and its arc length is reversed, so that F_0 + s is that of the weight.


def _solve(guess: State, bend: float, last: Condition) -> State:
    """A part seen from the contact, of curvature ``-bend`` there, with one more condition.

    By the first integral, F_x is bend^2 / 4 in the loop's frame, as theta = pi and Z = 0 at the contact.
    """
    y = guess._unknowns()
    moment = linear(nodal=lambda g: g.slope[0], scalars={LENGTH: bend})
    return State._from(solve(y, (moment, fixed(FORCE_X, -(bend**2) / 4.0), last)))


def _cut(state: State, start: float, end: float) -> State:
    """The part between two arc lengths."""
    part = state.at(start + (end - start) * grid(state.s.size).nodes)
    return State.of(part.theta, part.curvature, state.force_x, state.force_0 + start, end - start)


def _mirrored(state: State, start: tuple[float, float] = (0.0, 0.0)) -> State:
    """The state with the direction of X reversed."""
    return State.of(np.pi - state.theta, -state.curvature, -state.force_x, state.force_0, state.length, start)


def _reversed(state: State, turn: float) -> State:
    """The state turned by pi, ``turn`` of either sign, and followed from its other end."""
    back = state.at(state.length - state.s)
    return State.of(back.theta + turn, -back.curvature, -state.force_x, -state.force_0 - state.length, state.length)

"""A free part that rests on the lower layer at one point: the phase of the R-path from first contact to the fold.

The contact point rolls on until the curvature there vanishes; from then on the strip lies flat behind it and the loop
is the folded one (docs/physics.md, section 9).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stripfold.base.errors import SolveError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._system import FORCE_X, LENGTH, Condition, end_angle, end_height, fixed, linear, solve
from stripfold.elastica.state import State

SPACING = 0.1  # largest difference of the curvature at the contact between successive states, 1/L*


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

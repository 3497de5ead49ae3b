"""States at a fixed gripper height: without horizontal force, at a given length, along the x-axis."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from stripfold.base.arguments import number
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._continuation import (
    LONGEST,
    SHORTEST,
    SNAP,
    Point,
    at_advance,
    at_height,
    at_length,
    between,
    located,
    march,
    point_at,
    until,
)
from stripfold.elastica._system import FORCE_X, LENGTH, Evaluation, evaluate, fixed, gripper_at, solve
from stripfold.elastica.state import State

MIN_HEIGHT, MAX_HEIGHT = 0.1, 100.0  # tested range of gripper heights of a branch, in L*
LIMIT_REACTION = 1.202702  # at lift-off, without horizontal force, for z -> infinity: a starting guess
FIRST_STEP, MAX_STEP = 0.2, 0.5  # in arc length, along a branch that is searched for an event


def checked_height(z: float, low: float = MIN_HEIGHT) -> float:
    """Gripper height as a float; raises InvalidInputError."""
    return number("z", z, ", in units of L*", (low, MAX_HEIGHT))


def no_force_guess(z: float) -> Array:
    """Initial guess of the unknowns of the state without horizontal force."""
    nodes = grid(24 if z < 5.0 else 48).nodes
    if z < 0.6:
        # Beam theory: EI Z'''' = -1 with Z = Z' = Z'' = 0 at lift-off and no moment at the gripper.
        length = (24.0 * z) ** 0.25
        return np.concatenate([length**3 * (0.5 - nodes), [0.0, -length / 2, length]])
    # A foot of fixed shape, about 2 L* long, below a part that hangs straight:
    # theta = pi/2 (1 - exp(-a s^2)), which has the exact slope of k at lift-off.
    length = z + LIMIT_REACTION
    s = length * nodes
    a = LIMIT_REACTION / np.pi
    second = length**2 * np.pi * a * (1.0 - 2.0 * a * s**2) * np.exp(-a * s**2)
    return np.concatenate([second, [0.0, -LIMIT_REACTION, length]])


def _no_force(z: float) -> Evaluation:
    y = solve(no_force_guess(z), (*gripper_at(z), fixed(FORCE_X, 0.0))).y
    y[FORCE_X] = 0.0  # remove rounding
    return evaluate(y)


def state_no_horizontal_force(z: float) -> State:
    """The state lambda_0: gripper at height ``z`` (1e-4 to 100 L*), ``force_x`` exactly 0 (docs/physics.md, section 4).

    Raises InvalidInputError: ``z`` outside its range or not a number; SolveError: no convergence.

    Examples
    --------
    >>> state = state_no_horizontal_force(20.0)
    >>> round(state.gripper[0], 6), round(state.reaction, 6)
    (2.036812, 1.202702)
    """
    return State._from(_no_force(checked_height(z, 1e-4)))


def points(z: float, max_step: float = MAX_STEP, way: float = 1.0) -> Iterator[Point]:
    """Points of the branch from lambda_0 on, without end; ``way`` is 1 for a growing advance, -1 for a falling one."""
    e, family = _no_force(z), at_height(z)
    forward = np.zeros(e.y.size)
    forward[FORCE_X] = -way  # as the gripper advances, it compresses the strip
    return march(point_at(e, family, forward), family, step=min(FIRST_STEP, max_step), max_step=max_step)


def x_axis_branch(z: float, *, past: float = 0.5, max_step: float = 0.3) -> Iterator[State]:
    """States at height ``z`` from lambda_0 up to and past the critical point, by pseudo-arclength continuation.

    Contact of the sag with the lower layer is *not* part of this model: states after the first one with
    ``clearance <= 0`` are equilibria of the free strip only.

    ``z``: gripper height in L*, from 0.1 to 100; ``past``: the branch ends when the advance has fallen by this much
    below its maximum, in L*; ``max_step``: largest step, in arc length (about radians of mean rotation).  Raises
    InvalidInputError, ContinuationError: an argument out of range; the branch could not be followed.

    Examples
    --------
    >>> states = list(x_axis_branch(3.0))
    >>> states[0].force_x, bool(max(state.advance for state in states) > 9.8)
    (0.0, True)
    """
    # The generator is separate, so that bad input raises here.
    return _states(checked_height(z), number("past", past, ", in units of L*"), number("max_step", max_step, ""))


def _states(z: float, past: float, max_step: float) -> Iterator[State]:
    highest = -np.inf
    for point in points(z, max_step):
        state = State._from(point.e)
        yield state
        highest = max(highest, state.advance)
        if state.advance < highest - past:
            return


def state_at(z: float, length: float, guess: State | None = None) -> State:
    """The state at height ``z`` with a free part of the given length.

    From lambda_0 the length falls to a minimum, then grows up to the critical point and beyond: up to two states of
    the branch have the same length. Without a guess the state *past the minimum* is found, where the critical
    point lies. With a guess Newton's method starts from it.

    Raises InvalidInputError: ``z`` outside 0.1 to 100 L*, or no such length at this height; the message names the
    range; SolveError: no convergence (as NewtonError or ContinuationError).

    Examples
    --------
    >>> round(state_at(3.0, 7.133077).advance, 6)
    9.856908
    """
    z, length = checked_height(z), number("length", length, ", in units of L*")
    conditions = (*gripper_at(z), fixed(LENGTH, length))
    if guess is not None:
        y = guess._unknowns()
        y[LENGTH] = length
        return State._from(solve(y, conditions))

    family, branch = at_height(z), points(z)
    *_, before, after = until(branch, SHORTEST)
    shortest = between(before, after, family, SHORTEST)
    if shortest.e.length > length:
        allowed = f"at least {shortest.e.length:.9g} at z = {z:g}"
        raise InvalidInputError("length", length, allowed, "give a guess for a state before the minimum")
    found = located(chain([shortest, after], branch), family, at_length(length), LONGEST)
    if found.e.length < length * (1.0 - 1e-12):
        raise InvalidInputError("length", length, f"at most {found.e.length:.9g} at z = {z:g}")
    return State._from(found.e)


def state_at_advance(z: float, advance: float) -> State:
    """The state at height ``z`` with a given advance, from lambda_0 to the critical point.

    Raises InvalidInputError: ``z`` outside 0.1 to 100 L*, or no such advance at this height; the message names the
    range; SolveError: no convergence (as NewtonError or ContinuationError).

    Examples
    --------
    >>> round(state_at_advance(3.0, 8.0).length, 6)
    4.970935
    """
    z, advance = checked_height(z), number("advance", advance, ", in units of L*")
    branch = points(z)
    start = next(branch)
    if (least := State._from(start.e).advance) > advance:
        raise InvalidInputError("advance", advance, f"at least {least:.9g} at z = {z:g}")
    found = State._from(located(chain([start], branch), at_height(z), at_advance(advance), SNAP).e)
    if found.advance < advance * (1.0 - 1e-12):
        raise InvalidInputError("advance", advance, f"at most {found.advance:.9g} at z = {z:g}")
    return found

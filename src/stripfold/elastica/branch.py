"""States at a fixed gripper height: without horizontal force, at a given length, along the x-axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import height, positive
from stripfold.elastica._continuation import Point, at_height, locate, march, point_at
from stripfold.elastica._system import FORCE_X, LENGTH, TOLERANCE, Evaluation, evaluate, fixed, lifted, solve
from stripfold.elastica.state import State
from stripfold.errors import InvalidInputError

LIMIT_REACTION = 1.202702
"""Lift-off reaction of the state without horizontal force for z -> infinity: only a starting guess."""

FIRST_STEP, MAX_STEP = 0.1, 0.5
"""Steps along a branch that is only searched, in its arc length."""

COARSE = 1e-5
"""Tail of the coefficients while a branch is only searched, not handed out."""


def _guess(z: float, n: int) -> Array:
    """Starting vector for the state without horizontal force."""
    nodes = grid(n).nodes
    if z < 0.6:
        # Small lift: EI Z'''' = -1 with Z = Z' = Z'' = 0 at lift-off and no moment at the gripper.
        length = (24.0 * z) ** 0.25
        return np.concatenate([length**3 * (0.5 - nodes), [0.0, -length / 2, length]])
    # High lift: a foot of fixed shape, about 2 L* long, under a part that hangs straight.
    length = z + LIMIT_REACTION
    s = length * nodes
    # Second derivative of theta = pi/2 (1 - exp(-a s^2)), which has the right slope of k at lift-off.
    a = LIMIT_REACTION / np.pi
    second = length**2 * np.pi * a * (1.0 - 2.0 * a * s**2) * np.exp(-a * s**2)
    return np.concatenate([second, [0.0, -LIMIT_REACTION, length]])


def _start(z: float, tolerance: float) -> Evaluation:
    n = 24 if z < 5 else 48
    e = solve(_guess(z, n), (*lifted(z), fixed(FORCE_X, 0.0)), tolerance=tolerance)
    y = e.y.copy()
    y[FORCE_X] = 0.0  # exactly, not to rounding
    return evaluate(y)


def state_no_horizontal_force(z: float) -> State:
    """The state lambda_0: gripper at height ``z``, no horizontal force (docs/physics.md, section 4).

    Parameters
    ----------
    z
        Gripper height in L*, from 1e-4 to 100.

    Returns
    -------
    State
        With ``force_x`` exactly 0.

    Raises
    ------
    InvalidInputError
        ``z`` outside its range or not a number.
    SolveError
        No convergence.

    Examples
    --------
    >>> state = state_no_horizontal_force(20.0)
    >>> round(state.gripper[0], 6), round(state.reaction, 6)
    (2.036812, 1.202702)
    """
    return State._from(_start(height(z, 1e-4), TOLERANCE))


def first_point(z: float, tolerance: float) -> Point:
    """Start of the branch at lambda_0, in the direction in which the gripper advances."""
    e = _start(z, tolerance)
    forward = np.zeros(e.y.size)
    forward[FORCE_X] = -1.0  # advancing pushes the strip
    return point_at(e, at_height(z), forward)


def x_axis_branch(z: float, *, past: float = 0.5, max_step: float = 0.3) -> Iterator[State]:
    """States at height ``z`` from lambda_0 up to and past the critical point.

    Pseudo-arclength continuation: neither the length (which first decreases, see
    :func:`state_at`) nor the advance (which turns at the critical point) is a good parameter.
    Contact of the sag with the lower layer is *not* a part of this model: states behind the
    first one with ``clearance <= 0`` are equilibria of the free strip only.

    Parameters
    ----------
    z
        Gripper height in L*, from 0.1 to 100.
    past
        The branch ends when the advance has fallen by so much below its largest value, in L*.
    max_step
        Largest step, in the arc length of the branch (about radians of mean rotation).

    Returns
    -------
    iterator of State
        Resolved to 1e-11, starting with the state without horizontal force.

    Raises
    ------
    InvalidInputError
        ``z`` outside its range, ``past`` or ``max_step`` not positive.
    ContinuationError
        The branch could not be followed.

    Examples
    --------
    >>> states = list(x_axis_branch(3.0))
    >>> states[0].force_x, bool(max(state.advance for state in states) > 9.8)
    (0.0, True)
    """
    z = height(z)
    past, max_step = positive("past", past, ", in units of L*"), positive("max_step", max_step, "")
    return _states(z, past, max_step)  # a generator of its own, so that bad input is refused at once


def _states(z: float, past: float, max_step: float) -> Iterator[State]:
    start = first_point(z, TOLERANCE)
    state = State._from(start.e)
    yield state
    highest = state.advance
    for point in march(start, at_height(z), step=FIRST_STEP, max_step=max_step, tolerance=TOLERANCE):
        state = State._from(point.e)
        yield state
        highest = max(highest, state.advance)
        if state.advance < highest - past:
            return


def state_at(z: float, length: float, guess: State | None = None) -> State:
    """The state at height ``z`` with a free part of the given length.

    Along the branch that starts at lambda_0 the length falls to a smallest value, turns, and grows
    up to the critical point and beyond: up to two states of the branch share a length.  Without a
    guess the one *behind the turn* is found, where the critical point lies.  With a guess the
    one that Newton's method reaches from there is found, on either side of the turn.

    Parameters
    ----------
    z
        Gripper height in L*, from 0.1 to 100.
    length
        Length l of the free part in L*.
    guess
        A state close to the wanted one.

    Raises
    ------
    InvalidInputError
        ``z`` or ``length`` outside its range; the message names the range at this height.
    SolveError
        No convergence (as NewtonError or ContinuationError).

    Examples
    --------
    >>> round(state_at(3.0, 7.133077).advance, 6)
    9.856908
    """
    z = height(z)
    length = positive("length", length, ", in units of L*")
    if guess is not None:
        y = guess._unknowns()
        y[LENGTH] = length
        return State._from(solve(y, (*lifted(z), fixed(LENGTH, length))))

    def excess(point: Point) -> float:
        return point.e.length - length

    def turning(point: Point) -> float:
        return point.length_rate

    previous, behind = first_point(z, COARSE), False
    for point in march(previous, at_height(z), step=FIRST_STEP, max_step=MAX_STEP, tolerance=COARSE):
        if not behind and turning(point) > 0.0:
            previous, behind = locate(previous, point, at_height(z), turning), True
            if excess(previous) > 0.0:
                allowed = f"at least {previous.e.length:.9g} at z = {z:g}"
                raise InvalidInputError("length", length, allowed, "give a guess for a state before the turn")
        elif behind and turning(point) < 0.0:
            point = locate(previous, point, at_height(z), turning)
            if excess(point) < 0.0:
                raise InvalidInputError("length", length, f"at most {point.e.length:.9g} at z = {z:g}")
        if behind and excess(point) >= 0.0:
            near = locate(previous, point, at_height(z), excess)
            return State._from(solve(near.e.y, (*lifted(z), fixed(LENGTH, length))))
        previous = point
    raise AssertionError("march does not end without raising")

"""Events on a branch, each as a sign along the branch and as a side condition of Newton's method."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica._system import (
    LENGTH,
    Condition,
    Evaluation,
    ValueAndGradient,
    computed,
    evaluate,
    fixed,
    height_of,
    jacobian,
    no_lift_off_moment,
    solved,
    weighted,
)
from stripfold.elastica.state import State

COMPLEX_STEP = 1e-30
Gradient = Callable[[Evaluation], Array]


class Event(NamedTuple):
    """A place on a branch where the advance ends, or that the user asks for.

    ``sign``: function of a state and the branch's tangent there: positive before the event, negative after it.
    ``condition``: vanishes at the event.
    """

    sign: Callable[[Evaluation, Array], float]
    condition: Condition


def advance_gradient(e: Evaluation) -> Array:
    """Gradient of lambda = l - X(l)."""
    weights = e.grid.integral[-1]
    row = np.zeros_like(e.y)
    row[: e.grid.n] = (e.length * weights * e.sin) @ e.grid.angle
    row[LENGTH] = 1.0 - weights @ e.cos
    return row


def length_gradient(e: Evaluation) -> Array:
    """Gradient of l."""
    row = np.zeros_like(e.y)
    row[LENGTH] = 1.0
    return row


def slope(e: Evaluation, of: Gradient, over: Gradient) -> tuple[float, Callable[[], Array], Array]:
    """Derivative of one quantity over another along the states of one gripper height, its gradient, and the tangent.

    With w, ``A^T w = of``, where A has the gradients of the equations and of ``over``, the derivative's gradient is
    that of ``of - w^T A`` along the tangent, by symmetry of second derivatives (docs/physics.md, section 4).
    """
    n = e.grid.n

    def height(e: Evaluation) -> Array:
        return height_of(e, e.grid.integral[-1])[1]

    matrix = jacobian(e, [computed(no_lift_off_moment(e)[1]), height(e), over(e)])
    right = np.zeros(e.y.size)
    right[-1] = 1.0
    tangent = solved(matrix, right)

    def gradient() -> Array:
        w = solved(matrix.T, of(e))
        beside = evaluate(e.y + 1j * COMPLEX_STEP * tangent)
        change = of(beside) - weighted(beside, w[:n]) - w[n + 1] * height(beside) - w[-1] * over(beside)
        return np.asarray(change.imag / COMPLEX_STEP)

    return float(of(e) @ tangent), gradient, tangent


def _touching(e: Evaluation) -> ValueAndGradient:
    sag = State._from(e).sag
    # The sag is a minimum of Z: its shift does not count.
    at = 1.0 if sag is None else sag.s / e.length
    return height_of(e, e.grid.interpolate(e.grid.integral, at))


def at_length(length: float) -> Event:
    """The free part has grown to this length."""
    return Event(lambda e, _: length - e.length, fixed(LENGTH, length))


def at_advance(advance: float) -> Event:
    """The advance has fallen to this."""
    return Event(lambda e, _: _advance(e) - advance, lambda e: (_advance(e) - advance, advance_gradient(e)))


def _advance(e: Evaluation) -> float:
    return e.length * (1.0 - float(e.grid.integral[-1] @ e.cos))


TOUCH = Event(lambda e, _: State._from(e).clearance, _touching)
"""The sag touches the lower layer."""
SNAP = Event(
    lambda e, tangent: float(advance_gradient(e) @ tangent), lambda e: slope(e, advance_gradient, length_gradient)[:2]
)
"""The advance at constant height is largest: the critical point, on a branch of constant height."""
SNAP_AT_HEIGHT = SNAP._replace(sign=lambda e, _: slope(e, advance_gradient, length_gradient)[0])
"""The same on any branch; infinite where the length at constant height is smallest."""
SHORTEST = Event(lambda _, tangent: -float(tangent[LENGTH]), lambda e: slope(e, length_gradient, advance_gradient)[:2])
"""The free length at constant height is smallest."""
LONGEST = SHORTEST._replace(sign=lambda _, tangent: float(tangent[LENGTH]))
"""The free length at constant height is largest."""

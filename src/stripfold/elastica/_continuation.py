"""Pseudo-arclength continuation of a one-parameter family of states, and location of points on it.

Separate from :mod:`stripfold.solve.continuation` on purpose: the elastica is the reference for the discretised
strips, so the two share no code.

At fixed gripper height the length l has a minimum along the branch and the advance a maximum, the critical point;
the arc length is monotonic. Guards against landing on another branch: a step is halved when the corrector changes
theta by too much, when the tangent turns by too much, or when the sign of the bordered determinant (constant along a
regular branch) changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import NamedTuple

import numpy as np

from stripfold.base.arrays import Array
from stripfold.base.errors import ContinuationError, NewtonError
from stripfold.base.numerics import root
from stripfold.elastica._system import (
    FORCE_0,
    FORCE_X,
    LENGTH,
    Condition,
    Corrected,
    Evaluation,
    ValueAndGradient,
    angle_change,
    computed,
    corrected,
    evaluate,
    finer,
    fixed,
    gripper_at,
    height_of,
    jacobian,
    no_lift_off_moment,
    on_plane,
    refine,
    solve,
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


# Angles in rad, steps in arc length.
WANTED_CORRECTION = 0.02  # of theta by the corrector: the step length is kept
MAX_CORRECTION = 4 * WANTED_CORRECTION
MAX_STEP_ROTATION = 0.6  # change of theta within one step
MIN_COSINE = 0.8  # of the angle between the tangents of successive points
MIN_STEP = 1e-7
MAX_POINTS = 5000
MAX_CORRECTOR_ITERATIONS = 7


@dataclass(frozen=True, slots=True)
class Family:
    """A one-parameter family of states: two side conditions, and its name for error messages."""

    conditions: tuple[Condition, Condition]
    name: str


def at_height(z: float) -> Family:
    """States with the gripper at height ``z``."""
    return Family(gripper_at(z), f"z = {z:g}")


@dataclass(frozen=True)
class Point:
    """An accepted point of the branch."""

    e: Evaluation
    tangent: Array  # of unit length in the local metric, towards growing arc length
    normal: Array  # metric times tangent: the row that defines the plane of a step
    orientation: float  # sign of the bordered determinant
    arc: float = 0.0  # arc length from the start of the branch


def metric_times(e: Evaluation, v: Array) -> Array:
    """The metric at ``e`` times a direction: mean square of theta plus relative changes of the scalars."""
    g, y = e.grid, e.y
    out = np.zeros(y.size)
    out[: g.n] = (g.integral[-1] * angle_change(v)) @ g.angle
    for force in (FORCE_X, FORCE_0):
        out[force] = v[force] / (1.0 + abs(y[force])) ** 2
    out[LENGTH] = v[LENGTH] / e.length**2
    return out


def point_at(e: Evaluation, family: Family, forward: Array, arc: float = 0.0) -> Point:
    """The point with the state ``e``; its tangent has a positive product with the row ``forward``.

    So has its normal: the bordered determinants with either row have the same sign.
    """
    matrix = jacobian(e, [*(computed(condition(e)[1]) for condition in family.conditions), forward])
    right = np.zeros(e.y.size)
    right[-1] = 1.0
    return _point(Corrected(e, matrix, solved(matrix, right)), arc)


def _point(at: Corrected, arc: float) -> Point:
    """The point with a state found on a plane across the branch."""
    row = metric_times(at.e, at.along)
    size = sqrt(float(row @ at.along))
    return Point(at.e, at.along / size, row / size, float(np.linalg.slogdet(at.matrix)[0]), arc)


def _resolved(at: Corrected, family: Family) -> Corrected:
    """The same state with enough nodes."""
    while (guess := finer(at.e)) is not None:
        e = evaluate(guess)
        plane = on_plane(metric_times(e, refine(at.along, e.grid.n)), guess)
        at = corrected(guess, (*family.conditions, plane))
    return at


def march(point: Point, family: Family, *, step: float, max_step: float) -> Iterator[Point]:
    """Points of the branch from a resolved one on, resolved, without end: the caller stops."""
    yield point
    curvature: Array | float = 0.0
    for _ in range(MAX_POINTS):
        while True:
            if step < MIN_STEP:
                raise ContinuationError(
                    f"the branch {family.name} could not be followed beyond arc length {point.arc:.6g}",
                    parameter=point.arc,
                    step=step,
                    advice="the state there may not be resolved; look at the last accepted state",
                    details={"family": family.name, "length": point.e.length, "nodes": point.e.grid.n},
                )
            guess = point.e.y + step * point.tangent + 0.5 * step**2 * curvature
            try:
                plane = on_plane(point.normal, point.e.y + step * point.tangent)
                at = corrected(guess, (*family.conditions, plane), MAX_CORRECTOR_ITERATIONS)
                correction = float(np.abs(angle_change(at.e.y - guess)).max())
                new = _point(_resolved(at, family), point.arc + step)
            except NewtonError:
                step /= 2
                continue
            e = new.e
            before = refine(point.tangent, e.grid.n)
            cosine = float(new.normal @ before) / sqrt(float(metric_times(e, before) @ before))
            rotation = float(np.abs(angle_change(e.y - refine(point.e.y, e.grid.n))).max())
            small = correction < MAX_CORRECTION and cosine > MIN_COSINE and rotation < MAX_STEP_ROTATION
            if small and new.orientation == point.orientation:
                break
            step /= 2
        curvature = (new.tangent - before) / step
        point = new
        yield point
        growth = sqrt(WANTED_CORRECTION / max(correction, 1e-6))
        growth = min(growth, 0.9 * MAX_STEP_ROTATION / max(rotation, 1e-6))
        step = min(max_step, step * min(2.0, max(0.5, growth)))
    raise ContinuationError(
        f"the branch {family.name} did not meet its end within {MAX_POINTS} points",
        parameter=point.arc,
        step=step,
        advice="allow longer steps",
        details={"family": family.name, "length": point.e.length},
    )


def until(points: Iterable[Point], event: Event) -> Iterator[Point]:
    """The points of a branch before an event, and the one after it."""
    for point in points:
        yield point
        if event.sign(point.e, point.tangent) < 0.0:
            return


def to_event(points: Iterable[Point], family: Family, event: Event) -> list[Point]:
    """The points of a branch before an event, and the one with it."""
    *free, before, after = until(points, event)
    return [*free, before, between(before, after, family, event)]


def located(points: Iterable[Point], family: Family, event: Event, last: Event | None) -> Point:
    """The point of a branch with an event, or that with ``last``, beyond which the branch is not searched."""
    way = 0.0
    for before, after in pairwise(points):
        way = way or event.sign(before.e, before.tangent)
        end = between(before, after, family, last) if last and last.sign(after.e, after.tangent) < 0.0 else None
        if event.sign((end or after).e, (end or after).tangent) * way <= 0.0:
            return between(before, end or after, family, event)
        if end:
            return end
    return after


def between(before: Point, after: Point, family: Family, event: Event) -> Point:
    """The resolved point with an event, from cubic interpolation between two successive points of the branch."""
    n, span = max(before.e.grid.n, after.e.grid.n), after.arc - before.arc
    y0, y1, v0, v1 = (refine(y, n) for y in (before.e.y, after.e.y, span * before.tangent, span * after.tangent))
    coefficients = np.array([2.0 * (y0 - y1) + v0 + v1, 3.0 * (y1 - y0) - 2.0 * v0 - v1, v0, y0])

    def at(share: float) -> tuple[Array, Array]:
        """Unknowns and their derivative."""
        return [share**3, share**2, share, 1.0] @ coefficients, [3.0 * share**2, 2.0 * share, 1.0, 0.0] @ coefficients

    def sign(share: float) -> float:
        y, along = at(share)
        return event.sign(evaluate(y), along)

    ends = sign(0.0), sign(1.0)
    if ends[0] * ends[1] < 0.0:
        share = root(sign, 0.0, 1.0, 1e-6)
    else:
        share = float(abs(ends[1]) < abs(ends[0]))  # interpolation moved the event out of the bracket
    y, along = at(share)
    e = solve(y, (*family.conditions, event.condition))
    return point_at(e, family, metric_times(e, refine(along, e.grid.n)), before.arc + share * span)

"""Pseudo-arclength continuation of a one-parameter family of states.

At a fixed gripper height neither l nor the advance will do as the parameter: from the state without
horizontal force the length l first *decreases* (the gripper pushes the strip down to the floor),
turns, and grows up to the critical point, where the advance turns.  The arc length of the branch
never turns.

Guards against landing on another branch: the corrector may move theta only a little, the tangent
may turn only a little, and the orientation (the sign of the bordered determinant), which is constant
along a regular branch, must be kept.  A step that breaks one of them is repeated with half the length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import prod, sqrt

import numpy as np
from scipy.optimize import brentq

from stripfold.arrays import Array
from stripfold.elastica._system import (
    FORCE_0,
    FORCE_X,
    LENGTH,
    ROUNDING,
    SCALARS,
    TOLERANCE,
    Condition,
    Evaluation,
    Factors,
    angle_change,
    evaluate,
    factor,
    jacobian,
    lifted,
    newton,
    next_count,
    on_plane,
    refine,
)
from stripfold.errors import ContinuationError, NewtonError

TARGET = 0.02
"""Wanted correction of theta, rad, by the corrector; the step length follows it."""
MIN_COSINE = 0.8
"""Smallest cosine of the angle between the tangents of two accepted points."""
MAX_STEP_ROTATION = 0.5
"""Largest change of theta, rad, within one step."""
MIN_STEP = 1e-7
PROBE, REACH = 1e-3, 0.05
"""First and largest distance, in arc length, that a located point may move when it is resolved."""
MAX_POINTS = 5000
MOST_CORRECTIONS = 7
UNSEEN = 0.1
"""Residual of a point, as a share of the tail it is resolved to: where that is coarse, Newton may stop early."""


@dataclass(frozen=True, slots=True)
class Family:
    """A one-parameter family of states: two closing conditions, and what to call it in an error."""

    conditions: tuple[Condition, ...]
    name: str


def at_height(z: float) -> Family:
    """States with the gripper at height ``z``."""
    return Family(lifted(z), f"z = {z:g}")


@dataclass(frozen=True)
class Point:
    """An accepted point of the branch.

    Parameters
    ----------
    e
        The evaluated state.
    tangent
        Unit tangent in the local metric, pointing towards growing arc length.
    normal
        The tangent times the metric: the row that fixes a step.
    orientation
        Sign of the bordered determinant.
    rate
        d lambda / d (arc length): changes sign at the critical point.
    arc
        Arc length from the start of the branch.
    """

    e: Evaluation
    tangent: Array
    normal: Array
    orientation: float
    rate: float
    arc: float = 0.0

    @property
    def length_rate(self) -> float:
        """d l / d (arc length)."""
        return float(self.tangent[LENGTH])


def weigh(e: Evaluation, v: Array) -> Array:
    """The metric at ``e`` times a direction: mean square of theta plus relative changes of the scalars."""
    g, y = e.grid, e.y
    out = np.zeros(y.size)
    out[: g.n] = (g.integral[-1] * angle_change(v)) @ g.angle
    out[FORCE_X] = v[FORCE_X] / (1.0 + abs(y[FORCE_X])) ** 2
    out[FORCE_0] = v[FORCE_0] / (1.0 + abs(y[FORCE_0])) ** 2
    out[LENGTH] = v[LENGTH] / e.length**2
    return out


def advance_rate(e: Evaluation, v: Array) -> float:
    """Change of lambda = l - X(l) in the direction ``v``."""
    quadrature = e.grid.integral[-1]
    stretch = v[LENGTH] * (1.0 - quadrature @ e.cos)
    return float(stretch + e.length * (quadrature @ (e.sin * angle_change(v))))


def tangent_at(e: Evaluation, family: Family, forward: Array) -> tuple[Array, Array, Factors]:
    """Unit tangent with a positive part along the row ``forward``, its row, and the bordered factors.

    The sign of the bordered determinant is the orientation; ``forward`` must not be
    perpendicular to the branch.
    """
    factors = factor(jacobian(e, [*(condition(e)[1] for condition in family.conditions), forward]))
    right = np.zeros(e.y.size)
    right[-1] = 1.0
    v = factors.solve(right)
    row = weigh(e, v)
    size = sqrt(float(row @ v))
    return v / size, row / size, factors


def point_at(e: Evaluation, family: Family, forward: Array, arc: float = 0.0) -> Point:
    """The point of the branch with the state ``e``.

    The bordered determinant is taken with ``forward``; its sign is the one with the tangent
    itself, because both rows have a positive product with the tangent.
    """
    v, row, factors = tangent_at(e, family, forward)
    return Point(e, v, row, factors.sign, advance_rate(e, v), arc)


def corrected(guess: Array, base: Point, family: Family, step: float, tolerance: float = ROUNDING) -> Point:
    """The point at distance ``step`` from ``base`` along its tangent, from the given guess."""
    plane = on_plane(base.normal, base.e.y + step * base.tangent)
    e, _ = newton(guess, (*family.conditions, plane), limit=MOST_CORRECTIONS, tolerance=tolerance)
    return point_at(e, family, base.normal, base.arc + step)


def regridded(point: Point, family: Family, n: int, tolerance: float = ROUNDING) -> Point:
    """The same point with ``n`` nodes."""
    guess, tangent = refine(point.e.y, n), refine(point.tangent, n)
    normal = weigh(evaluate(guess), tangent)
    e, _ = newton(guess, (*family.conditions, on_plane(normal, guess)), tolerance=tolerance)
    return point_at(e, family, normal, point.arc)


def finer(point: Point, family: Family, tolerance: float) -> Point:
    """The same point with enough nodes: the tail of ``u`` is below ``tolerance``."""
    while point.e.grid.tail(point.e.y[:-SCALARS]) > tolerance:
        point = regridded(point, family, next_count(point.e.grid.n), max(UNSEEN * tolerance, ROUNDING))
    return point


def march(point: Point, family: Family, *, step: float, max_step: float, tolerance: float) -> Iterator[Point]:
    """Accepted points after ``point``, without end; the caller stops.

    Raises
    ------
    ContinuationError
        The step became smaller than ``MIN_STEP``, or ``MAX_POINTS`` were used.
    """
    bend: Array | None = None
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
            guess = point.e.y + step * point.tangent
            if bend is not None:
                guess = guess + 0.5 * step**2 * bend
            try:
                new = corrected(guess, point, family, step, max(UNSEEN * tolerance, ROUNDING))
                correction = float(np.abs(angle_change(new.e.y - guess)).max())
                new = finer(new, family, tolerance)
            except NewtonError:
                step /= 2
                continue
            before = refine(point.tangent, new.e.grid.n)
            cosine = float(new.normal @ before) / sqrt(float(weigh(new.e, before) @ before))
            rotation = float(np.abs(angle_change(new.e.y - refine(point.e.y, new.e.grid.n))).max())
            same_side = new.orientation == point.orientation
            if correction < 4 * TARGET and cosine > MIN_COSINE and rotation < MAX_STEP_ROTATION and same_side:
                break
            step /= 2
        bend = (new.tangent - before) / step
        growth = np.sqrt(TARGET / max(correction, 1e-6))
        growth = min(growth, 0.9 * MAX_STEP_ROTATION / max(rotation, 1e-6))
        point = new
        yield point
        step = float(min(max_step, step * min(2.0, max(0.5, growth))))
    raise ContinuationError(
        f"the branch {family.name} did not meet its end within {MAX_POINTS} points",
        parameter=point.arc,
        step=step,
        advice="allow longer steps",
        details={"family": family.name, "length": point.e.length},
    )


def locate(
    before: Point, after: Point, family: Family, function: Callable[[Point], float], near: float = 1e-7
) -> Point:
    """The point between two accepted neighbours where ``function`` changes sign.

    Bracketed (Brent's method) to ``near`` in arc length; every trial is a corrected point of the
    branch, predicted by interpolation of the trials so far.
    """
    base = before if before.e.grid.n == after.e.grid.n else regridded(before, family, after.e.grid.n)
    span = after.arc - before.arc
    known = [(0.0, base), (span, after)]

    def at(a: float) -> float:
        for place, point in known:
            if a == place:
                return function(point)
        known.sort(key=lambda pair: abs(pair[0] - a))
        point = corrected(_interpolate(known[:4], a), base, family, a)
        known.append((a, point))
        return function(point)

    ends = at(0.0), at(span)
    if ends[0] * ends[1] >= 0.0:
        # The zero is at an end, moved out of the bracket by the change of grid: `polish` finds it.
        return base if abs(ends[0]) < abs(ends[1]) else after
    root = brentq(at, 0.0, span, xtol=near, rtol=1e-10)
    return min(known, key=lambda pair: abs(pair[0] - root))[1]


def _interpolate(known: list[tuple[float, Point]], a: float) -> Array:
    """Lagrange interpolation of the unknowns in the arc length."""
    n = known[0][1].e.grid.n
    total = np.zeros_like(known[0][1].e.y)
    for i, (place, point) in enumerate(known):
        weight = prod((a - k) / (place - k) for j, (k, _) in enumerate(known) if j != i)
        total += weight * refine(point.e.y, n)
    return total


def polish(point: Point, family: Family, function: Callable[[Point], float]) -> Point:
    """The zero of ``function`` close to ``point``, fully resolved: the secant method.

    Raises
    ------
    ContinuationError
        The zero of the resolved branch is not where the coarse search put it.
    """
    base = finer(point, family, TOLERANCE)
    points = [(0.0, function(base), base)]
    a = PROBE
    for _ in range(12):
        known = [(place, p) for place, _, p in points[-3:]]
        guess = _interpolate(known, a) if len(known) > 1 else base.e.y + a * base.tangent
        new = corrected(guess, base, family, a)
        points.append((a, function(new), new))
        (a0, f0, _), (a1, f1, _) = points[-2:]
        step = 0.0 if f1 == f0 else -f1 * (a1 - a0) / (f1 - f0)
        if abs(step) < 1e-10:
            return finer(new, family, TOLERANCE)
        a = a1 + step
        if not abs(a) < REACH:
            break
    raise ContinuationError(
        f"an event near arc length {point.arc:.6g} {family.name} could not be located",
        parameter=point.arc,
        step=a,
        residuals=[f for _, f, _ in points],
        advice="the coarse search and the resolved branch disagree; report the height",
        details={"family": family.name},
    )

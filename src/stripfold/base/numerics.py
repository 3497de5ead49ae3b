"""Roots and splines, without the quarter of a command's start that importing the ones of scipy takes."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from typing import Self

import numpy as np

from stripfold.base.arrays import Array


def root(function: Callable[[float], float], low: float, high: float, tolerance: float) -> float:
    """Zero, to ``tolerance``, of a continuous function that changes sign between ``low`` and ``high``.

    Inverse quadratic interpolation or bisection, by the criterion of Chandrupatla (Adv. Eng. Software 28 (1997), 145).

    Raises ValueError: the function has the same sign at both ends, or is not a number.

    Examples
    --------
    >>> round(root(lambda x: x**2 - 2.0, 0.0, 2.0, 1e-12), 10)
    1.4142135624
    """
    a, b, at_a, at_b = low, high, function(low), function(high)
    if not at_a * at_b <= 0.0:
        raise ValueError(f"no change of sign between {low:g} and {high:g}")
    share, tolerance = 0.5, max(tolerance, 1e-15 * max(abs(low), abs(high)))
    while True:
        best, at_best = (a, at_a) if abs(at_a) < abs(at_b) else (b, at_b)
        least = 0.5 * tolerance / abs(b - a) if at_best != 0.0 else 1.0
        if least > 0.5:
            return best
        x = a + min(max(share, least), 1.0 - least) * (b - a)
        at_x = function(x)
        # The root is between a, the latest point, and b; c is the point before.
        if at_x * at_a > 0.0:
            c, at_c = a, at_a
        else:
            c, at_c, b, at_b = b, at_b, a, at_a
        a, at_a = x, at_x
        place, value = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
        share = 0.5
        if value**2 < place and (1.0 - value) ** 2 < 1.0 - place:
            share = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            share += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)


class Spline:
    """A twice differentiable curve, cubic between its knots; beyond them the first and the last cubic go on.

    Through two points a line, through three a parabola; otherwise one cubic on the first two intervals and one on the
    last two ("not a knot").

    Examples
    --------
    >>> curve = Spline.through(np.arange(5.0), np.arange(5.0)[:, None] ** 3)
    >>> curve.at(2.5), curve.rate(2.5)
    (array([15.625]), array([18.75]))
    """

    def __init__(self, knots: list[float], coefficients: Array) -> None:
        """``coefficients``: of the powers, constant first, of the distance from each knot on; shape (n, 4, m)."""
        self._knots, self._coefficients = knots, coefficients

    @classmethod
    def through(cls, knots: Array, values: Array) -> Self:
        """``knots``: increasing, shape (n,) with n of at least 2.  ``values``: shape (n, m)."""
        h = np.diff(knots)
        secants = np.diff(values, axis=0) / h[:, None]
        slopes = np.column_stack([_slopes(h.tolist(), column) for column in secants.T.tolist()])
        first, last, h = slopes[:-1], slopes[1:], h[:, None]
        second, third = (3.0 * secants - 2.0 * first - last) / h, (first + last - 2.0 * secants) / h**2
        # The last cubic once more, from the last knot: the curve is exactly at every point.
        second, third = np.vstack([second, second[-1] + 3.0 * h[-1] * third[-1]]), np.vstack([third, third[-1]])
        return cls(np.asarray(knots).tolist(), np.stack([values, slopes, second, third], axis=1))

    def _beside(self, s: float) -> tuple[float, Array]:
        """The distance from the last knot at or before ``s``, and the coefficients of the cubic there."""
        number = max(bisect_right(self._knots, s) - 1, 0)
        return s - self._knots[number], self._coefficients[number]

    def at(self, s: float) -> Array:
        """Values, shape (m,)."""
        d, (a, b, c, e) = self._beside(s)
        return np.asarray(a + d * (b + d * (c + d * e)))

    def rate(self, s: float) -> Array:
        """Derivatives of the values, shape (m,)."""
        d, (_, b, c, e) = self._beside(s)
        return np.asarray(b + d * (2.0 * c + 3.0 * d * e))


def _slopes(h: list[float], secants: list[float]) -> list[float]:
    """Slopes at the knots, from the intervals' lengths and the slopes of the chords.

    Source: de Boor, A Practical Guide to Splines (1978), chapter IV.
    """
    if len(h) == 1:
        return 2 * secants
    if len(h) == 2:
        middle = (h[1] * secants[0] + h[0] * secants[1]) / (h[0] + h[1])
        return [2.0 * secants[0] - middle, middle, 2.0 * secants[1] - middle]
    # Rows of the tridiagonal system: what multiplies the slope before, at and after a knot, and the right-hand side.
    inner = [
        (h1, 2.0 * (h0 + h1), h0, 3.0 * (h1 * s0 + h0 * s1))
        for (h0, h1), (s0, s1) in zip(pairwise(h), pairwise(secants), strict=True)
    ]
    both = h[0] + h[1]
    first = ((h[0] + 2.0 * both) * h[1] * secants[0] + h[0] ** 2 * secants[1]) / both
    rows = [(0.0, h[1], both, first), *inner]
    both = h[-1] + h[-2]
    last = ((h[-1] + 2.0 * both) * h[-2] * secants[-1] + h[-1] ** 2 * secants[-2]) / both
    rows.append((both, h[-2], 0.0, last))
    reduced: list[tuple[float, float]] = []
    ratio = value = 0.0
    for before, at, after, right in rows:
        pivot = at - before * ratio
        ratio, value = after / pivot, (right - before * value) / pivot
        reduced.append((ratio, value))
    slopes = [value]
    for ratio, value in reversed(reduced[:-1]):
        slopes.append(value - ratio * slopes[-1])
    return slopes[::-1]

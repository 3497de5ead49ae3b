"""Roots of functions of one variable, without the quarter of a command's start that importing scipy.optimize takes."""

from __future__ import annotations

from collections.abc import Callable


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

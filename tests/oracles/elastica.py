"""The heavy elastica by other means: as an initial-value problem, and at a gripper that is a hinge or a clamp."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from stripfold import elastica
from stripfold.elastica import State
from stripfold.elastica._chebyshev import grid
from stripfold.elastica.half_fold import states_fixed_lift_off


def shoot(state: State, span: tuple[float, float] | None = None, **options: Any) -> Any:
    """Integrate (X, Z, theta, k) over ``span``, by default the whole state, from the state's values at its start."""

    def rate(s: float, y: np.ndarray) -> list[float]:
        _, _, theta, k = y
        return [np.cos(theta), np.sin(theta), k, state.force_x * np.sin(theta) - (state.force_0 + s) * np.cos(theta)]

    span = span or (0.0, state.length)
    _, *start = (float(value) for value in state.at(span[0]))
    return solve_ivp(rate, span, start, method="DOP853", rtol=1e-12, atol=1e-13, **options)


def assert_equilibrium(state: State, start: tuple[float, float] = (0.0, 0.0), atol: float = 1e-7) -> None:
    """Angle and curvature at the start are ``start``, and integration leads to the state's end."""
    np.testing.assert_allclose([state.theta[0], state.curvature[0]], start, atol=1e-9)
    end = [state.x[-1], state.z[-1], state.theta[-1], state.curvature[-1]]
    np.testing.assert_allclose(shoot(state).y[:, -1], end, atol=atol)


def bordered_determinant(state: State, clamped: bool) -> float:
    """Sign and size of the determinant of the equations at a given place of the gripper; zero where it is critical.

    Unknown are theta'' at the nodes, the forces, the free length, and the moment c at the gripper:
    theta = G u + c sigma.  The last equation holds the angle of a clamp, or says that a hinge has no moment.
    """
    g, free, n = grid(state.s.size), state.length, state.s.size
    sin, cos, sigma = np.sin(state.theta), np.cos(state.theta), g.nodes
    vertical = state.force_0 + free * sigma
    turned = np.column_stack([g.angle, sigma])  # derivatives of theta by u and c
    rows = np.zeros((n + 4, n + 4))
    rows[:n, :n] = np.eye(n)
    rows[:n, [*range(n), n + 3]] -= free**2 * (state.force_x * cos + vertical * sin)[:, None] * turned
    rows[:n, n] = -(free**2) * sin
    rows[:n, n + 1] = free**2 * cos
    rows[:n, n + 2] = -2.0 * free * (state.force_x * sin - vertical * cos) + free**2 * sigma * cos
    weights, of_turn = g.integral[-1], [*range(n), n + 3]
    rows[n, of_turn] = [*g.slope[0], 1.0]  # no moment at the lift-off
    rows[n + 1, of_turn] = (free * weights * cos) @ turned  # height
    rows[n + 1, n + 2] = weights @ sin
    rows[n + 2, of_turn] = (free * weights * sin) @ turned  # advance, l - X(l)
    rows[n + 2, n + 2] = 1.0 - weights @ cos
    if clamped:
        rows[n + 3, of_turn] = turned[-1]
    else:
        rows[n + 3, n + 3] = 1.0
    sign, size = np.linalg.slogdet(rows)
    return float(sign * np.exp(size / (n + 4)))


def least_determinant(length: float, clamped: bool) -> float:
    """The least determinant while a strip of a length is carried over on its R-path, with the first state's sign."""
    states = states_fixed_lift_off(length - elastica.half_fold_lying_length(length))
    found = np.array([bordered_determinant(state, clamped) for state in states])
    return float((np.sign(found[0]) * found).min())


def longest_stable(clamped: bool, low: float, high: float) -> float:
    """Length up to which a strip is stable on its R-path as long as its sag is free."""
    return float(brentq(least_determinant, low, high, args=(clamped,), xtol=1e-4))

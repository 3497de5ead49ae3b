"""The heavy elastica as an initial-value problem: an independent check of states from collocation."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from stripfold.elastica import State


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

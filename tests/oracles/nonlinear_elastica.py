"""The heavy elastica with a bending law, by scipy's boundary-value solver: an independent truth.

In the units of docs/physics.md, section 4: theta' = kappa(m), m' = F_x sin theta - (F_0 + s) cos theta.  The law is
given as kappa(m) and as the complementary energy W*(m), the integral of kappa dm, in place of k^2 / 2 in the first
integral.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_bvp
from scipy.optimize import minimize_scalar

from stripfold import elastica

Function = Callable[[np.ndarray], np.ndarray]


class Law(NamedTuple):
    """Curvature and complementary energy as functions of the moment."""

    curvature: Function
    complementary: Function


class Solution(NamedTuple):
    """State of free length ``length`` at its nodes s from 0 to 1: X, Z, theta, m; and the forces."""

    length: float
    s: np.ndarray
    y: np.ndarray
    force_x: float
    force_0: float

    @property
    def advance(self) -> float:
        return float(self.length - self.y[0, -1])


def solve(law: Law, height: float, length: float, guess: elastica.State | Solution) -> Solution:
    """The state with the gripper at ``height``; the first integral holds to 1e-6."""
    if isinstance(guess, Solution):
        s, y, force = guess.s, guess.y, [guess.force_x, guess.force_0]
    else:
        s = np.linspace(0.0, 1.0, 81)
        at = guess.at(s * guess.length)
        y, force = np.array([at.x, at.z, at.theta, at.curvature]), [guess.force_x, guess.force_0]

    def rates(s: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        theta, m = y[2:]
        shear = p[0] * np.sin(theta) - (p[1] + length * s) * np.cos(theta)
        return length * np.array([np.cos(theta), np.sin(theta), law.curvature(m), shear])

    def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.array([*a, b[3], b[1] - height])

    found = solve_bvp(rates, ends, s, y, p=force, tol=1e-9, max_nodes=20000)
    assert found.success, found.message
    _, z, theta, m = found.y
    force_x, force_0 = found.p
    integral = law.complementary(m) + force_x * (np.cos(theta) - 1.0) + (force_0 + length * found.x) * np.sin(theta) - z
    assert np.abs(integral).max() < 1e-6
    return Solution(length, found.x, found.y, float(force_x), float(force_0))


def critical(law: Law, height: float, span: float = 1.0) -> Solution:
    """The state at the first maximum of lambda, sought within ``span`` of the linear elastica's free length."""
    start = elastica.critical(height).state
    near = solve(law, height, start.length, start)

    def negative(length: float) -> float:
        return -solve(law, height, length, near).advance

    bounds = (start.length - span, start.length + span)
    found = minimize_scalar(negative, bounds=bounds, method="bounded", options={"xatol": 1e-4})
    assert bounds[0] + 0.01 < found.x < bounds[1] - 0.01
    return solve(law, height, float(found.x), near)

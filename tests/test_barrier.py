"""The energy barrier of the elastica against the third derivative of its energy, and the study of it."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.elastica._chebyshev import grid

STEP = 0.02
THIRD = np.array([1.0, -8.0, 13.0, 0.0, -13.0, 8.0, -1.0]) / (8.0 * STEP**3)
"""Third derivative to fourth order, from seven places."""


def lagrangian(shape: Array, z: float, advance: float) -> float:
    """Energy of any angles and length with the gripper's forces as multipliers; stationary at an equilibrium."""
    *theta, force_x, force_0, length = shape
    g = grid(len(theta))
    slope = np.linalg.lstsq(length * (g.integral - g.integral[0]), np.array(theta) - theta[0], rcond=None)[0]
    x, rise = (length * g.integral @ f(theta) for f in (np.cos, np.sin))
    energy = length * g.integral[-1] @ (0.5 * slope**2 + rise)
    gaps = force_x * (x[-1] - length + advance) + (force_0 + length) * (rise[-1] - z)
    return float(energy - gaps)


@pytest.mark.parametrize("z", [2.0, 7.0])
def test_coefficient_by_the_third_derivative_of_the_energy(z: float) -> None:
    """The energy along the mode is c t^3 / 6 - d (lambda_c - lambda) t."""
    found = elastica.bistable_range(z)
    assert found is not None

    def unknowns(length: float) -> Array:
        state = elastica.state_at(z, length, found.critical)
        return np.array([*state.theta, state.force_x, state.force_0, state.length])

    length = found.critical.length
    at, ahead, behind = (unknowns(length + ds) for ds in (0.0, 1e-3, -1e-3))
    mode = (ahead - behind) / 2e-3
    c = THIRD @ [lagrangian(at + k * STEP * mode, z, found.critical.advance) for k in range(-3, 4)]
    d = mode[-3]
    assert found.coefficient == pytest.approx(4.0 * np.sqrt(2.0) / 3.0 * abs(d) ** 1.5 / np.sqrt(abs(c)), rel=1e-5)


def test_pairs_and_the_ends_of_the_range() -> None:
    found = elastica.bistable_range(3.0)
    assert found is not None
    assert found.landing.clearance == pytest.approx(0.0, abs=1e-9)
    top = found.critical.advance
    for distance in (1e-6, 1e-3, found.width):
        stable, unstable = found.pair(top - distance)
        assert stable.length < found.critical.length < unstable.length
        assert unstable.clearance > -1e-9
        for state in (stable, unstable):
            assert state.advance == pytest.approx(top - distance, abs=1e-10)
            assert state.gripper[1] == pytest.approx(3.0, abs=1e-10)
            assert state.first_integral_error < 1e-8
        assert found.barrier(top - distance) == pytest.approx(found.coefficient * distance**1.5, rel=3e-4)
    assert found.barrier(top) == 0.0
    assert found.barrier(top - 1.01 * found.width) == inf
    with pytest.raises(InvalidInputError, match="advance"):
        found.pair(top)
    assert elastica.bistable_range(1.2) is None

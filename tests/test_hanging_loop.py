"""eta_b from hanging loops, against scipy's boundary-value solver and against Peirce's formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from stripfold import elastica
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import GRAVITY
from stripfold.elastica import hanging_loop

SLOPES = {"heart": 0.5 * np.pi, "pear": -0.5 * np.pi}


def height(kind: str, star: float) -> float:
    """Height over length of a loop of this length, L*, by other means: a force balance of the half in L*, solve_bvp."""

    def rates(s: np.ndarray, y: np.ndarray, p: np.ndarray) -> np.ndarray:
        below = 0.5 * star - s  # the weight of the part below, which its upper end carries
        return np.array([y[1], p[0] * np.sin(y[0]) + below * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray) -> np.ndarray:
        return np.array([a[0] - SLOPES[kind], a[2], a[3], b[0] + np.pi, b[2]])

    s = np.linspace(0.0, 0.5 * star, 200)
    t = s / s[-1]
    bulge = {"heart": 0.0, "pear": 1.2}[kind]
    angle = SLOPES[kind] - (SLOPES[kind] + np.pi) * t + bulge * np.sin(np.pi * t)
    path = [np.cumsum(f(angle)) * s[1] for f in (np.cos, np.sin)]
    found = solve_bvp(rates, ends, s, np.array([angle, np.gradient(angle, s), *path]), [-10.0 / star**2], tol=1e-8)
    assert found.success
    return float(-found.y[3, -1] / star)


@pytest.mark.parametrize(
    ("kind", "star"), [("heart", 3.0), ("heart", 5.0), ("heart", 8.0), ("pear", 5.0), ("pear", 8.0)]
)
def test_eta_b_of_a_loop_whose_height_is_computed_otherwise(kind: str, star: float):
    unit = 0.025
    found = elastica.eta_b_from_hanging_loop(kind, star * unit, height(kind, star) * star * unit)
    assert found == pytest.approx(1.0 / (GRAVITY * unit**3), rel=1e-5)


@pytest.mark.parametrize(("kind", "share"), [("heart", 0.1337), ("pear", 0.4243)])
def test_without_weight_heights_are_peirces(kind: str, share: float):
    """His l_0 over the length."""
    values = np.zeros(hanging_loop.NODES + 2)
    guess = np.sin(np.pi * hanging_loop.grid(hanging_loop.NODES).nodes)
    values[:-2] = -hanging_loop.BULGE[kind] * np.pi**2 * guess
    assert 0.5 * hanging_loop._depth(kind, hanging_loop._solved(kind, values)) == pytest.approx(share, abs=2e-4)


@pytest.mark.parametrize("relative", [0.15, 0.2, 0.25, 0.3, 0.4])
def test_hearts_agree_with_peirces_formula(relative: float):
    """c = l_0 (cos(t) / tan(t))^(1/3) with t = 32.85 degrees (l - l_0) / l_0: his approximation."""
    angle = np.radians(32.85) * (relative / 0.1337 - 1.0)
    bending_length = 0.1337 * (np.cos(angle) / np.tan(angle)) ** (1.0 / 3.0)
    unit = (GRAVITY * elastica.eta_b_from_hanging_loop("heart", 1.0, relative)) ** (-1.0 / 3.0)
    assert bending_length == pytest.approx(unit, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        (("ring", 0.2, 0.07), "loop"),
        (("heart", 0.2, 0.027), "height"),
        (("heart", 0.2, 0.095), "height"),
        (("pear", 0.2, 0.0995), "height"),
        (("pear", 0.2, 0.2), "height"),
        (("pear", -1.0, 0.07), "length"),
    ],
)
def test_refused(arguments: tuple[str, float, float], key: str):
    with pytest.raises(InvalidInputError) as error:
        elastica.eta_b_from_hanging_loop(*arguments)
    assert error.value.key == key

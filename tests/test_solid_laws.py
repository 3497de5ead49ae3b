"""The constitutive laws at a point: against closed forms and against their own derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.strip.reference import LAWS, c_of, product, second_piola, second_piola_rate
from stripfold.strip.solid import Solid

RNG = np.random.default_rng(7)
F = np.eye(2)[:, :, None] + 0.4 * RNG.standard_normal((2, 2, 5))
DF = RNG.standard_normal((2, 2, 5))
STEPS = 2.0 ** -np.arange(6, 12)


def lame(young: float, nu: float) -> dict[str, float]:
    """The Lame parameters, of a solid whose thickness gives it this Young's modulus."""
    lam, mu = Solid.of(1.0, (12.0 * (1.0 - nu**2) / young) ** (1.0 / 3.0), nu=nu).lame
    return {"lam": lam, "mu": mu}


def first_piola(law: str, f: np.ndarray, w: dict[str, float]) -> np.ndarray:
    return product(f, second_piola(f, w, law))


def rotation(degrees: float) -> np.ndarray:
    """Rotation matrix, as a field of one point."""
    a = np.radians(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


def slopes(remainders: np.ndarray) -> np.ndarray:
    """Observed orders between successive halvings of the step."""
    return np.log2(remainders[:-1] / remainders[1:])


@pytest.mark.parametrize("nu", [0.0, 0.3])
@pytest.mark.parametrize("law", LAWS)
def test_stress_and_its_rate(law, nu):
    """Taylor: the remainder has slope 2."""
    w = lame(1.7, nu)
    rate = product(DF, second_piola(F, w, law)) + product(F, second_piola_rate(F, DF, w, law))
    here = first_piola(law, F, w)
    remainder = np.array([np.abs(first_piola(law, F + t * DF, w) - here - t * rate).max() for t in STEPS])
    assert np.log2(remainder[:-1] / remainder[1:]) == pytest.approx(2.0, abs=0.1)
    assert remainder[-1] < 1e-5


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0, -123.0])
def test_a_rotation_leaves_no_stress(law, degrees):
    """Truth: E = 0 under a rotation, so both laws (also the printed one) give zero."""
    assert np.abs(first_piola(law, rotation(degrees), lame(1.7, 0.3))).max() < 2e-15


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45])
def test_lame_parameters_give_the_papers_matrix(nu):
    """Truth: the paper's matrix D, plane strain, in Voigt's order (11, 22, 12) with the doubled shear strain."""
    young = 2.5
    d = np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])
    d *= young / ((1 + nu) * (1 - 2 * nu))
    for e11, e22, g12 in np.eye(3):
        s = c_of(np.array([[e11, g12 / 2], [g12 / 2, e22]])[:, :, None], lame(young, nu))[:, :, 0]
        np.testing.assert_allclose([s[0, 0], s[1, 1], s[0, 1]], d @ [e11, e22, g12], atol=1e-13)
        assert s[0, 1] == s[1, 0]

"""The constitutive laws at a point: against closed forms and against their own derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from stripfold.strip import laws
from stripfold.strip.laws import LAWS, Lame

LAME = Lame.from_young(1.7, 0.3)
RNG = np.random.default_rng(7)
F = np.eye(2) + 0.4 * RNG.standard_normal((5, 2, 2))
DF = RNG.standard_normal((5, 2, 2))
STEPS = 2.0 ** -np.arange(6, 12)


def rotation(degrees: float) -> np.ndarray:
    """Rotation matrix."""
    a = np.radians(degrees)
    return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])


def slopes(remainders: np.ndarray) -> np.ndarray:
    """Observed orders between successive halvings of the step."""
    return np.log2(remainders[:-1] / remainders[1:])


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_energy_to_stress_to_tangent(nu):
    """Taylor: the energy's remainder has slope 2 without the stress, 2 -> 3 with each derivative more."""
    lame = Lame.from_young(1.7, nu)
    energy = lambda t: laws.svk_energy(F + t * DF, lame)  # noqa: E731
    first = np.sum(laws.svk_stress(F, lame) * DF, axis=(1, 2))
    second = np.einsum("nij,nijkl,nkl->n", DF, laws.svk_tangent(F, lame), DF)
    with_stress = np.array([np.abs(energy(t) - energy(0.0) - t * first).max() for t in STEPS])
    with_both = np.array([np.abs(energy(t) - energy(0.0) - t * first - t**2 / 2.0 * second).max() for t in STEPS])
    print("slopes with stress", slopes(with_stress), "with tangent", slopes(with_both))
    assert slopes(with_stress) == pytest.approx(2.0, abs=0.1)
    assert slopes(with_both) == pytest.approx(3.0, abs=0.1)
    assert with_both[-1] < 1e-8


@pytest.mark.parametrize("nu", [0.0, 0.3])
@pytest.mark.parametrize("law", ["svk", "printed"])
def test_stress_to_tangent(law, nu):
    """Taylor: the stress's remainder has slope 2; and the tangent is the derivative by central differences."""
    lame, stress = Lame.from_young(1.7, nu), LAWS[law].stress
    tangent = LAWS[law].tangent(F, lame, None)
    linear = np.einsum("nijkl,nkl->nij", tangent, DF)
    remainder = np.array([np.abs(stress(F + t * DF, lame) - stress(F, lame) - t * linear).max() for t in STEPS])
    print("slopes", slopes(remainder))
    assert slopes(remainder) == pytest.approx(2.0, abs=0.1)
    assert remainder[-1] < 1e-5
    central = np.empty_like(tangent)
    for k in range(2):
        for m in range(2):
            e = np.zeros((2, 2))
            e[k, m] = 1e-5
            central[..., k, m] = (stress(F + e, lame) - stress(F - e, lame)) / 2e-5
    np.testing.assert_allclose(tangent, central, atol=1e-8 * np.abs(tangent).max(), rtol=0)


@pytest.mark.parametrize("law", ["svk", "printed"])
@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0, -123.0])
def test_a_rotation_leaves_no_stress(law, degrees):
    """Truth: E = 0 under a rotation, so both laws (also the printed one) give zero."""
    f = rotation(degrees)
    assert np.abs(LAWS[law].stress(f, LAME)).max() < 1e-15
    if law == "svk":
        assert abs(laws.svk_energy(f, LAME)) < 1e-30


@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0])
def test_svk_is_objective(degrees):
    """Truth: ``P(R F) = R P(F)``, ``A(R F)`` is A turned in its first and third index, the energy unchanged."""
    r = rotation(degrees)
    np.testing.assert_allclose(laws.svk_stress(r @ F, LAME), r @ laws.svk_stress(F, LAME), atol=1e-14, rtol=0)
    turned = np.einsum("ai,nijkl,ck->najcl", r, laws.svk_tangent(F, LAME), r)
    np.testing.assert_allclose(laws.svk_tangent(r @ F, LAME), turned, atol=1e-13, rtol=0)
    np.testing.assert_allclose(laws.svk_energy(r @ F, LAME), laws.svk_energy(F, LAME), rtol=1e-13)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45])
def test_lame_parameters_give_the_papers_matrix(nu):
    """Truth: the paper's matrix D, plane strain, in Voigt's order (11, 22, 12) with the doubled shear strain."""
    young = 2.5
    d = np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])
    d *= young / ((1 + nu) * (1 - 2 * nu))
    lame = Lame.from_young(young, nu)
    for e11, e22, g12 in np.eye(3):
        s = laws.stress_of_strain(np.array([[e11, g12 / 2], [g12 / 2, e22]]), lame)
        np.testing.assert_allclose([s[0, 0], s[1, 1], s[0, 1]], d @ [e11, e22, g12], atol=1e-14)
        assert s[0, 1] == s[1, 0]

"""The printed law loses what an objective law keeps under rotation, in numbers and in the figure."""

from __future__ import annotations

import numpy as np
import pytest

from plots import printed_law
from plotted import lines
from stripfold.strip.reference import product, second_piola
from studies import printed_law as study


def test_stress_and_stiffness():
    data = study.run(np.array([0.0, 45.0, 90.0, 180.0]))
    share = np.array([1.0, 0.5, 0.0, 1.0])
    np.testing.assert_allclose(data["stress_svk"], 0.105, rtol=1e-12)
    np.testing.assert_allclose(data["stress_printed"], 0.105 / 1.1 * share, atol=1e-15)
    np.testing.assert_allclose(data["stiffness_svk"], 1.0, rtol=1e-12)
    np.testing.assert_allclose(data["stiffness_printed"], share, atol=1e-14)
    assert all({"units", "long_name"} <= set(variable.attrs) for variable in data.variables.values())


@pytest.mark.parametrize("name", ["svk", "printed"])
def test_stiffness_is_the_moment_of_the_stress(name):
    """By finite differences of the moment of the stresses, without the law's tangent."""
    angle = np.array([20.0, 70.0])
    r = study.rotation(angle)
    zeta, weight = np.polynomial.legendre.leggauss(6)

    def moment(kappa: float) -> np.ndarray:
        total = np.zeros(2)
        for z, w in zip(zeta, weight, strict=True):
            f = r * np.array([1.0 - kappa * z, 1.0])[:, None]
            p = product(f, second_piola(f, study._LAME, name))
            total -= w * z * np.sum(r[:, 0] * p[:, 0], axis=0)
        return total

    slope = (moment(1e-4) - moment(-1e-4)) / 2e-4 / (2.0 / 3.0)
    np.testing.assert_allclose(slope, study.stiffness(name, angle), atol=1e-7)


def test_figure():
    fig = printed_law.draw(study.run())
    for ax, highest in zip(fig.axes, (0.105 / 1.1, 1.0), strict=True):
        (printed,) = lines(ax, "--")
        np.testing.assert_allclose(printed[[0, -1]], [(0.0, highest), (90.0, 0.0)], atol=1e-15)
        (svk,) = lines(ax, "-")
        assert np.ptp(svk[:, 1]) < 1e-12
    assert [text.get_text() for text in fig.axes[0].texts] == ["0.0955", "0.0477", "0"]

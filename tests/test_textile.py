"""The linear strip that stands in for a measured textile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stripfold import elastica
from stripfold.base.errors import InvalidInputError
from stripfold.base.material import Material
from tasks import textile

TABLE = Path(__file__).parents[1] / "data" / "textile_moment_curvature.csv"
LOAD = 13.6


def test_a_linear_law_has_its_own_stiffness():
    table = np.outer(np.linspace(1.0, 40.0, 7), [1.0, 0.03])
    found = textile.secant(table, LOAD, 2.5)
    assert found.stiffness == pytest.approx(0.03, rel=1e-12)
    assert found.kappa == pytest.approx(2.5 / (0.03 / LOAD) ** (1 / 3), rel=1e-12)
    assert found.eta_b == pytest.approx(LOAD / 9.81 / 0.03, rel=1e-12)


@pytest.mark.parametrize("height", [2.0, 3.0, 8.0])
def test_the_textiles_secant_is_consistent_with_itself(height):
    table = textile.read_table(TABLE)
    curvature = textile.largest_curvature(elastica.critical(height).state)
    found = textile.secant(table, LOAD, curvature)
    star = Material(found.eta_b).gravity_length
    assert found.kappa * star == pytest.approx(curvature, rel=1e-10)
    assert found.stiffness * found.kappa == pytest.approx(np.interp(found.kappa, *table.T), rel=1e-12)
    assert star == pytest.approx((found.stiffness / LOAD) ** (1 / 3), rel=1e-12)


def test_the_textiles_numbers():
    # Solved by hand between the two rows around it: M = 0.38028 + (0.38790 - 0.38028) (k - 24.7668) / 3.1542 N.
    found = textile.secant(textile.read_table(TABLE), LOAD, 2.69235)
    assert found.kappa == pytest.approx(26.29, abs=0.01)
    assert found.stiffness == pytest.approx(0.014604, abs=2e-6)
    assert found.eta_b == pytest.approx(94.93, abs=0.01)


def test_the_table_is_the_measured_one():
    table = textile.read_table(TABLE)
    assert table.shape == (15, 2)
    assert table[[0, -1]] == pytest.approx(np.array([[1.8738, 0.28755], [27.9210, 0.38790]]), abs=6e-5)
    text = TABLE.read_text()
    assert "bendstiff" in text
    assert "MIT" in text
    assert "Permission is hereby granted" in TABLE.with_name(TABLE.name + ".license").read_text()


@pytest.mark.parametrize("curvature", [0.1, 4.0, float("nan")])
def test_nothing_is_extrapolated(curvature):
    with pytest.raises(InvalidInputError, match="with this table") as caught:
        textile.secant(textile.read_table(TABLE), LOAD, curvature)
    low, high = (float(word) for word in caught.value.allowed.split()[1:4:2])
    for inside in (low * 1.001, high * 0.999):
        assert textile.secant(textile.read_table(TABLE), LOAD, inside).stiffness > 0.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "curvature,moment\n1,2\n3,4\n",
        "curvature_1_per_m,moment_N\n1,2\n",
        "curvature_1_per_m,moment_N\n1,2\n3,four\n",
        "curvature_1_per_m,moment_N\n1,2\n3\n",
        "curvature_1_per_m,moment_N\n1,2,3\n3,4,5\n",
        "curvature_1_per_m,moment_N\n3,2\n1,4\n",
        "curvature_1_per_m,moment_N\n0,0\n1,4\n",
        "curvature_1_per_m,moment_N\n1,2\n2,nan\n",
    ],
)
def test_a_bad_table_is_refused(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InvalidInputError, match="table"):
        textile.read_table(path)


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(InvalidInputError, match=r"nowhere\.csv"):
        textile.read_table(tmp_path / "nowhere.csv")

"""The friction of real fabrics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import made_up
from plots import fabrics as figure
from plotted import lines
from stripfold.errors import InvalidInputError
from studies import fabrics

DATA = Path(__file__).parents[1] / "data"
TABLE, TEXTILE = DATA / "fabrics.csv", DATA / "textile_moment_curvature.csv"


@pytest.fixture(scope="module")
def found():
    return fabrics.run(str(TABLE), str(TEXTILE), 13.6, 3.0)


def test_friction_by_hand(found):
    # Cotton broad: 0.118 gf cm^2/cm, 0.124 gf cm/cm, 12.38 mg/cm^2. In gf and cm: w = 0.01238, L* = (0.118 / w)^(1/3).
    cotton = found.sel(fabric="cotton broad (A)")
    unit = (0.118 / 0.01238) ** (1.0 / 3.0)
    # The printed weights are in standard gravity.
    assert float(cotton.gravity_length) == pytest.approx(0.01 * unit, rel=2e-4)
    assert float(cotton.friction) == pytest.approx(0.062 / (0.01238 * unit**2), rel=2e-4)
    assert float(cotton.eta_b) == pytest.approx(0.1238 / 1.1572e-5, rel=1e-4)


def test_textile(found):
    # docs/physics.md, section 7: 0.288 N at 1.9 /m, 0.388 N at 28 /m.
    moment = float(found.textile_moment) + float(found.textile_rigidity) * np.array([1.9, 28.0])
    np.testing.assert_allclose(moment, [0.288, 0.388], rtol=0.1)
    assert float(found.textile_friction_secant) == pytest.approx(2.1, abs=0.05)
    assert float(found.textile_friction) > float(found.textile_friction_secant)


@pytest.mark.parametrize(("old", "new"), [("1.1571847e-5", "1.1571847e-4"), ("0.118", "-0.118"), ("0.118", "soft")])
def test_a_table_that_contradicts_itself_is_refused(tmp_path, old, new):
    path = tmp_path / "fabrics.csv"
    path.write_text(TABLE.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InvalidInputError):
        fabrics.run(str(path), str(TEXTILE), 13.6, 3.0)


def test_figure(found):
    (ax,) = figure.draw(found, made_up.frictions()).axes
    (points,) = lines(ax, "None")
    np.testing.assert_allclose(points[:, 0], np.sort(found.friction))
    assert [text.get_text() for text in ax.get_yticklabels()][1] == "polyester faille (F)"

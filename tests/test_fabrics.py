"""The friction of real fabrics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from plots import fabrics as figure
from plotted import lines
from stripfold.base.errors import InvalidInputError
from studies import fabrics

DATA = Path(__file__).parents[1] / "data"
TABLE, TEXTILE = DATA / "fabrics.csv", DATA / "textile_moment_curvature.csv"


@pytest.fixture(scope="module")
def found():
    return fabrics.run(str(TABLE), str(TEXTILE), 13.6, 3.0)


def test_friction_by_hand(found):
    # Cotton broad: 0.118 gf cm^2/cm, 0.124 gf cm/cm, 12.38 mg/cm^2. In gf and cm: w = 0.01238, L* = (0.118 / w)^(1/3).
    cotton = found.sel(fabric="cotton broad (A)", bent="cotton broad (A)")
    unit = (0.118 / 0.01238) ** (1.0 / 3.0)
    # The printed weights are in standard gravity.
    assert float(cotton.gravity_length) == pytest.approx(0.01 * unit, rel=2e-4)
    assert float(cotton.friction) == pytest.approx(0.062 / (0.01238 * unit**2), rel=2e-4)
    assert float(cotton.eta_b) == pytest.approx(0.1238 / 1.1572e-5, rel=1e-4)


def test_the_table_is_what_its_sources_print(found):
    # mg/cm^2, gf cm^2/cm and gf cm/cm of the fabrics by Kawabata's test.
    printed = [[12.38, 16.29, 11.65, 10.43], [0.118, 0.067, 0.077, 0.019], [0.124, 0.033, 0.029, 0.007]]
    bent = found.sel(fabric=found.bent.values)
    values = [bent.areal_density * 100.0, bent.rigidity / 9.80665e-5, bent.loop_width / 9.80665e-3]
    np.testing.assert_allclose(values, printed, rtol=1e-6)
    # The first and the last row by cantilever, 1e-9 N m along warp and weft: 1779.9 and 3076.2, 76985.6 and 45001.3.
    rows = found.sel(fabric=["cantilever 1", "cantilever 618"])
    np.testing.assert_allclose(rows.rigidity, [0.5e-9 * (1779.9 + 3076.2), 0.5e-9 * (76985.6 + 45001.3)], rtol=1e-6)
    assert found.sizes == {"fabric": 30, "bent": 4}


def test_textile(found):
    # docs/physics.md, section 7: 0.288 N at 1.9 /m, 0.388 N at 28 /m.
    moment = float(found.textile_moment) + float(found.textile_rigidity) * np.array([1.9, 28.0])
    np.testing.assert_allclose(moment, [0.288, 0.388], rtol=0.1)
    assert float(found.textile_friction_secant) == pytest.approx(2.1, abs=0.05)
    assert float(found.textile_friction) > float(found.textile_friction_secant)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1.1571847e-5", "-1.1571847e-5"),
        ("1.1571847e-5", "soft"),
        ("1.2160246e-3", "0.0"),
        (",plain,", ",plain,plain,"),
    ],
)
def test_a_table_that_cannot_be_right_is_refused(tmp_path, old, new):
    path = tmp_path / "fabrics.csv"
    path.write_text(TABLE.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InvalidInputError):
        fabrics.run(str(path), str(TEXTILE), 13.6, 3.0)


def test_figure(found):
    needed = xr.Dataset(
        {"suffices": (("length", "uncertainty"), [[0.006, 0.04], [0.009, 0.19]])},
        {"length": [14.0, 30.0], "uncertainty": [0.0, 0.2]},
    )
    lengths, frictions = figure.draw(found, needed).axes
    points = np.concatenate(lines(lengths, "None"))
    np.testing.assert_allclose(np.sort(points[:, 0]), 100.0 * np.sort(found.gravity_length))
    drawn = [line.get_ydata() for line in frictions.get_lines()]
    np.testing.assert_allclose(drawn[:2], [[0.006, 0.009], [0.04, 0.19]])
    np.testing.assert_allclose([y[0] for y in drawn[2:6]], np.sort(found.friction))

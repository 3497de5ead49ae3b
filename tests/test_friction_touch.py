"""First touches on the triangular and the circular path with bending friction."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from plots import friction_touch as figure
from plotted import lines
from stripfold.paths import geometric
from studies import friction_touch
from studies.friction_touch import FELL, FIRST_HEIGHT, LAID, first_touch
from studies.motion_with_friction import Case

MOTION = {"yield_curvature": 0.05, "step": 0.2, "speed": 0.05, "air": 0.11, "stiffness": 0.05}
CASE = Case(12.0, 0.01, stiffest=5.0, **MOTION)


def test_without_friction_the_strip_falls_with_that_of_a_fabric_it_is_laid_down():
    path = geometric.circular(12.0)
    free, how = first_touch(CASE, path, 0.0)
    assert how == FELL
    laid, how = first_touch(CASE, path, 0.3)
    assert how == LAID
    # Beyond the planned first touch, 2.63 L*, and not by chance the same place.
    assert 3.3 < laid < free < 3.7


def test_first_height():
    path = geometric.triangular(20.0)
    assert path.position(friction_touch._at_height(path.pieces[0]))[1] == pytest.approx(FIRST_HEIGHT)


def test_another_gravity_length():
    # x / L* = (L / L*)^p means x = L^p L*^(1 - p), for any L*.
    lengths = np.linspace(10.0, 12.0, 30)
    x = lengths[None, :, None] ** 0.4
    found = friction_touch._with_unit(np.log(lengths), x, 1.05)
    np.testing.assert_allclose(found[0, 10:20], x[0, 10:20] * 1.05**0.6, rtol=1e-5)


@pytest.fixture(scope="module")
def stored():
    patch = pytest.MonkeyPatch()
    patch.setattr(
        friction_touch, "first_touch", lambda case, path, m: (2.0 + m + 0.1 * case.refinement, LAID if m else FELL)
    )
    data = friction_touch.run([12.0, 20.0], 0.01, [0.1, 1.0], 20.0, MOTION, 0.2)
    patch.undo()
    return data


def test_study(stored):
    np.testing.assert_allclose(stored["touch_x"][1, 1], [2.1, 2.2, 3.1])
    np.testing.assert_allclose(stored["checked_x"][0], [2.05, 2.15, 3.05])
    assert (stored["touch_softer"] < stored["touch_x"]).all()
    assert (stored["touch_stiffer"] > stored["touch_x"]).all()
    np.testing.assert_allclose(stored["planned_x"], 2.6255, atol=1e-3)


def test_figure(stored):
    top, _ = figure.draw(stored, xr.Dataset({"friction": ("fabric", [0.2, 1.1])})).axes
    np.testing.assert_allclose(lines(top, "-")[0][:, 1], [2.1, 2.2, 3.1] - stored["planned_x"].values[0])

"""The delay of the snap by bending friction."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import made_up
from plots import friction_delay as figure
from plotted import lines
from stripfold import elastica
from studies import friction_delay
from studies.motion_with_friction import SNAP, TOUCH, Case, limit

FINE = Case(length=16.0, thickness=0.01, yield_curvature=0.0125, step=0.1)


def test_rise_for_small_friction_is_that_of_perturbation_theory():
    end, with_friction, *_ = limit(FINE, 3.0, 0.01)
    assert end == SNAP
    rise = with_friction - limit(FINE, 3.0, 0.0)[1]
    assert rise / 0.01 == pytest.approx(elastica.friction_delay(3.0), rel=0.02)


def test_the_coefficient_does_not_depend_on_the_difference():
    assert elastica.friction_delay(3.0, 1e-3) == pytest.approx(elastica.friction_delay(3.0), rel=1e-3)


def test_the_sag_touches_first_with_the_friction_of_a_fabric():
    end, lam, start, speed = limit(Case(20.0, 0.01, 0.1, 0.4), 3.0, 0.3)
    assert end == TOUCH
    assert start < 9.86 < lam
    assert 0.0 < speed < 1.0  # slower than the gripper


def test_bracket_narrows_around_the_change(monkeypatch):
    monkeypatch.setattr(
        friction_delay, "limit", lambda case, height, moment: (SNAP if moment < 0.05 else TOUCH, 10.0, 2.0, 1.0)
    )
    low, high = friction_delay.vanishing(FINE, 3.0, 0.01, 0.1)
    assert low < 0.05 <= high <= friction_delay.NARROW * low


@pytest.fixture(scope="module")
def stored():
    """A study with a limit that is linear in M_0 and touches from 0.05 on."""
    patch = pytest.MonkeyPatch()
    for name, value in {
        "limit": lambda case, z, m: (SNAP if m < 0.05 else TOUCH, 7.0 + z + 9.0 * m, z - 1.0, np.inf),
        "fold_height": lambda case, m: 0.91,
    }.items():
        patch.setattr(friction_delay, name, value)
    friction_delay._without.cache_clear()
    data = friction_delay.run(20.0, 0.01, [3.0, 5.0], [0.01, 0.1, 1.0], 0.1, [0.3], 0.05, 0.4)
    friction_delay._without.cache_clear()
    patch.undo()
    return data


def test_study(stored):
    np.testing.assert_allclose(stored["rise"], [9.0 * stored["moment"].values] * 2)
    assert stored["outcome"].values[0].tolist() == [SNAP, SNAP, TOUCH, TOUCH]
    np.testing.assert_allclose(stored["checked_rise"], 0.9)
    assert (stored["vanishes_above"] < 0.05).all()
    assert (stored["vanishes_below"] >= 0.05).all()


def test_figure(stored):
    fabrics = xr.Dataset({"friction": ("fabric", [0.2, 0.4])})
    top, bottom = figure.draw(stored, fabrics, made_up.frictions()).axes
    np.testing.assert_allclose(lines(top, "-")[0][:, 1], stored["rise"].values[0, 1:])
    np.testing.assert_allclose(lines(bottom, "-")[0][:, 0], [3.0, 5.0])


def test_history_of_the_lift_hardly_matters():
    rises = [limit(Case(16.0, 0.01, 0.05, 0.4, history=history), 3.0, 0.02)[1] for history in ("lifted", "slack")]
    assert rises[1] == pytest.approx(rises[0], abs=0.01)

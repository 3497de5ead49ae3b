"""States assumed on the planned paths: the strip keeps its length, is held, and ends folded."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from stripfold.base.material import Material
from tasks import plans


@pytest.fixture(scope="module")
def planned() -> xr.Dataset:
    return plans.dataset(Material(eta_b=3780.0), 0.6)


def test_every_strip_keeps_its_length_is_held_and_folded(planned: xr.Dataset):
    steps = np.hypot(planned["x"].diff("node"), planned["z"].diff("node"))
    np.testing.assert_allclose(steps.sum("node"), 0.6, rtol=1e-3)
    np.testing.assert_allclose(planned["x"][..., -1], 0.3)
    assert float(planned["z"].min()) > -1e-12
    np.testing.assert_allclose(planned["arc"], np.linspace(0.0, 0.6, 401))
    np.testing.assert_allclose(planned["x"].isel(place=0), np.tile(planned["arc"] - 0.3, (3, 1)), atol=1e-12)
    np.testing.assert_allclose(planned["x"].isel(place=-1, node=0), 0.3)
    np.testing.assert_allclose(planned["z"].isel(place=[0, -1], node=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(planned["pseudo_time"].isel(place=[0, -1]), [[0.0, 1.0]] * 3)
    # Corners are among the places.
    assert float(planned["z"].sel(path="triangular").isel(node=0).max()) == pytest.approx(0.3)


def test_assumed_states(planned: xr.Dataset):
    middle = planned.isel(place=150)
    # Half down the triangle: 15 cm hang from the gripper, 15 cm lie on the lower layer from the fold line on.
    one = middle.sel(path="triangular").interp(node=[0, 50, 100, 150, 200, 300])
    np.testing.assert_allclose(one["x"], [0.15, 0.15, 0.15, 0.075, 0.0, 0.15], atol=1e-12)
    np.testing.assert_allclose(one["z"], [0.15, 0.075, 0.0, 0.0, 0.0, 0.0], atol=1e-12)
    up = planned.isel(place=50).sel(path="triangular").interp(node=[0, 100, 150])
    np.testing.assert_allclose(up["x"], [-0.15, -0.15, -0.075], atol=1e-12)
    np.testing.assert_allclose(up["z"], [0.15, 0.0, 0.0], atol=1e-12)
    # A rigid half turned by 135 degrees.
    one = middle.sel(path="circular").interp(node=[0, 100, 200])
    for place in (one["x"], one["z"]):
        np.testing.assert_allclose(place, np.sqrt(0.5) * np.array([0.3, 0.15, 0.0]), atol=1e-12)


def test_the_lying_length_is_the_plans(planned: xr.Dataset):
    state = planned.sel(path="r-path").isel(place=-1)
    lifted = state["x"].where(state["z"] > 1e-7, drop=True)
    begins = 0.3 - float(planned.attrs["lying_length"])
    assert float(lifted[-1]) == pytest.approx(begins, abs=0.003)
    assert float(planned.attrs["landing_x"]) == pytest.approx(begins + 2.484620 * planned.attrs["gravity_length"])

"""The study of the rod, and its figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from plots import rod as figure
from stripfold import elastica
from stripfold.ask.prediction import ElasticaPrediction, from_near_the_end
from stripfold.files import store
from stripfold.follow.static import StripModel
from studies import models as rod

LENGTH, HEIGHT, THICKNESS = 12.0, 3.0, 0.06


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return rod.run_rod(LENGTH, [HEIGHT], [0.1, THICKNESS], 1.0)


class TestStudy:
    def test_numbers(self, found: xr.Dataset):
        """Of each model at each place, from runs of its own; the differences from what is stored beside them."""
        one = found.sel(gripper_height=HEIGHT, thickness=THICKNESS)
        lambda_c = {name: float(one["lambda_c"].sel(model=name)) for name in rod.MODELS}
        strip, prediction = StripModel(LENGTH, THICKNESS, kind="rod"), ElasticaPrediction.at(HEIGHT)
        own, coarse = (from_near_the_end(strip, prediction, refinement) for refinement in (1.0, 2.0))
        assert float(one["mesh_error"].sel(model="rod")) == pytest.approx(abs(own.lam - coarse.lam), rel=1e-9)
        assert lambda_c["rod"] == pytest.approx(own.lam, rel=1e-9)
        assert float(one["model_error"]) == pytest.approx(lambda_c["rod"] / lambda_c["solid"] - 1.0, abs=1e-12)
        truth = elastica.critical(HEIGHT).advance
        assert float(one["lambda_c_elastica"]) == pytest.approx(truth, rel=1e-12)
        assert float(one["thickness_effect"]) == pytest.approx(lambda_c["solid"] / truth - 1.0, abs=1e-12)
        assert abs(float(one["model_error"])) < 1e-3 < abs(float(one["thickness_effect"]))
        thicker = found.sel(gripper_height=HEIGHT, thickness=0.1)
        assert float(thicker["thickness_effect"]) == pytest.approx((0.1 / 0.06) ** 2 * -2.1e-3, rel=0.2)

    def test_it_can_be_stored(self, found: xr.Dataset, tmp_path: Path):
        store.write(found, tmp_path / "rod.nc", title="rod")
        xr.testing.assert_equal(store.read(tmp_path / "rod.nc").drop_attrs(), found.drop_attrs())

    def test_where_nothing_snaps(self):
        data = rod.run_rod(LENGTH, [1.2], [0.05], 2.0)
        assert np.isnan(data["lambda_c"]).all()
        assert "SolveError: no snap of the rod" in str(data["no_result"].values[0, 0, 0])


def test_figure(found: xr.Dataset):
    """The curves are the stored numbers."""
    (ax,) = figure.draw(found).axes
    drawn = [line.get_ydata() for line in ax.get_lines()]
    np.testing.assert_array_equal(drawn[0], np.abs(found["model_error"].sel(gripper_height=HEIGHT)))
    np.testing.assert_array_equal(drawn[1], np.abs(found["thickness_effect"].sel(gripper_height=HEIGHT)))

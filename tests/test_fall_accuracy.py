"""The accuracy of a fall versus run time, and its figure."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from plots import fall_precision
from stripfold.files import store
from studies import fall_accuracy

ROD = {"model": "rod", "refinement": 2.0}


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    ways = [ROD, {**ROD, "tolerance": 1e-4}, {**ROD, "scheme": "generalised-alpha"}]
    return fall_accuracy.run(12.0, 0.0594, [3.0], 1e-2, ways, [ROD, {**ROD, "tolerance": 1e-4}], 1)


def test_errors_are_from_the_reference(found: xr.Dataset):
    """The first way is the reference itself, the second its check."""
    error = found["error"].values[:, 0]
    assert error[0] == 0.0
    assert (found["lambda_error"] == 0.0).all()
    assert abs(error[1]) == float(found["uncertain"][0]) > 1e-5
    assert 1e-5 < abs(error[2]) < 0.02
    assert found["steps"][1, 0] < 0.6 * found["steps"][0, 0]
    assert np.abs(found["time_error"][1:, 0]).min() > 0.0
    assert (found["seconds"] > 0.0).all()


def test_a_method_that_fails_has_no_number(monkeypatch: pytest.MonkeyPatch):
    """A motion that comes to rest without a touch has no first touch."""
    truth = fall_accuracy.simulate_fall

    def simulate_fall(release, fall, options, scheme):
        found = truth(release, fall, options, scheme=scheme)
        return found if options.tolerance == 1e-4 else type(found)(found.problem, found.states, None, np.nan)

    monkeypatch.setattr(fall_accuracy, "simulate_fall", simulate_fall)
    sure = {**ROD, "tolerance": 1e-4}
    data = fall_accuracy.run(12.0, 0.0594, [3.0], 1e-2, [ROD], [sure, sure], 1)
    assert np.isnan(data["error"]).all()
    assert "without touching" in str(data["no_result"].values[0, 0])


def test_units_and_figure(found: xr.Dataset, tmp_path):
    for name, variable in found.variables.items():
        assert {"units", "long_name"} <= set(variable.attrs), name
    store.write(found, tmp_path / "a.nc", title="a", config={})
    fig = fall_precision.draw(store.read(tmp_path / "a.nc"))
    assert len(fig.axes) == 1
    texts = [text.get_text() for text in fig.legends[0].get_texts()]
    assert len([text for text in texts if text.startswith(("rod", "solid"))]) == 2
    assert {"longest elements", "longer time steps", "Pareto front"} < set(texts)

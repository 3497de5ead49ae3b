"""The table of variables, and datasets made from it."""

import numpy as np
import pytest

from stripfold.base.errors import StripfoldError
from stripfold.base.material import Material
from stripfold.files import schema

MATERIAL = Material(eta_b=3780.0, rho_a=0.2)


def test_every_variable_has_a_unit_and_a_long_name():
    for name, variable in schema.variables().items():
        assert variable.long_name, name
        assert variable.unit in {*MATERIAL.scales, "m-4 s2", "m-2 s2", "kg m-2"}, name


def test_scales_are_those_of_the_material():
    """By hand: L* = (eta_b g)^(-1/3), force rho_a g L*, time sqrt(L*/g)."""
    length = (3780.0 * 9.81) ** (-1.0 / 3.0)
    force, time = 0.2 * 9.81 * length, np.sqrt(length / 9.81)
    expected = {"1": 1, "degree": 1, "m": length, "s": time, "m s-1": length / time, "s-2": time**-2}
    expected |= {"N m-1": force, "N": force * length, "J m-1": force * length}
    assert MATERIAL.scales == pytest.approx(expected)


def test_dataset_converts_describes_and_sorts_out_coordinates():
    values = {"time": ("time", [0.0, 1.0]), "x": ("time", [1.0, 2.0]), "phase": ("time", ["fall", "after"])}
    data = schema.dataset(values, {"end": "touch"}, MATERIAL.scales)
    np.testing.assert_allclose(data["x"], MATERIAL.gravity_length * np.array([1.0, 2.0]))
    np.testing.assert_allclose(data["time"], MATERIAL.scales["s"] * np.array([0.0, 1.0]))
    assert data["x"].attrs == {"units": "m", "long_name": schema.variables()["x"].long_name, "symbol": "x"}
    assert set(data.coords) == {"time", "phase"}
    assert data["phase"].values.tolist() == ["fall", "after"]
    assert data.attrs == {"end": "touch"}


@pytest.mark.parametrize(("values", "stored"), [([1.0, np.nan], "f8"), ([1, 0], "i8"), ([True, False], "i1")])
def test_an_enumeration_says_what_its_values_mean(values, stored):
    attrs = schema.dataset({"snap": ("case", values)})["snap"].attrs
    assert attrs["flag_values"].tolist() == [0, 1]
    assert attrs["flag_values"].dtype == stored
    assert attrs["flag_meanings"] == "no yes"
    assert "flag_values" not in schema.dataset({"x": ("case", [1.0])})["x"].attrs


def test_an_unknown_variable_is_refused():
    with pytest.raises(StripfoldError, match="nonsense"):
        schema.dataset({"nonsense": ((), 1.0)})

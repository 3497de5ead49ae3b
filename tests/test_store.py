"""Files: whole or not at all, with units and provenance, and what is read back is what was written."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

import stripfold
from stripfold.base import version
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.base.material import Material
from stripfold.files import schema, store


def example() -> xr.Dataset:
    step = xr.Variable("step", np.arange(200), {"units": "1", "long_name": "accepted step"})
    return xr.Dataset(
        {
            "lam": ("step", np.sin(np.arange(200.0) / 9.0), {"units": "m", "long_name": "advance", "symbol": "lambda"}),
            "gap": ("step", np.r_[np.nan, np.zeros(199)], {"units": "m", "long_name": "clearance"}),
            "held": ("step", np.arange(200) % 2 == 0, {"units": "1", "long_name": "contact held"}),
            "law": ((), "svk", {"units": "1", "long_name": "constitutive law"}),
            "names": ("material", ["eta820", "textile"], {"units": "1", "long_name": "material"}),
            "free": ((), 0.2, {"units": "m", "long_name": "free length"}),
        },
        {"step": step, "height": ("step", np.linspace(0, 1, 200), {"units": "m", "long_name": "height"})},
        {"note": "kept"},
    )


def no_leftovers(folder: Path, *names: str) -> bool:
    return sorted(p.name for p in folder.iterdir()) == sorted(names)


def test_what_is_read_is_what_was_written(tmp_path):
    store.write(example(), tmp_path / "a.nc", title="A test", config={"gravity": 9.81, "η": [1, np.float64(2.5)]})
    back = store.read(tmp_path / "a.nc", require=["lam", "height", "note"])
    xr.testing.assert_equal(back, example())
    for name, var in example().variables.items():
        assert back[name].attrs == var.attrs
        assert back[name].dtype.kind == var.dtype.kind
    assert no_leftovers(tmp_path, "a.nc")


def test_provenance(tmp_path):
    dataset = example()
    store.write(dataset, tmp_path / "a.nc", title="A test", config={"gravity": 9.81})
    attrs = store.read(tmp_path / "a.nc").attrs
    assert attrs["title"] == "A test"
    assert attrs["stripfold_version"] == stripfold.__version__
    assert attrs["git_commit"] == version.running_commit()
    assert attrs["Conventions"].startswith("CF-")
    assert json.loads(attrs["config"]) == {"gravity": 9.81}
    packages = json.loads(attrs["packages"])
    assert packages["numpy"] == np.__version__
    assert packages["netCDF4"] == netCDF4.__version__
    assert set(packages) == {"numpy", "scipy", "scikit-fem", "xarray", "netCDF4"}
    assert dataset.attrs == {"note": "kept"}  # the caller's own is left alone


def test_the_same_content_gives_the_same_bytes(tmp_path):
    for name in ("a.nc", "b.nc"):
        store.write(example(), tmp_path / name, title="A test", config={"b": 1, "a": 2})
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_who_made_it_from_what(tmp_path):
    for name in ("a.nc", "b.nc"):
        store.write(example(), tmp_path / name, title="a test")
    attrs = store.read(tmp_path / "a.nc").attrs
    assert attrs["Conventions"] == "CF-1.11, ACDD-1.3"
    assert attrs["source"] == f"stripfold {stripfold.__version__}, commit {version.running_commit()}"
    assert attrs["history"].startswith(attrs["source"])
    assert "10.1109/TMECH.2020.2980957" in attrs["references"]
    assert attrs["license"].startswith("MIT")


def test_the_last_line_is_the_digest_of_the_bytes_before(tmp_path):
    store.write(example(), tmp_path / "a.nc", title="A test")
    whole, _, digest = (tmp_path / "a.nc").read_bytes().rpartition(b"\nSHA-256 of all bytes before this line: ")
    assert digest == f"{hashlib.sha256(whole).hexdigest()}\n".encode()
    assert whole.startswith(b"\x89HDF")
    with xr.open_dataset(tmp_path / "a.nc") as stranger:
        xr.testing.assert_equal(stranger.load(), example())


def changed(path: Path, change) -> None:
    with netCDF4.Dataset(path, "a") as raw:
        change(raw)


@pytest.mark.parametrize(
    "change",
    [
        lambda raw: raw["lam"].__setitem__(7, 0.5),
        lambda raw: raw["names"].__setitem__(0, "eta821"),
        lambda raw: raw["lam"].setncattr("units", "cm"),
        lambda raw: raw.setncattr("note", "changed"),
        lambda raw: raw.renameVariable("lam", "lom"),
    ],
)
def test_a_changed_file_is_refused_by_name(tmp_path, change):
    store.write(example(), tmp_path / "a.nc", title="A test")
    changed(tmp_path / "a.nc", change)
    with pytest.raises(InvalidInputError, match=r"a\.nc.*digest is missing: changed by another program.*delete it"):
        store.read(tmp_path / "a.nc")


def test_every_flipped_bit_is_found_before_hdf5_opens_the_file(tmp_path, monkeypatch):
    """Its library may loop without end in a damaged file."""
    store.write(example(), tmp_path / "a.nc", title="A test")
    whole, last = (tmp_path / "a.nc").read_bytes(), store._TRAILER_SIZE
    random = np.random.default_rng(20261124)
    written = np.flatnonzero(np.frombuffer(whole[:-last], np.uint8))  # the rest is padding
    places = [*random.choice(written, 500), *range(len(whole) - 65, len(whole))]
    monkeypatch.setattr(xr, "open_dataset", None)
    for at, bit in zip(places, random.integers(0, 8, len(places)), strict=True):
        flipped = bytearray(whole)
        flipped[at] ^= 1 << int(bit)
        (tmp_path / "b.nc").write_bytes(flipped)
        with pytest.raises(InvalidInputError, match=r"b\.nc.*its bytes are not those of its digest.*delete it"):
            store.read(tmp_path / "b.nc")


@pytest.mark.parametrize("lost", [1, 65, 105])
def test_a_file_that_has_lost_its_digest_is_refused(tmp_path, lost):
    store.write(example(), tmp_path / "a.nc", title="A test")
    whole = (tmp_path / "a.nc").read_bytes()
    (tmp_path / "a.nc").write_bytes(whole[:-lost])
    with pytest.raises(InvalidInputError, match=r"a\.nc.*cut short.*digest is missing"):
        store.read(tmp_path / "a.nc")


def test_a_file_without_a_digest_is_read(tmp_path):
    """That of another program."""
    store.write(example(), tmp_path / "a.nc", title="A test")
    changed(tmp_path / "a.nc", lambda raw: raw.delncattr(store.DIGEST))
    xr.testing.assert_equal(store.read(tmp_path / "a.nc"), example())


@pytest.mark.parametrize("name", ["lam", "law", "step", "height"])
@pytest.mark.parametrize("key", ["units", "long_name"])
def test_what_has_no_unit_or_name_is_not_stored(tmp_path, name, key):
    dataset = example()
    del dataset[name].attrs[key]
    with pytest.raises(StripfoldError, match=rf"{name} \({key}\)"):
        store.write(dataset, tmp_path / "a.nc", title="A test")
    assert no_leftovers(tmp_path)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, error):
    path = tmp_path / "a.txt"
    store.write_text("old", path)

    def write():
        with store.atomic(path) as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(error):
        write()
    assert path.read_text() == "old"
    assert no_leftovers(tmp_path, "a.txt")


def test_a_failed_netcdf_write_leaves_nothing(tmp_path, monkeypatch):
    def fail(self, path, **_):
        Path(path).write_text("half")
        raise KeyboardInterrupt

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(KeyboardInterrupt):
        store.write(example(), tmp_path / "a.nc", title="A test")
    assert no_leftovers(tmp_path)


def test_json(tmp_path):
    store.write_json({"b": np.float64(0.5), "a": np.arange(3), "ok": np.bool_(True), "η": None}, tmp_path / "a.json")
    text = (tmp_path / "a.json").read_text(encoding="utf-8")
    assert json.loads(text) == {"a": [0, 1, 2], "b": 0.5, "ok": True, "η": None}
    assert text.index('"a"') < text.index('"b"')
    assert text.endswith("}\n")


def test_reading_what_is_not_there(tmp_path):
    with pytest.raises(InvalidInputError, match=r"a\.nc.*existing"):
        store.read(tmp_path / "a.nc")
    with pytest.raises(InvalidInputError, match="existing"):
        store.read(tmp_path)


def test_reading_what_is_no_netcdf_or_damaged(tmp_path):
    (tmp_path / "text.nc").write_text("not netCDF")
    (tmp_path / "empty.nc").touch()
    store.write(example(), tmp_path / "a.nc", title="A test")
    whole = (tmp_path / "a.nc").read_bytes()
    (tmp_path / "half.nc").write_bytes(whole[: len(whole) // 2])
    for name in ("text.nc", "empty.nc", "half.nc"):
        with pytest.raises(InvalidInputError, match=rf"{name}.*whole netCDF-4.*delete it"):
            store.read(tmp_path / name)


def test_reading_what_lacks_something(tmp_path):
    store.write(example(), tmp_path / "a.nc", title="A test")
    with pytest.raises(InvalidInputError, match="with nothing, x_c"):
        store.read(tmp_path / "a.nc", require=["lam", "nothing", "x_c"])
    example().to_netcdf(tmp_path / "foreign.nc")
    with pytest.raises(InvalidInputError, match="git_commit"):
        store.read(tmp_path / "foreign.nc")


MATERIAL = Material(eta_b=3780.0, rho_a=0.2)


def test_every_variable_has_a_unit_and_a_long_name():
    for name, variable in schema.variables().items():
        assert variable.long_name, name
        assert variable.unit in {*MATERIAL.scales, "m-1", "m-4 s2", "m-2 s2", "kg m-2"}, name


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

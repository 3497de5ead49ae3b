"""Freshly written files by the conventions of CF and ACDD."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import stripfold as sf
from stripfold.ask import sweep
from stripfold.base.errors import InvalidInputError
from stripfold.files import store
from studies.common import dataset, variables

# An environment made before the checker was locked does not have it.
pytest.importorskip("compliance_checker")

import conventions

STRIP = sf.Strip(length=0.36, eta_b=3780)


@pytest.mark.parametrize("kind", ["critical", "collapse", "path", "sweep", "study"])
def test_what_is_written_has_no_errors(tmp_path: Path, kind: str):
    file = tmp_path / f"{kind}.nc"
    if kind == "critical":
        point = STRIP.critical(0.06, model="rod", second_gripper="auto", eta_b_uncertainty=0.2)
        point.to_netcdf(file)
    elif kind == "collapse":
        release = sf.Release(disturbance=0.02, air=5.0, until="touch")
        STRIP.collapse(height=0.056, model="rod", release=release).to_netcdf(file)
    elif kind == "path":
        STRIP.assess(sf.paths.triangular(STRIP), model="rod").to_netcdf(file)
    elif kind == "sweep":
        axes = {"height": [0.05, 0.09], "model": ["elastica", "rod"]}
        sweep.run({"length": 0.6, "eta_b": 3780, **axes}, file, cores=1)
    else:
        heights, moments = [3.0, 5.0], [0.0, 0.1]
        values = {
            "gripper_height": ("gripper_height", heights),
            "moment": ("moment", moments),
            "outcome": (("gripper_height", "moment"), [[1.0, 0.0], [np.nan, -1.0]]),
            "check": ("check", ["as above", "half the step"]),
            "checked_rise": ("check", [1.0, 1.1]),
            "no_result": (("gripper_height", "moment"), [["", ""], ["no", ""]]),
        }
        store.write(dataset("friction_delay", values), file, title="a study")
    assert conventions.of_file(file) == ([], [])


def test_every_unit_is_one_of_udunits():
    cf_units = pytest.importorskip("cf_units")
    table = sf.schema.variables()
    studies = {line.split(",")[0] for line in Path("workflow/studies/variables.csv").read_text().splitlines()[1:]}
    for name, variable in [*table.items(), *(item for study in studies for item in variables(study).items())]:
        assert not cf_units.Unit(variable.unit).is_unknown(), name


def test_what_is_found(tmp_path: Path):
    """A reserved name, a unit that is none, a coordinate in no order and a missing title."""
    bad = {
        "height": ("height", [2.0, 1.0, 3.0], {"units": "1", "long_name": "height"}),
        "memory": ("height", [1.0, 1.0, 1.0], {"units": "MB", "long_name": "memory"}),
    }
    xr.Dataset(bad).to_netcdf(tmp_path / "bad.nc")
    errors, omitted = conventions.of_file(tmp_path / "bad.nc")
    for part in ("strictly monotonic", '"MB" are not recognized', "standard_name='height'"):
        assert any(part in error for error in errors), part
    assert any("title" in message for message in omitted)
    good = tmp_path / "good.nc"
    STRIP.critical(0.06, model="elastica").to_netcdf(good)
    told: list[str] = []
    found = conventions.run([str(good), str(tmp_path / "bad.nc")], progress=told.append)
    assert found["cf_errors"].values.tolist() == [0, len(errors)]
    assert found["file"].values.tolist() == ["good", "bad"]
    assert len(told) == len(errors) + len(omitted)


def test_what_cannot_be_read_is_named(tmp_path: Path):
    (tmp_path / "half.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(InvalidInputError, match=r"half\.nc.*delete it"):
        conventions.of_file(tmp_path / "half.nc")

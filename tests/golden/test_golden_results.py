"""The paper's runs as ``make all`` stored them, against those of results.csv.

Where an R-path touches the stability boundary the place of the critical point is known to 3e-4 L* over the sine of the
angle between them: on elements half as long it moves by up to a third of that.

They are looked for in ``results``, or in the folder that STRIPFOLD_RESULTS names; by full runs, so with ``-m slow``.
"""

from __future__ import annotations

import csv
import os
from itertools import groupby
from pathlib import Path

import pytest
import xarray as xr

HERE = Path(__file__).parent
RESULTS = Path(os.environ.get("STRIPFOLD_RESULTS", HERE.parents[1] / "results"))

with (HERE / "results.csv").open(encoding="utf-8", newline="") as _file:
    ROWS = {name: list(rows) for name, rows in groupby(csv.DictReader(_file), key=lambda row: row["file"])}


def selected(data: xr.Dataset, variable: str, where: str) -> float:
    """The value at the place that ``where`` names: labels of a material, path or law, or an index."""
    found = data[variable]
    for part in where.split():
        axis, label = part.split("=")
        labels = data.get(f"{axis}_label")
        index = int(label) if labels is None else [str(one) for one in labels.values].index(label)
        found = found.isel({axis: index})
    return float(found)


@pytest.mark.slow
@pytest.mark.parametrize("file", ROWS)
def test_results_of_the_paper(file: str):
    path = RESULTS / f"{file}.nc"
    if not path.exists():
        pytest.skip(f"{path} is not there: `make all` makes it")
    with xr.open_dataset(path) as data:
        found = [(row, selected(data, row["variable"], row["where"])) for row in ROWS[file]]
    wrong = [
        f"{row['variable']} {row['where']}: {value!r}, stored {row['value']} +- {row['tolerance']}"
        for row, value in found
        if not abs(value - float(row["value"])) <= float(row["tolerance"])
    ]
    assert not wrong, "\n".join(wrong)

"""The variables that results hold: one table of names, units, long names and symbols, and datasets made from it."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stripfold.base.errors import StripfoldError

if TYPE_CHECKING:
    import xarray as xr

Values = Mapping[str, tuple[Any, Any]]
"""Dimensions and values of variables, by name."""


class Variable(NamedTuple):
    """Unit, long name and symbol of a variable; the symbol is the paper's, empty where it has none.

    ``flags`` are the values of an enumeration and their meanings: "0=no 1=yes".
    """

    unit: str
    long_name: str
    symbol: str | None = ""
    flags: str | None = ""

    def attributes(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        """Attributes of the variable in a dataset, by CF; ``dtype`` is that of its values."""
        given = {"units": self.unit, "long_name": self.long_name, "symbol": self.symbol}
        attrs: dict[str, Any] = {key: text for key, text in given.items() if text}
        if self.flags:
            values, meanings = zip(*(flag.split("=") for flag in self.flags.split()), strict=True)
            # The type of the values as stored: a file has bytes for truth values.
            stored = np.dtype("int8") if dtype.kind == "b" else dtype
            attrs |= {"flag_values": np.array(values, dtype=float).astype(stored), "flag_meanings": " ".join(meanings)}
        return attrs


@cache
def variables() -> dict[str, Variable]:
    """The table ``variables.csv``: every variable of the package's results, by name."""
    lines = files("stripfold.files").joinpath("variables.csv").read_text(encoding="utf-8").splitlines()
    return {row.pop("name"): Variable(**row) for row in csv.DictReader(lines)}


def dataset(
    values: Values,
    attrs: Mapping[str, Any] | None = None,
    scales: Mapping[str, float] | None = None,
    table: Mapping[str, Variable] | None = None,
) -> xr.Dataset:
    """A dataset whose variables have the units and long names of the table.

    ``values``: dimensions and values by name.  Texts, and a variable with the name of its only dimension, become
    coordinates.  ``attrs``: global attributes.  ``scales``: factor to each unit, where the values are in solver units:
    :attr:`.Material.scales`.  ``table``: the variables; by default those of :func:`variables`.  Raises StripfoldError:
    a name is not in the table.
    """
    import xarray as xr

    table = variables() if table is None else table
    if unknown := [name for name in values if name not in table]:
        raise StripfoldError(f"the table of variables does not have {', '.join(unknown)}")
    data: dict[str, Any] = {}
    coords: dict[str, Any] = {}
    for name, (dims, given) in values.items():
        found = np.asarray(given)
        if found.dtype.kind in "OU":
            found = found.astype(object)
        elif scales is not None and (factor := scales[table[name].unit]) != 1.0:
            found = factor * found
        is_coordinate = dims in (name, (name,)) or (found.dtype.kind == "O" and found.ndim > 0)
        (coords if is_coordinate else data)[name] = (dims, found, table[name].attributes(found.dtype))
    return xr.Dataset(data, coords, attrs)


def in_si(values: Mapping[str, float], scales: Mapping[str, float]) -> dict[str, float]:
    """Numbers of the table in SI, from solver units; for global attributes."""
    return {name: scales[variables()[name].unit] * value for name, value in values.items()}

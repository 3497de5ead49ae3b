"""The form of all results: their numbers in words, as JSON with units, as a dataset, in a file and as a figure."""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from math import isfinite, isnan
from typing import TYPE_CHECKING, Any, ClassVar

from stripfold.base.version import version

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Progress = Callable[[str], None]
Rows = list[tuple[str, str]]
WIDTH = 12
"""Width of the names in a printed result."""


class Result(ABC):
    """Base of all results."""

    title = ""
    shown: ClassVar[tuple[str, ...]] = ()
    """Attributes in the :func:`repr`."""

    @abstractmethod
    def rows(self) -> Rows:
        """Names and values in words, as printed."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The numbers by name, SI; those that the command line prints with ``--json``."""

    @abstractmethod
    def to_dataset(self) -> xr.Dataset:
        """All of it as a dataset, every variable with its unit."""

    @abstractmethod
    def plot(self) -> Figure:
        """A figure of it; ``.savefig(file)`` stores it."""

    def config(self) -> dict[str, Any]:
        """The resolved inputs, stored with the result."""
        return {}

    def to_netcdf(self, file: str | os.PathLike[str]) -> None:
        """Store :meth:`to_dataset` with the inputs, the code's version and those of the libraries."""
        from stripfold.files import store

        store.write(self.to_dataset(), file, title=self.title, config=self.config())

    def __eq__(self, other: object) -> bool:
        """Whether inputs and numbers are the same; run times do not count."""
        if not isinstance(other, type(self)):
            return NotImplemented
        return self is other or (self.config() == other.config() and self.to_dataset().identical(other.to_dataset()))

    def __repr__(self) -> str:
        """One line: the class and what matters most; numbers that do not exist are left out."""
        values = {name: getattr(self, name) for name in self.shown}
        there = {name: value for name, value in values.items() if not (isinstance(value, float) and isnan(value))}
        return f"{type(self).__name__}({', '.join(f'{name}={_short(value)}' for name, value in there.items())})"

    def __str__(self) -> str:
        return "\n".join(f"{name:<{WIDTH}} {text}" for name, text in self.rows())


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))})"
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


def metres(value: float, what: str) -> str:
    """A length with what it is; "-" for none."""
    return f"{value:.6g} m  ({what})" if isfinite(value) else "-"


OTHER = {
    name: unit
    for unit, names in {
        "m s-2": "acceleration gravity",
        "1": "accuracy agreement cases count coverage distortion_coefficients end_t eta_b_uncertainty exponent "
        "exponent_lower exponent_upper friction_moment_star layer_friction no_result row t touch",
        "m": "advance bending_length change drop end end_x end_z flatness fold_at fold_height friction_boundary gain "
        "height height_sd margin residual s scale second_gripper snap_boundary square step touch_limit x_c",
        "degree": "angle clamp slope",
        "px": "camera_matrix image_size rms split_half",
        "m-1": "curl curvature",
        "m s-1": "disturbance",
        "s": "duration seconds",
        "s-2": "pull",
        "J m-1": "energy",
        "m-4 s2": "eta_b_secant",
        "N": "friction_moment",
        "g m-2": "gsm",
        "gf cm/cm": "kes_2hb",
        "gf cm2/cm": "kes_b",
        "N m": "rigidity",
    }.items()
    for name in names.split()
}
"""Units of numbers that no stored dataset has, or has as something else."""
OF_INPUTS = {"air": "s-1", "stiffness": "s"}
"""Those of inputs with the name of another number."""


def document(numbers: Mapping[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers by their names, and ``inputs``, ``units`` (of both, by name, as in the netCDF files) and version."""
    from stripfold.files import schema

    known = {name: variable.unit for name, variable in schema.variables().items()} | OTHER
    units = {name: known[name] for name in _numeric(numbers) if name in known}
    asked = {name: unit for name in _numeric(inputs) if (unit := (known | OF_INPUTS).get(name))}
    return {
        **numbers,
        "inputs": dict(inputs),
        "units": dict(sorted((asked | units).items())),
        "stripfold_version": version(),
    }


def _numeric(values: Any, name: str = "") -> Iterator[str]:
    """Names of all numbers, also of those within lists and mappings."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            yield from _numeric(value, str(key))
    elif isinstance(values, list | tuple):
        for value in values:
            yield from _numeric(value, name)
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield name


def as_json(values: Mapping[str, Any]) -> str:
    """One JSON object; JSON has no nan: null stands for no number."""

    def plain(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: plain(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [plain(item) for item in value]
        return None if isinstance(value, float) and not isfinite(value) else value

    # NumPy's integers and truth values are none of Python's.
    return json.dumps(plain(values), allow_nan=False, default=lambda number: number.item())

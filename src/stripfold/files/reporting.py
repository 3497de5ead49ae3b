"""The form of all results: their numbers in words, for JSON, as a dataset, in a file and as a figure."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from math import isfinite, isnan
from typing import TYPE_CHECKING, Any, ClassVar

from stripfold.files import store

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

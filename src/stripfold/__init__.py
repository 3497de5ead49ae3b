"""Static stability of robotic fabric strip folding: where a strip snaps, how it falls, what a path does to it.

>>> import stripfold as sf
>>> strip = sf.Strip(length=0.6, eta_b=3780)  # m, m^-4 s^2
>>> strip.critical(height=0.09, model="rod").snap
True

All numbers are in SI units.  :class:`Strip` is where to start; ``stripfold.paths`` makes gripper paths,
:func:`eta_b` and :func:`measure` measure.  Names are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stripfold import paths
    from stripfold.errors import InvalidInputError, MeasurementError, NoPathError, SolveError, StripfoldError
    from stripfold.simulation import Release
    from stripfold.strip import Hysteresis, Pull, Strip, eta_b, measure

__version__ = "0.1.0"

__all__ = [
    "Hysteresis",
    "InvalidInputError",
    "MeasurementError",
    "NoPathError",
    "Pull",
    "Release",
    "SolveError",
    "Strip",
    "StripfoldError",
    "__version__",
    "eta_b",
    "measure",
    "paths",
]

_MODULES = {
    "errors": ("InvalidInputError", "MeasurementError", "NoPathError", "SolveError", "StripfoldError"),
    "simulation": ("Release",),
    "strip": ("Hysteresis", "Pull", "Strip", "eta_b", "measure"),
}


def __getattr__(name: str) -> object:
    if name == "paths":
        return import_module("stripfold.paths")
    for module, names in _MODULES.items():
        if name in names:
            found: object = getattr(import_module(f"stripfold.{module}"), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module 'stripfold' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)

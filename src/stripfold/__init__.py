"""Static stability of robotic fabric strip folding: where a strip snaps, how it falls, what a path does to it.

>>> import stripfold as sf
>>> strip = sf.Strip(length=0.6, eta_b=3780)  # m, m^-4 s^2
>>> strip.critical(height=0.09, model="rod").snap
True

All numbers are in SI units: lengths in m, eta_b in m^-4 s^2, forces in N per m of width.

=====================================  ===============================================================================
where it snaps                         Strip.critical(height)
how it falls                           Strip.collapse(height, release=Release(...))
which places of the gripper are safe   Strip.map()
a path that keeps a margin             Strip.plan()
paths: planned, or your own            paths.r_path, triangular, circular, low (strip), paths.read(file, strip)
what a path does to it                 Strip.assess(path, fall=True, friction_moment=M_0, layer_friction=mu)
how stiff a fabric is                  eta_b(fold_height=...), eta_b(image=..., scale=..., method=...)
where a filmed strip snaps             measure(folder)
a question of thousands of strips      sweep.run(grid, file)
=====================================  ===============================================================================

Results print as a table; each has ``to_dict()``, ``to_dataset()`` (xarray), ``to_netcdf(file)`` and ``plot()``.  They
go through pickle, as from the processes of a pool; two of the same inputs and numbers are equal.
Errors are StripfoldError: InvalidInputError for what cannot be used, SolveError for what could not be computed,
MeasurementError for a recording that cannot be measured, NoPathError where no path has the margin.  What a computation
does goes to the logger "stripfold"; a function of one line, ``progress=print``, is told how far it is.

The command line has the same: ``stripfold --help``.  Names are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stripfold import paths
    from stripfold.ask import sweep
    from stripfold.ask.assess import PathAssessment
    from stripfold.ask.collapse import StripCollapse
    from stripfold.ask.critical import CriticalPoint
    from stripfold.ask.inputs import Release
    from stripfold.ask.map import StabilityMap
    from stripfold.ask.monitor import Monitor
    from stripfold.ask.plan import FoldingPlan
    from stripfold.ask.strip import Strip
    from stripfold.base.errors import InvalidInputError, MeasurementError, NoPathError, SolveError, StripfoldError
    from stripfold.film.eta import EtaB, eta_b
    from stripfold.film.measure import RecordingMeasurement, measure

    __version__: str

__all__ = [
    "CriticalPoint",
    "EtaB",
    "FoldingPlan",
    "InvalidInputError",
    "MeasurementError",
    "Monitor",
    "NoPathError",
    "PathAssessment",
    "RecordingMeasurement",
    "Release",
    "SolveError",
    "StabilityMap",
    "Strip",
    "StripCollapse",
    "StripfoldError",
    "__version__",
    "eta_b",
    "fabric",
    "measure",
    "paths",
    "sweep",
]

_MODULES = {
    "base.errors": ("InvalidInputError", "MeasurementError", "NoPathError", "SolveError", "StripfoldError"),
    "ask.plan": ("FoldingPlan",),
    "film.eta": ("EtaB", "eta_b"),
    "film.measure": ("RecordingMeasurement", "measure"),
    "ask.assess": ("PathAssessment",),
    "ask.collapse": ("StripCollapse",),
    "ask.critical": ("CriticalPoint",),
    "ask.fabric": ("fabric",),
    "ask.inputs": ("Release",),
    "ask.map": ("StabilityMap",),
    "ask.monitor": ("Monitor",),
    "ask.strip": ("Strip",),
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from stripfold.base.version import version

        return version()
    if name in ("paths", "sweep"):
        return import_module("stripfold.paths" if name == "paths" else "stripfold.ask.sweep")
    for module, names in _MODULES.items():
        if name in names:
            if module == "film.measure":
                import_module("stripfold.base.errors").require("vision")
            found: object = getattr(import_module(f"stripfold.{module}"), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module 'stripfold' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)

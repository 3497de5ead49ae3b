"""Compiled loops: element integrals, friction in bending, layers in contact, band matrices, a step, pictures.

They know arrays only.  A module compiles on its first import, in seconds, and keeps the result in a cache; the package
loads it on first use, so that what needs no kernel does not wait for the compiler.  Their NumPy versions, the readable
reference, are in ``tests/oracles/kernels.py``.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stripfold.kernels import band as band
    from stripfold.kernels import bending as bending
    from stripfold.kernels import contact as contact
    from stripfold.kernels import coverage as coverage
    from stripfold.kernels import elements as elements
    from stripfold.kernels import solid as solid
    from stripfold.kernels import step as step

MODULES = ("band", "bending", "contact", "coverage", "elements", "solid", "step")
FILM = ("line_kernels",)
"""Modules beside what they serve, in :mod:`stripfold.film`."""


def load() -> None:
    """Load all modules, and compile those that are not in the cache: what is installed is complete after that."""
    for name in MODULES:
        import_module(f"{__name__}.{name}")
    for name in FILM:
        import_module(f"stripfold.film.{name}")


def __getattr__(name: str) -> ModuleType:
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module(f"{__name__}.{name}")

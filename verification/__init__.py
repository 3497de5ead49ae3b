"""Verification of stripfold: one file a study.

A file says in its docstring what is compared with what.  ``run(...)`` computes it; its defaults are the scale of a
reader's ``make all``, and ``workflow/config/release.yaml`` has that of a release.  ``NUMBERS`` are what the pages
quote of it (:mod:`verification.numbers`), ``draw`` its figure where it has one.  Nothing imports this package: the
workflow names its files.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from inspect import signature
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

CHAPTERS = {
    "Statics": (
        "paper printed_law models order low_paths barrier second_gripper stability_map variants explorer branches"
    ),
    "Folding paths and friction": (
        "dynamics falls rpaths gripper rucks friction_delay friction_touch disturbed_rpath fabrics fabric_laws "
        "layer_friction"
    ),
    "Recordings": (
        "public_pictures altered_films phone_films given_numbers eta_pictures photographs recordings_accuracy "
        "video_benchmark"
    ),
    "Accuracy and speed": ("benchmark accuracy estimates hard_cases effects sweeps folding_plans peers"),
}
"""The studies by chapter of the page of numbers, separated by spaces."""
STUDIES = tuple(name for names in CHAPTERS.values() for name in names.split())


def file_of(study: str) -> Path:
    """The file of a study."""
    here = Path(__file__).parent
    return next(p for p in (here / f"{study}.py", here / study / "__init__.py") if p.is_file())


def title_of(study: str) -> str:
    """The first line of its file's docstring."""
    return file_of(study).read_text(encoding="utf-8").partition("\n")[0].strip('". ')


def run(studies: Mapping[str, Mapping[str, Any]], threads: int, progress: Callable[[str], None]) -> list[xr.Dataset]:
    """Run studies one after the other in this process; ``studies``: the arguments of each by its name."""
    found = []
    for name, given in studies.items():
        study = import_module(f"{__name__}.{name}").run
        extra = {"threads": threads, "progress": progress}
        began = perf_counter()
        data = study(**given, **{key: value for key, value in extra.items() if key in signature(study).parameters})
        found.append(data.assign_attrs(title=title_of(name), seconds=round(perf_counter() - began, 1)))
        progress(f"{name}: {found[-1].attrs['seconds']} s")
    return found

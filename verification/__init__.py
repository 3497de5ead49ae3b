"""Verification of stripfold: one file a study.

A file says in its docstring what is compared with what.  ``run(...)`` computes it; its defaults are the scale of a
reader's ``make all``, and ``workflow/config/release.yaml`` has that of a release.  ``NUMBERS`` are what the pages
quote of it (:mod:`verification.numbers`), ``draw`` its figure where it has one.  Nothing imports this package: the
workflow names its files.
"""

from __future__ import annotations

from pathlib import Path

CHAPTERS = {
    "Statics": (
        "paper models order low_paths barrier second_gripper stability_map knocks variants eigenvalues explorer "
        "branches"
    ),
    "Folding paths and friction": (
        "schemes modes lag falls tangency friction_steps friction_delay friction_touch disturbed_rpath fabrics "
        "friction_margin fabric_laws textile_law layer_friction random_paths"
    ),
    "Recordings": (
        "calibration centrelines strip_looks camera_bump markerless eta_pictures recordings_accuracy video_benchmark"
    ),
    "Accuracy and speed": (
        "benchmark rod_benchmark cli_benchmark accuracy fall_accuracy estimates hard_cases effects profiling "
        "sweeps folding_plans fall_benchmark assess_benchmark robot_log_benchmark peers"
    ),
}
"""The studies by chapter of the page of numbers, separated by spaces."""
STUDIES = tuple(name for names in CHAPTERS.values() for name in names.split())
ONE_OF_SEVERAL = {
    "tangency": "rpaths:run_tangency",
    "friction_steps": "rpaths:run_friction_steps",
    "cli_benchmark": "benchmark:run_cli",
    "rod_benchmark": "benchmark:run_rod",
    "assess_benchmark": "benchmark:run_assess",
    "robot_log_benchmark": "benchmark:run_log",
    "fall_benchmark": "benchmark:run_fall",
}
"""Studies of a file with several: the file, and its function."""


def file_of(study: str) -> Path:
    """The file of a study."""
    module = ONE_OF_SEVERAL.get(study, study).partition(":")[0]
    here = Path(__file__).parent
    return next(p for p in (here / f"{module}.py", here / module / "__init__.py") if p.is_file())


def call_of(study: str) -> str:
    """The function of a study, as "module:name"; its numbers are beside it."""
    return f"verification.{ONE_OF_SEVERAL.get(study, f'{study}:run')}"


def title_of(study: str) -> str:
    """The first line of its file's docstring."""
    return file_of(study).read_text(encoding="utf-8").partition("\n")[0].strip('". ')

"""Benchmarks, verification studies and comparisons: they read the package; nothing in the package reads them.

:data:`STUDIES` lists those whose results the repository keeps, in ``results/studies``.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Study(NamedTuple):
    """A study and how the workflow runs it.

    ``call`` is the function, as "module:name".  Its parameters are the section ``config`` of the configuration's
    studies, by default that of the study's name.  ``files`` are patterns of source files that it depends on without
    importing them.
    """

    call: str
    title: str
    config: str = ""
    memory: int = 1000
    files: tuple[str, ...] = ()


COMMAND = ("src/stripfold/**/*.py",)
"""Dependencies of a study that runs the command line in a process of its own."""

EVERYTHING = ("src/stripfold/**/*.py", "workflow/*.py", "workflow/[st]*/**/*.py", "workflow/plots/*.py")
PLUMBING = ("profiles/*/config.yaml", "workflow/config/quick.yaml", "workflow/rules/*.smk", "workflow/script.py")
FRESH_CLONE = ("cold_run", "ci_run", "kills", "slurm_run", "wheels")
"""Studies of whole runs, which no rule can make: ``workflow/fresh_clone.py`` and ``workflow/slurm.py`` do."""

APART = ("peers", "explorer")
"""Studies that need what the environment does not have: other programs, a browser."""

STUDIES = {
    "limit": Study("studies.models:run_limit", "the solid against the elastica as eta_m goes to zero"),
    "order": Study("studies.order:run", "observed order of lambda_c in the element length, and run time"),
    "rod": Study("studies.models:run_rod", "the rod against the solid and the elastica"),
    "branches": Study("studies.branches:run", "random strips on the solid against the elastica and a finer mesh"),
    "low_paths": Study("studies.low_paths:run", "paths below the touch limit, which have no snap"),
    "barrier": Study("studies.barrier:run", "energy barrier between the stable and the unstable state"),
    "stability_map": Study(
        "studies.stability_map:run", "stability map of the gripper's places, its errors and its time", files=COMMAND
    ),
    "knocks": Study("studies.knocks:run", "knocks on a hanging strip in time against the energy barrier"),
    "second_gripper": Study("studies.second_gripper:run", "a second gripper's place, by the critical mode and scanned"),
    "eigenvalues": Study("studies.eigenvalues:run", "smallest eigenvalue down to zero, and the critical modes"),
    "variants": Study("studies.variants:run", "end of the advance and first touch with other choices of the model"),
    "solver_constants": Study(
        "studies.constants:run", "named numerical constants of the solver", files=("src/stripfold/**/*.py",)
    ),
    "estimates": Study("studies.estimates:run", "true errors of lambda_c against their estimates"),
    "hard_cases": Study("studies.hard_cases.run:run", "hard cases, each against its own judge"),
    "schemes": Study("studies.schemes:run", "time integration schemes: order, energy drift, cost"),
    "modes": Study("studies.modes:run", "frequencies of a clamped strip against the beam's"),
    "lag": Study("studies.lag:run", "lag of the snap behind a moving gripper"),
    "falls": Study("studies.falls:run", "hard and easy falls of a strip"),
    "tangency": Study("studies.rpaths:run_tangency", "where R-paths meet the stability boundary"),
    "friction_steps": Study("studies.rpaths:run_friction_steps", "smallest friction against the step size"),
    "fabrics": Study(
        "studies.fabrics:run",
        "internal friction of real fabrics",
        files=("data/fabrics.csv", "data/textile_moment_curvature.csv"),
    ),
    "textile_law": Study(
        "studies.textile_law:run",
        "the measured textile with its own bending law",
        files=("data/textile_moment_curvature.csv",),
    ),
    "friction_delay": Study("studies.friction_delay:run", "rise of lambda_c with bending friction, and its end"),
    "layer_friction": Study("studies.layer_friction:run", "finished folds with friction between the layers"),
    "friction_touch": Study("studies.friction_touch:run", "first touch on folding paths with bending friction"),
    "disturbed_rpath": Study("studies.disturbed_rpath:run", "first touch on a disturbed R-path"),
    "random_paths": Study("studies.random_paths:run", "random gripper paths, each assessed twice"),
    "recordings_accuracy": Study(
        "studies.recordings_accuracy:run",
        "synthetic recordings measured, each with its truth",
        memory=4000,
    ),
    "benchmark": Study("studies.benchmark:run", "time and memory of one lambda_c of the solid", files=COMMAND),
    "cli_benchmark": Study("studies.benchmark:run_cli", "time of one command of the rod", "benchmark", files=COMMAND),
    "rod_benchmark": Study(
        "studies.benchmark:run_rod",
        "time of one lambda_c and one assessment of the rod",
        "assess_benchmark",
    ),
    "assess_benchmark": Study("studies.benchmark:run_assess", "time and memory of one assessment", files=COMMAND),
    "robot_log_benchmark": Study(
        "studies.benchmark:run_log", "time of a robot's log with noise", "assess_benchmark", files=COMMAND
    ),
    "fall_benchmark": Study(
        "studies.benchmark:run_fall", "time and memory of one collapse", "benchmark", files=COMMAND
    ),
    "commands": Study("studies.commands:run", "all commands twice, compared bit for bit", files=COMMAND),
    "fuzz": Study(
        "studies.fuzz:run",
        "malformed and odd inputs of all commands",
        memory=3000,
        files=COMMAND,
    ),
    "sweeps": Study(
        "studies.sweeps:run", "rate, cost and memory of sweeps on all cores", files=(*COMMAND, "workflow/sweep.smk")
    ),
    "folding_plans": Study("studies.folding_plans:run", "plans for random strips of uncertain eta_b, checked"),
    "accuracy": Study("studies.accuracy:run", "error of the end of the advance against run time"),
    "fall_accuracy": Study("studies.fall_accuracy:run", "error of the first touch of a fall against run time"),
    "profiling": Study("studies.profiling:run", "run time of one solid lambda_c and one rod R-path by part"),
    "effects": Study("studies.effects:run", "scenes with each effect on and off"),
    "video_benchmark": Study("studies.video_benchmark:run", "time and memory of measuring a recording"),
    "calibration": Study("studies.calibration:run", "calibration on public pictures of boards"),
    "strip_looks": Study("studies.strip_looks:run", "strips of many looks in synthetic recordings", memory=4000),
    "eta_motion": Study("studies.eta_motion:run", "eta_b from the motion in synthetic recordings", memory=4000),
    "markerless": Study("studies.markerless:run", "lambda by a template of the gripper", memory=4000),
    "camera_bump": Study("studies.camera_bump:run", "recordings whose camera was moved", memory=4000),
    "eta_pictures": Study("studies.eta_pictures:run", "eta_b from drawn folds and from pictures without a strip"),
    "centrelines": Study("studies.centrelines:run", "centrelines in photographs"),
    "explorer": Study(
        "studies.explorer:run", "tables of the explorer, its page in a browser", files=("workflow/explorer/*",)
    ),
    "peers": Study(
        "studies.peers:run",
        "other programs on the same strip",
        memory=2000,
        files=("workflow/peers/*.py", "workflow/peers/*.f90", "workflow/peers/requirements.lock"),
    ),
    "cold_run": Study("studies.cold_run:of_benchmarks", "a whole run from cold", files=EVERYTHING),
    "ci_run": Study("studies.cold_run:of_sections", "a run of all checks", files=EVERYTHING),
    "kills": Study(
        "studies.kills:run",
        "the small run of everything killed at random moments",
        files=(*PLUMBING, "Makefile", "Snakefile", "workflow/unlock.py"),
    ),
    "slurm_run": Study("studies.slurm_run:compare", "the small run of everything on Slurm and here", files=PLUMBING),
    "wheels": Study(
        "studies.wheels:run", "all commands by the wheel in clean environments", files=(*COMMAND, "pyproject.toml")
    ),
}


def configured(name: str, config: Mapping[str, Any]) -> bool:
    """Whether a configuration has a study run; otherwise the result that the repository keeps is used."""
    if name in ("calibration", "centrelines"):
        return True
    return name not in FRESH_CLONE and config["studies"].get(STUDIES[name].config or name) is not None


def parameters(name: str, config: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of a study's function under a configuration."""
    if name in ("calibration", "centrelines"):
        return {"images": config["images"]}
    if name in FRESH_CLONE:
        return {}
    found = dict(config["studies"].get(STUDIES[name].config or name) or {})
    return found | {
        "fall_benchmark": {"scene": config["collapse"]},
        "eta_pictures": {"images": config["images"]},
    }.get(name, {})

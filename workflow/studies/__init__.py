"""Benchmarks, verification studies and comparisons: they read the package; nothing in the package reads them.

:data:`STUDIES` lists those whose results the repository keeps, in ``results/studies``.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Study(NamedTuple):
    """A study and how the workflow runs it.

    ``call`` is the function, as "module:name", by default ``run`` of the study's own module.  Its parameters are the
    section ``config`` of the configuration's studies, by default that of the study's name.  ``files`` are patterns of
    source files that it depends on without importing them.
    """

    title: str
    call: str = ""
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
    name: study if study.call else study._replace(call=f"studies.{name}:run")
    for name, study in {
        "limit": Study("the solid against the elastica as eta_m goes to zero", call="studies.models:run_limit"),
        "order": Study("observed order of lambda_c in the element length, and run time"),
        "rod": Study("the rod against the solid and the elastica", call="studies.models:run_rod"),
        "branches": Study("random strips on the solid against the elastica and a finer mesh"),
        "low_paths": Study("paths below the touch limit, which have no snap"),
        "barrier": Study("energy barrier between the stable and the unstable state"),
        "stability_map": Study("stability map of the gripper's places, its errors and its time", files=COMMAND),
        "knocks": Study("knocks on a hanging strip in time against the energy barrier"),
        "second_gripper": Study("a second gripper's place, by the critical mode and scanned"),
        "eigenvalues": Study("smallest eigenvalue down to zero, and the critical modes"),
        "variants": Study("end of the advance and first touch with other choices of the model"),
        "solver_constants": Study(
            "named numerical constants of the solver", call="studies.constants:run", files=("src/stripfold/**/*.py",)
        ),
        "estimates": Study("true errors of lambda_c against their estimates"),
        "hard_cases": Study("hard cases, each against its own judge", call="studies.hard_cases.run:run"),
        "schemes": Study("time integration schemes: order, energy drift, cost"),
        "modes": Study("frequencies of a clamped strip against the beam's"),
        "lag": Study("lag of the snap behind a moving gripper"),
        "falls": Study("hard and easy falls of a strip"),
        "tangency": Study("where R-paths meet the stability boundary", call="studies.rpaths:run_tangency"),
        "friction_steps": Study("smallest friction against the step size", call="studies.rpaths:run_friction_steps"),
        "fabrics": Study(
            "internal friction of real fabrics", files=("data/fabrics.csv", "data/textile_moment_curvature.csv")
        ),
        "textile_law": Study(
            "the measured textile with its own bending law", files=("data/textile_moment_curvature.csv",)
        ),
        "fabric_laws": Study("fabrics along warp and weft with their own bending law", files=("data/fabrics.csv",)),
        "friction_margin": Study("friction that an R-path needs with an uncertain eta_b"),
        "friction_delay": Study("rise of lambda_c with bending friction, and its end"),
        "layer_friction": Study("finished folds with friction between the layers"),
        "friction_touch": Study("first touch on folding paths with bending friction"),
        "disturbed_rpath": Study("first touch on a disturbed R-path"),
        "random_paths": Study("random gripper paths, each assessed twice"),
        "recordings_accuracy": Study("synthetic recordings measured, each with its truth", memory=4000),
        "benchmark": Study("time and memory of one lambda_c of the solid", files=COMMAND),
        "cli_benchmark": Study(
            "time of one command of the rod", call="studies.benchmark:run_cli", config="benchmark", files=COMMAND
        ),
        "rod_benchmark": Study(
            "time of one lambda_c and one assessment of the rod",
            call="studies.benchmark:run_rod",
            config="assess_benchmark",
        ),
        "assess_benchmark": Study(
            "time and memory of one assessment", call="studies.benchmark:run_assess", files=COMMAND
        ),
        "robot_log_benchmark": Study(
            "time of a robot's log with noise",
            call="studies.benchmark:run_log",
            config="assess_benchmark",
            files=COMMAND,
        ),
        "fall_benchmark": Study(
            "time and memory of one collapse", call="studies.benchmark:run_fall", config="benchmark", files=COMMAND
        ),
        "commands": Study("all commands twice, compared bit for bit", files=COMMAND),
        "fuzz": Study("malformed and odd inputs of all commands", memory=3000, files=COMMAND),
        "sweeps": Study("rate, cost and memory of sweeps on all cores", files=(*COMMAND, "workflow/sweep.smk")),
        "folding_plans": Study("plans for random strips of uncertain eta_b, checked"),
        "accuracy": Study("error of the end of the advance against run time"),
        "fall_accuracy": Study("error of the first touch of a fall against run time"),
        "profiling": Study("run time of one solid lambda_c and one rod R-path by part"),
        "effects": Study("scenes with each effect on and off"),
        "video_benchmark": Study("time and memory of measuring a recording"),
        "calibration": Study("calibration on public pictures of boards"),
        "strip_looks": Study("strips of many looks in synthetic recordings", memory=4000),
        "markerless": Study("lambda by a template of the gripper", memory=4000),
        "camera_bump": Study("recordings whose camera was moved", memory=4000),
        "eta_pictures": Study("eta_b from drawn folds and from pictures without a strip"),
        "centrelines": Study("centrelines in photographs"),
        "explorer": Study("tables of the explorer, its page in a browser", files=("workflow/explorer/*",)),
        "peers": Study(
            "other programs on the same strip",
            memory=2000,
            files=("workflow/peers/*.py", "workflow/peers/*.f90", "workflow/peers/requirements.lock"),
        ),
        "cold_run": Study("a whole run from cold", call="studies.cold_run:of_benchmarks", files=EVERYTHING),
        "ci_run": Study("a run of all checks", call="studies.cold_run:of_sections", files=EVERYTHING),
        "kills": Study(
            "the small run of everything killed at random moments",
            files=(*PLUMBING, "Makefile", "Snakefile", "workflow/unlock.py"),
        ),
        "slurm_run": Study(
            "the small run of everything on Slurm and here", call="studies.slurm_run:compare", files=PLUMBING
        ),
        "wheels": Study("all commands by the wheel in clean environments", files=(*COMMAND, "pyproject.toml")),
    }.items()
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
    return found | {"fall_benchmark": {"scene": config["collapse"]}, "eta_pictures": {"images": config["images"]}}.get(
        name, {}
    )

import os
import shlex
import sys
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir, "workflow")))
# Snakemake puts it into shell commands as it is, and the path may have spaces.
sys.executable = shlex.quote(sys.executable)

from configuration import load, recording_folders
from evidence import code_digest, stale_studies
from plots import SECTIONS
from snakemake.logging import logger
from studies import APART, FRESH_CLONE, STUDIES, configured, parameters
from unlock import remove_half_written

# Checked and completed first: an unknown key or a value that cannot be used ends here. Stored with every result.
config.update(load(dict(config)))
RESULTS = config["results"]
FIGURES = config["figures"]
LOGS = f"{RESULTS}/logs"
BENCHMARKS = f"{RESULTS}/benchmarks"
MATERIALS = {material["name"]: material for material in config["materials"]}
LABELS = {name: material["label"] for name, material in MATERIALS.items()}
# The material whose single runs are drawn: the second, or the only one.
SHOWN = list(MATERIALS)[min(1, len(MATERIALS) - 1)]
# A study has all cores; where no run is repeated, nothing is measured, and short studies run side by side.
# Snakemake gives a rule no more than `--cores`, which nothing needs that only lists or draws the rules.
ALL_CORES = os.cpu_count()
ALONE = ALL_CORES if config["studies"].get("benchmark", {}).get("repeats", 1) > 1 else 1

FILMED = config["recordings"]
# Name of a synthetic recording, and what it shows.
SYNTHETIC = {
    f"{material}_z{height:g}_v{speed * 1e3:g}": {
        "material": material,
        "height": height,
        "speed": speed,
        "number": number,
    }
    for number, (material, height, speed) in enumerate(
        product(FILMED["materials"], FILMED["heights"], FILMED["speeds"])
    )
}
REAL = recording_folders(Path("data/recordings"), [*SYNTHETIC, *MATERIALS])


# Where a figure stands in the report.
CATEGORIES = {name: section for section, names in SECTIONS.items() for name in names}


def in_report(path, caption, category):
    """An output that `snakemake --report` shows."""
    return report(
        path,
        caption=f"../plots/captions/{caption}.rst",
        category=category,
        labels={"result": caption.replace("_", " ")},
    )


def calls(call, files=(), **params):
    """``params`` that call a function, "module:name", which also reads ``files``.

    The digest of its code and of these files is among them: Snakemake redoes a result whose ``params`` have changed.
    """
    return {"call": call, "evidence": code_digest(call, files), "files": files, **params}


def of_material(wildcards):
    return MATERIALS[wildcards.material]


def kept(study):
    """The file of a study; that of the repository where what the study needs is not there."""
    needs = {
        "calibration": config["images"],
        "centrelines": config["images"],
        "peers": "workflow/peers/.venv",
    }
    there = configured(study, config) and Path(needs.get(study, ".")).is_dir()
    return f"{RESULTS if there else 'results'}/studies/{study}.nc"


def redone_without_sources(made, workflow):
    """Have the outputs redone where a file is missing from which they were made.

    Snakemake takes the figures and numbers of a fresh clone, which has no runs, for up to date.
    """
    sources, outputs = list(made.input), list(made.output)

    def none(wildcards):
        if not all(map(os.path.exists, sources)):
            workflow.dag.forcefiles.update(outputs)
        return []

    made.set_input(none)

import os
import shlex
import sys
from functools import partial
from itertools import product
from pathlib import Path

sys.path[:0] = [str(Path(workflow.basedir, "workflow")), str(workflow.basedir)]
# Snakemake puts it into shell commands as it is, and the path may have spaces.
sys.executable = shlex.quote(sys.executable)

from configuration import load, recording_folders
from digest import digest
from plots import SECTIONS
from verification import STUDIES, file_of, title_of

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
ALL_CORES = os.cpu_count()

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


def calls(call, **params):
    """``params`` that call a function, "module:name"; redone where the package or a library has changed."""
    return {"call": call, "digest": digest(), **params}


def code(call, wildcards=None):
    """Source files of a function, as an input."""
    name = call.partition(":")[0]
    if name.startswith("tasks."):
        return sorted(map(str, Path("workflow/tasks").glob("*.py")))
    return [f"{'workflow/' if name.startswith('plots') else ''}{name.replace('.', '/')}.py"]


def of_material(wildcards):
    return MATERIALS[wildcards.material]

import sys
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(workflow.basedir) / "workflow"))

from configuration import load

# Checked and completed first: an unknown key or a value that cannot be used ends here.
CONFIG = load({key: value for key, value in config.items()})
RESULTS = CONFIG["results"]
FIGURES = CONFIG["figures"]
MATERIALS = {material["name"]: material for material in CONFIG["materials"]}
LOGS = f"{RESULTS}/logs"
BENCHMARKS = f"{RESULTS}/benchmarks"
# What is timed runs alone on the machine, so that nothing else is in the times; a single run is no measurement anyway.
ALONE = workflow.cores if CONFIG["studies"]["benchmark"]["repeats"] > 1 else 1


wildcard_constraints:
    material="|".join(MATERIALS),


FILMED = CONFIG["recordings"]
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
REAL = sorted(path.parent.name for path in Path("data/recordings").glob("*/recording.yaml"))


def folder_of(wildcards):
    """Where a recording is: a synthetic one is made."""
    made = wildcards.recording in SYNTHETIC
    return (f"{RESULTS}/recordings/" if made else "data/recordings/") + wildcards.recording


def of_images(study):
    """A study of real pictures; the kept one where these are not at hand: the repository does not carry them."""
    there = Path(CONFIG["images"]).is_dir()
    return f"{RESULTS if there else 'results'}/studies/{study}.nc"


PEERS = "workflow/peers"


def of_peers():
    """The comparison with other programs, if there is to be one; the kept one where they are not installed."""
    if "peers" not in CONFIG["studies"]:
        return None
    there = Path(PEERS, ".venv").is_dir()
    return f"{RESULTS if there else 'results'}/studies/peers.nc"

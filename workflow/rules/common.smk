from itertools import product
from pathlib import Path

from stripfold.config import load

# Checked and completed before any rule runs: an unknown key or a value that cannot be used ends here.
CONFIG = load({key: value for key, value in config.items()})
RESULTS = CONFIG["results"]
FIGURES = CONFIG["figures"]
MATERIALS = {material["name"]: material for material in CONFIG["materials"]}
LOGS = f"{RESULTS}/logs"
BENCHMARKS = f"{RESULTS}/benchmarks"


wildcard_constraints:
    material="|".join(MATERIALS),

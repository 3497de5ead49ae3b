"""Time `snakemake all` from cold, as a new user runs it: in a fresh clone of what is committed."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from stripfold import store
from studies import cold_run

output, cores = Path(sys.argv[1]), int(sys.argv[2])
with tempfile.TemporaryDirectory() as folder:
    clone = Path(folder, "clone")
    subprocess.run(["git", "clone", "--quiet", ".", str(clone)], check=True)
    environment = os.environ | {"PYTHONPATH": str(clone / "src")}
    began = perf_counter()
    subprocess.run(["snakemake", "all", "--cores", str(cores)], cwd=clone, env=environment, check=True)
    wall = perf_counter() - began
    data = cold_run.of_benchmarks(clone / "results" / "benchmarks", wall, cores)
    store.write(data, output, title="a whole run from cold", config={"cores": cores})

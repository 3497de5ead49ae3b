"""The small run of the whole chain on Slurm, compared with the same run on this machine.

``python workflow/slurm.py [OPTIONS FOR SNAKEMAKE ...]`` stores in ``results/studies/slurm_run.nc`` which results are
the same.  Options are those of the site, as ``--slurm-no-account``.  Snakemake's plugin for Slurm is no part of the
environment: where Slurm is named but does not answer it makes every start of Snakemake wait (docs/cluster.md).
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from evidence import ATTRIBUTE, ROOT, evidence
from stripfold.files import store
from studies import STUDIES, slurm_run

study = STUDIES["slurm_run"]
# Before the runs: what is committed meanwhile is not what ran.
found = evidence(study.call, {}, [], study.files)
walls = []
# Beside the code, where the nodes of a cluster see it, too. Kept when a run fails.
folder = Path(tempfile.mkdtemp(prefix=".slurm-run-", dir=ROOT))
for name, how in (
    ("here", ["--cores", str(os.cpu_count())]),
    ("there", ["--workflow-profile", "profiles/slurm", *sys.argv[1:]]),
):
    results, figures = folder / name / "results", folder / name / "figures"
    given = ["--configfile", "workflow/config/quick.yaml", "--config", f"results={results}", f"figures={figures}"]
    began = perf_counter()
    with (folder / f"{name}.log").open("w", encoding="utf-8") as log:
        done = subprocess.run(["snakemake", "all", *how, *given], cwd=ROOT, stdout=log, stderr=subprocess.STDOUT)
    if done.returncode:
        sys.exit(f"snakemake ended with exit code {done.returncode}: {log.name}")
    walls.append(perf_counter() - began)
jobs = (folder / "there.log").read_text(encoding="utf-8").count("submitted with SLURM jobid")
data = slurm_run.compare(folder / "here/results", folder / "there/results", *walls, jobs)
stamped = data.assign_attrs({ATTRIBUTE: json.dumps(found, sort_keys=True)})
store.write(stamped, ROOT / "results/studies/slurm_run.nc", title=study.title, config={"options": sys.argv[1:]})
shutil.rmtree(folder)
different = [str(name) for name in data["file"].values[data["same"].values == 0]]
print(f"{data.sizes['file']} results, {jobs} jobs, {walls[1]:.0f} s (here {walls[0]:.0f} s)")
print("different:", ", ".join(different) or "none")

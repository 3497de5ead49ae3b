import os

# One process per core below: Snakemake tells the numerical libraries to use all of the rule's threads in each of them.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

from concurrent.futures import ProcessPoolExecutor

import xarray as xr

from _run import config_of, logged
from stripfold import store
from stripfold.studies import random_paths

with logged(snakemake) as say:
    study = snakemake.params
    size = 5
    parts = []
    with ProcessPoolExecutor(snakemake.threads) as pool:
        jobs = [
            pool.submit(random_paths.run, range(first, min(first + size, study.cases)), study.seed, study.refinement)
            for first in range(0, study.cases, size)
        ]
        for job in jobs:
            parts.append(job.result())
            say(f"{sum(part.sizes['case'] for part in parts)} of {study.cases} cases")
    data = xr.concat(parts, dim="case", combine_attrs="override")
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="random gripper paths, each assessed twice", config=config)

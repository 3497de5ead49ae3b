# First: it settles how many threads the numerical libraries take.
from _run import config_of, logged  # isort: skip
from _pool import in_parts

from stripfold import store
from studies import random_paths

with logged(snakemake) as say:
    study = snakemake.params
    given = (study.seed, study.refinement)
    data = in_parts(random_paths.run, study.cases, 5, *given, threads=snakemake.threads, say=say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="random gripper paths, each assessed twice", config=config)

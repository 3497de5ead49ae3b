# First: it settles how many threads the numerical libraries take.
from _run import config_of, logged  # isort: skip
from _pool import in_parts

from stripfold import store
from studies import branches

with logged(snakemake) as say:
    study = snakemake.params
    given = (study.seed, study.refinement, study.eta_m)
    data = in_parts(branches.run, study.cases, 50, *given, threads=snakemake.threads, say=say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="random strips on the solid against the elastica", config=config)

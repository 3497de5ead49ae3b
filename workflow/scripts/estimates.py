# First: it settles how many threads the numerical libraries take.
from _run import config_of, logged  # isort: skip
from _pool import in_parts

from stripfold import store
from studies import estimates

with logged(snakemake) as say:
    study = snakemake.params
    data = in_parts(estimates.run, study.cases, 5, study.seed, threads=snakemake.threads, say=say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="true errors of lambda_c against their estimates", config=config)

from _run import config_of, logged

from stripfold import store
from studies import profiling

with logged(snakemake):
    data = profiling.run(**dict(snakemake.params.items()))
    title = "where the time of one lambda_c of the solid and of one R-path on the rod goes"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

from _run import config_of, logged

from stripfold import store
from studies import limit

with logged(snakemake):
    data = limit.run(**dict(snakemake.params.items()))
    store.write(
        data,
        snakemake.output[0],
        title="the solid against the elastica as eta_m goes to zero",
        config=config_of(snakemake),
    )

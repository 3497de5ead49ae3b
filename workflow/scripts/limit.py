from _run import logged
from stripfold import store
from stripfold.studies import limit

with logged(snakemake):
    config = snakemake.params.config
    data = limit.run(**config["studies"]["limit"])
    store.write(data, snakemake.output[0], title="the solid against the elastica as eta_m goes to zero", config=config)

from _run import config_of, logged

from stripfold import store
from studies import recordings

with logged(snakemake):
    measured = [store.read(path) for path in snakemake.input]
    data = recordings.table(measured, snakemake.params.names, snakemake.params.materials)
    store.write(data, snakemake.output[0], title="lambda measured in recordings", config=config_of(snakemake))

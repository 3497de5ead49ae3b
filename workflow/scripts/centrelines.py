from pathlib import Path

from _run import config_of, logged

from stripfold import store
from studies import centrelines

with logged(snakemake) as say:
    data = centrelines.run(Path(snakemake.params.images), say)
    store.write(data, snakemake.output[0], title="centrelines in photographs", config=config_of(snakemake))

from _run import config_of, logged

from stripfold import store
from studies import peers

with logged(snakemake) as say:
    data = peers.run(**dict(snakemake.params.items()), progress=say)
    store.write(data, snakemake.output[0], title="other programs on the same strip", config=config_of(snakemake))

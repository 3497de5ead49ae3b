from _run import config_of, logged

from stripfold import store
from studies import modes

with logged(snakemake):
    data = modes.run(**dict(snakemake.params.items()))
    store.write(
        data,
        snakemake.output[0],
        title="frequencies of a clamped strip against the beam's",
        config=config_of(snakemake),
    )

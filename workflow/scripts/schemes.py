from _run import config_of, logged

from stripfold import store
from studies import schemes

with logged(snakemake):
    data = schemes.run(**dict(snakemake.params.items()))
    store.write(
        data,
        snakemake.output[0],
        title="time integration schemes: order, drift of energy, cost",
        config=config_of(snakemake),
    )

from _run import config_of, logged

from stripfold import store
from studies import lag

with logged(snakemake):
    data = lag.run(**dict(snakemake.params.items()))
    store.write(
        data,
        snakemake.output[0],
        title="lag of the snap behind a moving gripper",
        config=config_of(snakemake),
    )

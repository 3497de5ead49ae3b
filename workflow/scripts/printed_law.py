from _run import config_of, logged

from stripfold import store
from studies import printed_law

with logged(snakemake):
    store.write(
        printed_law.run(),
        snakemake.output[0],
        title="the paper's printed law beside St Venant-Kirchhoff",
        config=config_of(snakemake),
    )

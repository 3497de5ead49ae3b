from _run import config_of, logged

from stripfold import store
from studies import order

with logged(snakemake):
    data = order.run(**dict(snakemake.params.items()))
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="observed order of lambda_c in the element size", config=config)

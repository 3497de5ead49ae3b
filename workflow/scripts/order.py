from _run import logged
from stripfold import store
from stripfold.studies import order

with logged(snakemake):
    config = snakemake.params.config
    data = order.run(**config["studies"]["order"])
    store.write(data, snakemake.output[0], title="observed order of lambda_c in the element size", config=config)

from _run import logged
from stripfold import store
from stripfold.studies import benchmark

with logged(snakemake):
    config = snakemake.params.config
    data = benchmark.run(**config["studies"]["benchmark"])
    store.write(data, snakemake.output[0], title="time and memory of one lambda_c of the solid", config=config)

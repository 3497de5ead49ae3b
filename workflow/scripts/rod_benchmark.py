from _run import config_of, logged

from stripfold import store
from studies import benchmark

with logged(snakemake):
    data = benchmark.run_rod(snakemake.params.repeats, snakemake.params.length)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="time of one lambda_c and of one assessment of the rod", config=config)

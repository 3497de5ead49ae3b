from _run import config_of, logged

from stripfold import store
from studies import benchmark

with logged(snakemake):
    data = benchmark.run_fall(snakemake.params.repeats, snakemake.input[0])
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="time and memory of one collapse", config=config)

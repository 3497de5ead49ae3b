from _run import config_of, logged

from stripfold import store
from studies import falls

with logged(snakemake) as say:
    data = falls.run(snakemake.params.base, snakemake.params.cases, say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="hard and easy falls of a strip", config=config)

from _run import config_of, logged

from stripfold import store
from studies import fall_accuracy

with logged(snakemake) as say:
    data = fall_accuracy.run(**dict(snakemake.params.items()), progress=say)
    title = "error of the first touch of a fall against time"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

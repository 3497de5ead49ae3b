from _run import config_of, logged

from stripfold import store
from studies import accuracy

with logged(snakemake) as say:
    data = accuracy.run(**dict(snakemake.params.items()), progress=say)
    title = "error of the end of the advance against time"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

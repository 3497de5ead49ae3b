from _run import config_of, logged

from stripfold import store
from studies import rod

with logged(snakemake) as say:
    data = rod.run(**dict(snakemake.params.items()), progress=say)
    title = "the rod against the solid and the elastica"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

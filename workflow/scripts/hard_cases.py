from _run import config_of, logged

from stripfold import store
from studies.hard_cases import run as hard_cases

with logged(snakemake) as say:
    data = hard_cases.run(**dict(snakemake.params.items()), progress=say)
    title = "hard cases, each against its own judge"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

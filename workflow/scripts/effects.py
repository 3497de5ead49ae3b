from _run import config_of, logged

from stripfold import store
from studies import effects

with logged(snakemake) as say:
    data = effects.run(snakemake.params.scenes, snakemake.params.repeats, say)
    title = "scenes with each effect on and off"
    store.write(data, snakemake.output[0], title=title, config=config_of(snakemake))

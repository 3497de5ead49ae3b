from _run import config_of, logged

from stripfold import store
from studies import friction_steps

with logged(snakemake) as say:
    study = snakemake.params
    data = friction_steps.run(study.length, study.thickness, study.steps, study.refinement, say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="smallest friction against the size of the steps", config=config)

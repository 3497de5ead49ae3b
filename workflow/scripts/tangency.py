from _run import config_of, logged

from stripfold import store
from studies import tangency

with logged(snakemake) as say:
    study = snakemake.params
    data = tangency.run(study.lengths, study.thicknesses, study.refinement, say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="where R-paths meet the stability boundary", config=config)

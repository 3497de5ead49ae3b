from _run import config_of, logged

from configuration import material_of
from stripfold import store
from stripfold.analysis import friction_data

with logged(snakemake) as say:
    study = snakemake.params
    entry, config = study.material, config_of(snakemake)
    data = friction_data.run(material_of(config, entry), entry["length"], study.step, study.refinement, say)
    store.write(data, snakemake.output[0], title=f"R-path with friction, {entry['label']}", config=config)

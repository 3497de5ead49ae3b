from _run import config_of, logged
from stripfold import store
from stripfold.config import material_of
from stripfold.simulation import LettingGo
from stripfold.studies import friction_data
from stripfold.studies.collapse_data import in_solver_units

with logged(snakemake) as say:
    study = snakemake.params
    entry, config = study.material, config_of(snakemake)
    material = material_of(config, entry)
    fall = in_solver_units(LettingGo(), material)
    data = friction_data.two_ways(material, entry["length"], fall, study.refinement, say)
    store.write(data, snakemake.output[0], title=f"two ways out of an R-path, {entry['label']}", config=config)

from _run import config_of, logged

from configuration import material_of
from stripfold import store
from stripfold.analysis import friction_data
from stripfold.analysis.collapse_data import in_solver_units
from stripfold.simulation import LettingGo

with logged(snakemake) as say:
    study = snakemake.params
    entry, config = study.material, config_of(snakemake)
    material = material_of(config, entry)
    fall = in_solver_units(LettingGo(), material)
    data = friction_data.two_ways(material, entry["length"], fall, study.refinement, say)
    store.write(data, snakemake.output[0], title=f"two ways out of an R-path, {entry['label']}", config=config)

from _run import config_of, logged

from configuration import material_of
from stripfold import store
from stripfold.analysis import assess_data
from stripfold.analysis.collapse_data import in_solver_units
from stripfold.simulation import LettingGo

with logged(snakemake) as say:
    study = snakemake.params
    entry, config = study.material, config_of(snakemake)
    material = material_of(config, entry)
    fall = in_solver_units(LettingGo(), material)
    for name, output in zip(study.paths, snakemake.output, strict=True):
        data = assess_data.run(material, entry["length"], name, fall, study.refinement, say)
        store.write(data, output, title=f"{name} path, {entry['label']}", config=config)

from _run import config_of, logged
from stripfold import store
from stripfold.config import material_of
from stripfold.simulation import LettingGo
from stripfold.studies import assess_data
from stripfold.studies.collapse_data import in_solver_units

with logged(snakemake) as say:
    study = snakemake.params
    entry, config = study.material, config_of(snakemake)
    material = material_of(config, entry)
    fall = in_solver_units(LettingGo(), material)
    for name, output in zip(study.paths, snakemake.output, strict=True):
        data = assess_data.run(material, entry["length"], name, fall, study.refinement, say)
        store.write(data, output, title=f"{name} path, {entry['label']}", config=config)

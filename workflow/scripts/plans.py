from _run import config_of, logged

from configuration import material_of
from stripfold import store
from stripfold.analysis import plans

with logged(snakemake):
    entry, config = snakemake.params.material, config_of(snakemake)
    data = plans.dataset(material_of(config, entry), entry["length"])
    store.write(data, snakemake.output[0], title=f"folding paths as planned, {entry['label']}", config=config)

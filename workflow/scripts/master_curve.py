import numpy as np

from _run import logged
from stripfold import elastica, store
from stripfold.studies import combine

with logged(snakemake):
    config = snakemake.params.config
    top = max(height for material in config["materials"] for height in material["heights"])
    heights = np.concatenate([[elastica.touch_limit() + 1e-6], np.arange(1.65, top + 0.25, 0.05)])
    store.write(combine.master_curve(heights), snakemake.output[0], title="the elastica's master curve", config=config)

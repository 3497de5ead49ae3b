import numpy as np
from _run import config_of, logged

from stripfold import elastica, store
from stripfold.analysis import combine

with logged(snakemake):
    heights = np.concatenate([[elastica.touch_limit() + 1e-6], np.arange(1.65, snakemake.params.top + 0.25, 0.05)])
    store.write(
        combine.master_curve(heights),
        snakemake.output[0],
        title="the elastica's master curve",
        config=config_of(snakemake),
    )

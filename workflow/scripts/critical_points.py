from _run import config_of, logged

from stripfold import store
from stripfold.analysis import combine

with logged(snakemake):
    labels = snakemake.params.labels
    runs = {name: store.read(path) for name, path in zip(labels, snakemake.input, strict=True)}
    data = combine.critical_points(runs, labels)
    store.write(data, snakemake.output[0], title="critical points of all materials", config=config_of(snakemake))

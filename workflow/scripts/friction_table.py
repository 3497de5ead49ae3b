from _run import config_of, logged

from stripfold import store
from stripfold.analysis import friction_data

with logged(snakemake):
    labels = snakemake.params.labels
    files = {name: store.read(path) for name, path in zip(labels, snakemake.input.runs, strict=True)}
    ways = {name: store.read(path) for name, path in zip(labels, snakemake.input.ways, strict=True)}
    data = friction_data.table(files, ways, labels)
    store.write(data, snakemake.output[0], title="friction that an R-path needs", config=config_of(snakemake))

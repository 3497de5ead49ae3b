from itertools import product

from _run import config_of, logged

from stripfold import store
from stripfold.analysis import assess_data

with logged(snakemake):
    study = snakemake.params
    names = product(study.labels, study.paths)
    files = {name: store.read(path) for name, path in zip(names, snakemake.input, strict=True)}
    data = assess_data.table(files, study.labels)
    store.write(data, snakemake.output[0], title="folding paths assessed", config=config_of(snakemake))

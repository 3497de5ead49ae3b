from _run import logged

from stripfold import store
from stripfold.plots.film import film

with logged(snakemake):
    film(store.read(snakemake.input[0]), snakemake.output[0])

from importlib import import_module

from _run import logged
from stripfold import store
from stripfold.plots.save import save

with logged(snakemake):
    data = [store.read(path) for path in snakemake.input]
    figure = import_module(f"stripfold.plots.{snakemake.wildcards.name}").draw(*data, **snakemake.params.options)
    save(figure, snakemake.output.png.removesuffix(".png"))

from importlib import import_module
from importlib.util import find_spec

from _run import logged

from stripfold import store
from stripfold.plots.save import save

with logged(snakemake):
    data = [store.read(path) for path in snakemake.input]
    name = snakemake.wildcards.name
    package = "studies.plots" if find_spec(f"studies.plots.{name}") else "stripfold.plots"
    figure = import_module(f"{package}.{name}").draw(*data, **snakemake.params.options)
    save(figure, snakemake.output.png.removesuffix(".png"))

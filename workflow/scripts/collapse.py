from _run import logged

from stripfold import simulation, store
from stripfold.analysis import collapse_data

with logged(snakemake) as say:
    asked = simulation.read(snakemake.input[0])
    data = collapse_data.run(asked, say)
    store.write(data, snakemake.output[0], title="a strip through its collapse", config=asked.as_config())

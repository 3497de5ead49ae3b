from pathlib import Path

from _run import config_of, logged

from stripfold import store
from studies import calibration

with logged(snakemake) as say:
    data = calibration.run(Path(snakemake.params.images), say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="calibration on public pictures of boards", config=config)

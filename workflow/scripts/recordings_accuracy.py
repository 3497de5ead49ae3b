# First: it settles how many threads the numerical libraries take.
from _run import config_of, logged  # isort: skip
from pathlib import Path
from tempfile import TemporaryDirectory

from _pool import in_parts

from stripfold import store
from studies import recordings_accuracy
from studies import recordings_design as design

with logged(snakemake) as say, TemporaryDirectory() as folder:
    study = snakemake.params
    given = (study.seed, study.dynamics, Path(folder))
    # Before the processes start: two of them would render the same calibration.
    cases = (recordings_accuracy.case(number, study.seed, study.dynamics) for number in range(study.cases))
    design.write_calibrations(cases, Path(folder))
    data = in_parts(recordings_accuracy.run, study.cases, 5, *given, threads=snakemake.threads, say=say)
    config = config_of(snakemake)
    store.write(data, snakemake.output[0], title="synthetic recordings measured, each with its truth", config=config)

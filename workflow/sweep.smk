# A sweep of `stripfold sweep` with a job for each chunk, for a cluster: docs/sweep.md.
import os
from pathlib import Path

# As in the command: with more threads in BLAS the last digit is another. Before anything imports it.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

from snakemake.exceptions import WorkflowError
from stripfold import sweep
from stripfold.errors import StripfoldError
from stripfold.validation import read_yaml

FILE = Path(config.get("output", "sweep.nc"))
try:
    GIVEN = read_yaml(config.get("grid", "grid.yaml"), "grid", "length: 0.6")
    GRID = sweep.Grid.of(GIVEN)
    CHUNKS = sweep.chunk_files(GRID, FILE)
except StripfoldError as error:
    raise WorkflowError(str(error)) from None


rule gather:
    """The results of all chunks in one file."""
    input:
        list(CHUNKS),
    output:
        FILE,
    run:
        sweep.run(GIVEN, output[0], cores=1)


rule chunk:
    """The critical points of one chunk of the grid."""
    output:
        f"{FILE}.parts/{{part}}.nc",
    run:
        part = Path(output[0])
        sweep.solve(GRID, CHUNKS[part], part)

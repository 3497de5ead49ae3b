# A sweep of `stripfold sweep` with a job for each chunk, for a cluster: docs/sweep.md.
import os
from pathlib import Path

# As in the command: with more threads in BLAS the last digit is another. Before anything imports it.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

from snakemake.exceptions import WorkflowError
from stripfold import sweep
from stripfold.base.errors import InvalidInputError, StripfoldError
from stripfold.base.validation import read_yaml

# Of a name that is a number Snakemake makes one.
SOURCE, FILE = (
    Path(str(config.get(key, name))) for key, name in {"grid": "grid.yaml", "output": "sweep.nc"}.items()
)
try:
    GIVEN = read_yaml(SOURCE, "grid", "length: 0.6")
    if FILE.suffix != ".nc" or set("{}") & set(str(FILE)) or (FILE.exists() and FILE.samefile(SOURCE)):
        allowed = (
            "another file than the grid, that ends in .nc, without braces: to Snakemake they are wildcards"
        )
        raise InvalidInputError("output", str(FILE), allowed)
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
        with sweep.owned(FILE, shared=True):
            sweep.solve(GRID, CHUNKS[part], part)

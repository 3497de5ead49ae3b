"""What every script of the workflow shares: messages to the rule's log, one clear line on an expected error."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

# One core per process: Snakemake tells the numerical libraries to use all of the rule's threads, which on systems as
# small as these wait for each other, and count double in the processor time. Before anything imports them.
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

# The studies beside these scripts, here and in processes that a study starts.
WORKFLOW = str(Path(__file__).parents[1])
sys.path.insert(0, WORKFLOW)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (WORKFLOW, os.environ.get("PYTHONPATH"))))

from configuration import Config, load
from stripfold.errors import StripfoldError
from stripfold.store import running_commit


@contextmanager
def logged(snakemake: Any) -> Iterator[Callable[[str], None]]:
    """A function that writes a line to the rule's log; an error of ours ends the job with its message."""
    # Of the code that runs: on a long job the checkout may have moved on before its result is stored.
    running_commit()
    with open(snakemake.log[0], "w", encoding="utf-8") as log:

        def say(line: str) -> None:
            print(line, file=log, flush=True)

        try:
            yield say
        except StripfoldError as error:
            say(f"error: {error}")
            print(f"{snakemake.rule}: {error}", file=sys.stderr)
            sys.exit(error.exit_code)


def config_of(snakemake: Any) -> Config:
    """The whole resolved configuration, to be stored with a result.

    A rule's ``params`` hold only what its result depends on: a change elsewhere does not make Snakemake redo it.
    """
    return load(snakemake.config)

"""Check stored files by the CF and ACDD conventions: what the program compliance-checker says of each.

``python workflow/conventions.py FILE.nc ...`` prints it and fails where a file has an error.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import xarray as xr

from stripfold.base.errors import InvalidInputError
from studies.common import dataset, pooled

CF, ACDD = "cf:1.11", "acdd:1.3"
HIGH = 3
"""The checker's weight of what is required; of ACDD only this is counted, and of CF everything."""
NOT_OURS = ("standard_name", "coverage_content_type")
"""Recommended by ACDD of each variable: names of quantities of the earth's sciences, of which these files have none."""


def of_file(path: str | Path) -> tuple[list[str], list[str]]:
    """Errors by CF and omissions by ACDD of a netCDF file, in the checker's words.

    A check of CF that ends in an exception is an error, too: the file is not known to pass.

    Raises InvalidInputError: the file cannot be read.
    """
    from compliance_checker.runner import CheckSuite

    if not CheckSuite.checkers:
        CheckSuite.load_all_available_checkers()
    suite = CheckSuite()
    try:
        opened = suite.load_dataset(str(path))
    except (OSError, ValueError) as error:
        raise InvalidInputError("file", str(path), "a netCDF file", f"delete it, and make it anew ({error})") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the checker's own
            found = suite.run_all(opened, [CF, ACDD], [])
    finally:
        opened.close()
    errors = sorted({message for result in found[CF][0] for message in _failed(result)})
    errors += [f"{check} ends in {error!r}" for check, (error, _) in found[CF][1].items()]
    omitted = {m for result in found[ACDD][0] if result.weight == HIGH for m in _failed(result)}
    return errors, sorted(m for m in omitted if not m.startswith(NOT_OURS))


def _failed(result: Any) -> list[str]:
    """Messages of a result; those of a check that is passed only say what was looked at."""
    value = result.value
    passed = value[0] == value[1] if isinstance(value, tuple) else bool(value)
    return [] if passed else [str(message) for message in result.msgs]


def run(paths: Sequence[str], threads: int = 1, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """Check files.

    ``paths``: the files.

    Dataset over ``file``: ``cf_errors`` and ``acdd_omissions`` are numbers, ``messages`` what they say.
    """
    found = pooled(of_file, paths, threads)
    for path, (errors, omitted) in zip(paths, found, strict=True):
        for message in (*errors, *omitted):
            if progress:
                progress(f"{path}: {message}")
    values = {
        "file": ("file", [Path(path).stem for path in paths]),
        "cf_errors": ("file", [len(errors) for errors, _ in found]),
        "acdd_omissions": ("file", [len(omitted) for _, omitted in found]),
        "messages": ("file", ["; ".join([*errors, *omitted]) for errors, omitted in found]),
    }
    return dataset("conventions", values)


if __name__ == "__main__":
    checked = run(sys.argv[1:], progress=partial(print, flush=True))
    sys.exit(int(checked["cf_errors"].sum()) > 0)

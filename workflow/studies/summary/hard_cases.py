"""The numbers quoted about the hard cases."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from studies.summary.entry import Entry, entry

FEWEST = 25


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``hard_cases``, read from the file ``sources`` names."""
    cases, source = data["hard_cases"], sources["hard_cases"]
    count = cases.sizes["case"]
    # So written, nan counts as failed.
    failed = int(np.sum(~(cases["failed"].values == 0.0)))
    errors = int(np.sum(cases["outcome"].values != "value"))
    return {
        "hard_cases": entry(
            count,
            "count",
            f"hard cases of the solver, docs/hard-cases.md; {count - errors} end in a value that an independent way "
            f"judges, {errors} in a typed error",
            f">= {FEWEST}",
            count >= FEWEST,
            source,
        ),
        "hard_cases_failed": entry(
            failed,
            "count",
            "of these, ended in a value that is wrong or in an error that is",
            "0",
            failed == 0,
            source,
        ),
    }

"""The hard cases: what a solver gets wrong first, each with its own judge.

Every case ends in a value that an independent way confirms, or in the typed error that is right.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from studies.hard_cases import (
    contact as hard_contact,
)
from studies.hard_cases import (
    critical as hard_critical,
)
from studies.hard_cases import (
    meshes as hard_meshes,
)
from studies.hard_cases import (
    starts as hard_starts,
)
from studies.hard_cases import (
    strips as hard_strips,
)
from studies.hard_cases.case import Case, judge, shown

CASES: tuple[Case, ...] = (
    *hard_strips.CASES,
    *hard_meshes.CASES,
    *hard_starts.CASES,
    *hard_critical.CASES,
    *hard_contact.CASES,
)

VARIABLES = {
    "name": ("1", "name of the case"),
    "theme": ("1", "what is hard"),
    "judged": ("1", "what the value is, and against what it is judged"),
    "value": ("1", "value found, lengths in L*; nan where an error was raised"),
    "reference": ("1", "what it should be"),
    "error": ("1", "distance of both"),
    "allowed": ("1", "largest distance allowed"),
    "iterations": ("1", "Newton iterations of the points on the way, or those before the error"),
    "outcome": ("1", "value, or the type of the error"),
    "failed": ("1", "1 where the case fails"),
    "message": ("1", "what the error says"),
    "seconds": ("s", "time taken"),
}


def run(refinement: float, progress: Callable[[str], None] | None = None) -> xr.Dataset:
    """All cases.

    Parameters
    ----------
    refinement
        Factor on all element lengths.

    Returns
    -------
    Dataset over ``case``.
    """
    rows: list[dict[str, Any]] = []
    for case in CASES:
        rows.append(judge(case, refinement))
        if progress:
            progress(shown(rows[-1]))
    return dataset(rows, refinement)


def dataset(rows: list[dict[str, Any]], refinement: float) -> xr.Dataset:
    """Rows of :func:`.hard_case.judge` over ``case``."""
    data = {}
    for name, (units, text) in VARIABLES.items():
        values = [row[name] for row in rows]
        array = np.array(values, dtype=object if isinstance(values[0], str) else np.float64)
        data[name] = ("case", array, {"units": units, "long_name": text})
    return xr.Dataset(data, attrs={"refinement": refinement})


def markdown(data: xr.Dataset) -> str:
    """The cases as a table."""
    lines = ["| theme | case | judged | outcome | off by | allowed | iterations | s | holds |", "|---" * 9 + "|"]
    for i in range(data.sizes["case"]):
        row = {name: data[name].values[i] for name in VARIABLES}
        valued = row["outcome"] == "value"
        what = f"{row['value']:.6g}" if valued else f"`{row['outcome']}`"
        off, allowed = (f"{row['error']:.1e}", f"{row['allowed']:.1e}") if valued else ("", "")
        cells = (row["theme"], row["name"], row["judged"], what, off, allowed, f"{row['iterations']:.0f}")
        lines.append("| " + " | ".join((*cells, f"{row['seconds']:.1f}", "no" if row["failed"] else "yes")) + " |")
    return "\n".join(lines) + "\n"

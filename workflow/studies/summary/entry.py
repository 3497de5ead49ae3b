"""One quoted number: its value, what it is, and the criterion it has to meet."""

from __future__ import annotations

from typing import Any

import numpy as np

Entry = dict[str, Any]


def entry(
    value: float, unit: str, statement: str, criterion: str, holds: bool | np.bool_, source: str, digits: int = 4
) -> Entry:
    """One number: ``holds`` says whether it meets its ``criterion``, ``source`` which stored file it is from."""
    rounded = float(f"{float(value):.{digits}g}")
    return {
        "value": int(rounded) if unit == "count" else rounded,
        "unit": unit,
        "statement": statement,
        "criterion": criterion,
        "holds": bool(holds),
        "source": source,
    }


def markers(name: str) -> tuple[str, str]:
    """The lines of a text between which its table ``name`` stands."""
    return f"<!-- {name}: made by `snakemake readme` -->\n", f"<!-- end of {name} -->\n"


def fill_table(text: str, name: str, table: str) -> str:
    """A text with its table ``name`` made anew."""
    begin, end = markers(name)
    head, rest = text.split(begin)
    return head + begin + table + end + rest.split(end)[1]

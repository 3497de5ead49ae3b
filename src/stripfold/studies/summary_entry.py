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


def between(text: str, marks: tuple[str, str], table: str) -> str:
    """A text whose part between two marks is made anew."""
    head, rest = text.split(marks[0])
    return head + marks[0] + table + marks[1] + rest.split(marks[1])[1]

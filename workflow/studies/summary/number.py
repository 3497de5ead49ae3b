"""What an entry of the table of numbers says: what a number is, where it is from, and the criterion it has to meet.

Keys, statements and criteria are templates of the facts about the source (:mod:`.facts`), in which ``d`` is the dataset
itself.  A criterion that begins with a bound, like ``< 1e-3``, bounds the value; ``also`` judges whatever else it says.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import NamedTuple

from studies.summary.facts import Facts


class Number(NamedTuple):
    """A number, or one for each of its source's facts where there are several; the unit "count" makes it an integer."""

    key: str
    value: str
    unit: str
    digits: int
    criterion: str
    statement: str
    also: Callable[[SimpleNamespace], bool] = lambda f: True
    error: str = ""
    """The fact that is the value's error, in the same unit, where one is known."""


class Source(NamedTuple):
    """Names of the datasets, separated by spaces, the first of which is quoted; the facts about them; the numbers."""

    names: str
    facts: Callable[..., Facts | list[Facts]]
    numbers: tuple[Number, ...]

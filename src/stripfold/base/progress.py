"""Progress: phases of a strip that is followed, and shares done in per cent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from math import floor
from typing import TypeVar

T = TypeVar("T")

BEFORE, FALL, AFTER = PHASES = "before", "fall", "after"
"""Phases of a strip that is followed, as in a collapse's dataset: statics, a fall, statics from rest on."""
SLOW = "slow"
"""The phase of a strip that is followed in time, with a slow gripper."""


class Percent:
    """Says how much of a part is done, each whole per cent once.

    ``progress``: called with a line; None says nothing.  ``what``: what is being done.

    Examples
    --------
    >>> list(Percent(print, "drawing").each("abc", 3))
    drawing: 0 %
    drawing: 33 %
    drawing: 66 %
    ['a', 'b', 'c']
    """

    def __init__(self, progress: Callable[[str], None] | None, what: str) -> None:
        self.progress, self.what, self.last = progress, what, -1

    def __call__(self, share: float) -> None:
        """Say it where a further per cent is done; ``share`` is from 0 to 1."""
        whole = floor(100.0 * share + 1e-9)
        if self.progress is not None and whole > self.last:
            self.last = whole
            self.progress(f"{self.what}: {whole} %")

    def each(self, items: Iterable[T], count: int) -> Iterator[T]:
        """The items, of which there are ``count``; before each it says how many are done."""
        for done, item in enumerate(items):
            self(done / count)
            yield item

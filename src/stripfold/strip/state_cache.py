"""Results for the last states, kept for further calls."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from stripfold.base.arrays import Array

T = TypeVar("T")

CACHE_SIZE = 2
"""Newton's method evaluates a state several times, a time step its two ends and a guess of the second in between."""


class StateCache(Generic[T]):
    """A function of a state that keeps the :data:`CACHE_SIZE` results used last, which must not be changed in place."""

    def __init__(self, compute: Callable[[Array], T]) -> None:
        self._compute = compute
        self._known: deque[tuple[Array, T]] = deque(maxlen=CACHE_SIZE)

    def __call__(self, q: Array) -> T:
        """The result for ``q``, compared by value."""
        for i, entry in enumerate(self._known):
            if np.array_equal(entry[0], q):
                del self._known[i]
                break
        else:
            entry = q.copy(), self._compute(q)
        self._known.append(entry)
        return entry[1]

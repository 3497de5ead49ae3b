"""Results for the last states, kept for further calls."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from stripfold.arrays import Array

T = TypeVar("T")

CACHE_SIZE = 2
"""Newton's method evaluates a state several times, a time step its two ends."""


class StateCache(Generic[T]):
    """A function of a state that keeps its last :data:`CACHE_SIZE` results, which must not be changed in place."""

    def __init__(self, compute: Callable[[Array], T]) -> None:
        self._compute = compute
        self._known: deque[tuple[Array, T]] = deque(maxlen=CACHE_SIZE)

    def __call__(self, q: Array) -> T:
        """The result for ``q``, compared by value."""
        for known, result in self._known:
            if np.array_equal(known, q):
                return result
        result = self._compute(q)
        self._known.append((q.copy(), result))
        return result

"""What was computed for the last few states, for whoever asks again."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np

from stripfold.arrays import Array

T = TypeVar("T")

CACHE_SIZE = 2
"""Newton's method asks for the same state several times, a time step for its two ends."""


class StateCache(Generic[T]):
    """A function of a state that remembers its last :data:`CACHE_SIZE` results, which nobody may change in place."""

    def __init__(self, compute: Callable[[Array], T]) -> None:
        self._compute = compute
        self._known: deque[tuple[Array, T]] = deque(maxlen=CACHE_SIZE)

    def __call__(self, q: Array) -> T:
        """The result for ``q``, which is compared by value: an array changed in place is another state."""
        for known, result in self._known:
            if np.array_equal(known, q):
                return result
        result = self._compute(q)
        self._known.append((q.copy(), result))
        return result

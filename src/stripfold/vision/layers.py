"""Which layer of a folded strip a place in a picture belongs to."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from stripfold.arrays import Array, Mask


class Layers:
    """The layers of a curve, (n, 2): what is more than ``near`` places away along it is another one."""

    def __init__(self, curve: Array, near: int) -> None:
        n = len(curve)
        # Too far to be the nearest, where it is not another layer. One row of numbers, of which each place has a part.
        away = np.abs(np.arange(1 - n, n))
        self._same = sliding_window_view(np.where(away > near, 0.0, np.inf), n)[::-1]
        self._curve = curve
        self._apart = np.sqrt(np.maximum(self._squared(curve, curve, slice(None)), 0.0))

    def own(self, places: Array, curve: Array) -> Mask:
        """Which places are nearer to their own part of a curve next to the first one than to another layer of it."""
        off = np.hypot(*(places - curve).T)
        # Most are far from any other layer, however the curve moved: only the rest is compared with all of it.
        moved = np.hypot(*(curve - self._curve).T)
        own = self._apart - moved - moved.max() > 2.0 * off
        close = np.flatnonzero(~own)
        if close.size:
            own[close] = self._squared(places[close], curve, close) > off[close] ** 2
        return np.asarray(own)

    def _squared(self, places: Array, curve: Array, rows: slice | NDArray[np.intp]) -> Array:
        """Squares of the distances of ``rows`` of the places from the nearest place of another layer."""
        # By one product, less the places' own: this is done for all pairs.
        ones = np.ones(len(places))
        apart = np.column_stack([places, ones]) @ np.stack([*(-2.0 * curve.T), np.sum(curve**2, axis=1)])
        apart += self._same[rows]
        return np.asarray(apart.min(axis=1) + np.sum(places**2, axis=1))

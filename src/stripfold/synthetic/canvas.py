"""A grey picture on which polygons are drawn, each pixel by the exact share that they cover.

A side of a polygon covers, in each row of pixels that it crosses, what is to its right; the sides together leave what
is between them.  They are cut where they cross rows and columns, their shares added up in the pixels that they cross,
and the sums accumulated along the rows.
"""

from __future__ import annotations

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array
from stripfold.synthetic.view import Light


class Canvas:
    """A picture to draw on, shape (height, width), 255 for white; pixel centres are at integers."""

    def __init__(self, background: Light) -> None:
        self._background, self._rows = background, (0, len(background))
        self.picture = background.copy()

    def clear(self, rows: tuple[int, int] | None = None) -> None:
        """Begin with the background; only these rows, first and end, are drawn from now on."""
        self._rows = rows or (0, len(self._background))
        self.picture[slice(*self._rows)] = self._background[slice(*self._rows)]

    def polygons(self, *layers: tuple[Array, float]) -> None:
        """Draw polygons, shape (n, k, 2), pixels, in a grey from 0 to 1; further layers lie within the ones before."""
        starts, ends = [], []
        weights: list[Array] = []
        below = 0.0
        for corners, grey in layers:
            following = np.roll(corners, -1, axis=1)
            area = np.sum(corners[..., 0] * following[..., 1] - following[..., 0] * corners[..., 1], axis=1)
            sign = np.repeat(-np.sign(area), corners.shape[1])
            starts.append(corners.reshape(-1, 2))
            ends.append(following.reshape(-1, 2))
            weights.append(np.stack([0.0 * sign if len(weights) else sign, (grey - below) * sign]))
            below = grey
        self._draw(np.concatenate(starts), np.concatenate(ends), np.concatenate(weights, axis=1), 1.0)

    def ribbon(self, one: Array, other: Array, greys: Array | float, alpha: float = 1.0) -> None:
        """Draw what is between two lines, shape (n, 2), pixels: pieces of a grey each, (n - 1,), without seams."""
        low, high = np.minimum(one, other), np.maximum(one, other)
        low, high = np.minimum(low[:-1], low[1:]), np.maximum(high[:-1], high[1:])
        least, most = [-0.5, self._rows[0] - 0.5], [self.picture.shape[1] - 0.5, self._rows[1] - 0.5]
        (a, b), (c, d) = (other[1:] - one[:-1]).T, (other[:-1] - one[1:]).T
        sign = np.where(np.all((high > least) & (low < most), axis=1), np.sign(b * c - a * d), 0.0)
        weights = np.stack([sign, sign * greys])
        # Two pieces share the side between them: only what differs is drawn there.
        between = -np.diff(weights, prepend=0.0, append=0.0)
        start, end = np.concatenate([one[:-1], other[1:], one]), np.concatenate([one[1:], other[:-1], other])
        self._draw(start, end, np.concatenate([weights, weights, between], axis=1), alpha)

    def _draw(self, start: Array, end: Array, weights: Array, alpha: float) -> None:
        """Draw what is inside of directed lines, shape (n, 2), that form closed polygons.

        ``weights``, shape (2, n): what they add to the covered share of the pixels to their right, and to this share
        times its grey.
        """
        kernels.coverage.draw(self.picture, *self._rows, start, end, weights, alpha)

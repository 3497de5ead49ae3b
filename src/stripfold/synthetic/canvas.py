"""A grey picture on which polygons are drawn, each pixel by the exact share that they cover.

A side of a polygon covers, in each row of pixels that it crosses, what is to its right; the sides together leave what
is between them.  They are cut where they cross rows and columns, their shares added up in the pixels that they cross,
and the sums accumulated along the rows.
"""

from __future__ import annotations

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.synthetic.view import Light

_LEAST = 1e-6
"""Share of a pixel below which it is not covered."""


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
        starts, ends, weights, below = [], [], [], 0.0
        for corners, grey in layers:
            following = np.roll(corners, -1, axis=1)
            area = np.sum(corners[..., 0] * following[..., 1] - following[..., 0] * corners[..., 1], axis=1)
            starts.append(corners.reshape(-1, 2))
            ends.append(following.reshape(-1, 2))
            sign = np.repeat(-np.sign(area), corners.shape[1])
            weights.append(np.stack([0.0 * sign if weights else sign, (grey - below) * sign]))
            below = grey
        self._draw(np.concatenate(starts), np.concatenate(ends), np.concatenate(weights, axis=1), 1.0)

    def ribbon(self, one: Array, other: Array, greys: Array | float, alpha: float = 1.0) -> None:
        """Draw what is between two lines, shape (n, 2) each, in pieces of a grey each, shape (n - 1,), without seams."""
        low, high = np.minimum(one, other), np.maximum(one, other)
        low, high = np.minimum(low[:-1], low[1:]), np.maximum(high[:-1], high[1:])
        first, end = [-0.5, self._rows[0] - 0.5], [self.picture.shape[1] - 0.5, self._rows[1] - 0.5]
        (a, b), (c, d) = (other[1:] - one[:-1]).T, (other[:-1] - one[1:]).T
        sign = np.where(np.all((high > first) & (low < end), axis=1), np.sign(b * c - a * d), 0.0)
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
        used = np.any(weights != 0.0, axis=0)
        if not used.any():
            return
        start, end, weights = start[used] + 0.5, end[used] + 0.5, weights[:, used]
        low, high = np.minimum(start, end).min(axis=0), np.maximum(start, end).max(axis=0)
        left, top = np.maximum(np.floor(low), [0, self._rows[0]]).astype(int)
        right, bottom = np.minimum(np.ceil(high), [self.picture.shape[1], self._rows[1]]).astype(int)
        width, height = right - left, bottom - top
        if width <= 0 or height <= 0:
            return
        # Cut at rows, then at columns.
        of, first, last = _cut(start[:, 1] - top, end[:, 1] - top)
        begin, step = start[of], (end - start)[of]
        y, dy = begin[:, 1] - top + 0.5 * (first + last) * step[:, 1], (last - first) * step[:, 1]
        inside = (y > 0.0) & (y < height) & (dy != 0.0)
        y, dy, of, x, dx = (values[inside] for values in (y, dy, of, begin[:, 0] - left, step[:, 0]))
        x, far = x + first[inside] * dx, x + last[inside] * dx
        piece, first, last = _cut(x, far)
        place = np.maximum(x[piece] + 0.5 * (first + last) * (far - x)[piece], 0.0)
        inside = place < width
        place, piece, share = place[inside], piece[inside], (last - first)[inside]
        column = place.astype(np.intp)
        at = y[piece].astype(np.intp) * (width + 1) + column
        ahead = place - column
        values = weights[:, of[piece]] * (share * dy[piece])
        size = height * (width + 1)
        at = np.concatenate([at, at + 1, at + size, at + size + 1])
        values = np.stack([(1.0 - ahead) * values, ahead * values], axis=1)
        sums = np.bincount(at, values.ravel(), 2 * size).reshape(2, height, width + 1)
        covered, light = sums.cumsum(axis=2)[..., :width]
        rows, columns = np.nonzero(covered > _LEAST)
        share = covered[rows, columns]
        grey = 255.0 * light[rows, columns] / share
        below = self.picture[top + rows, left + columns]
        self.picture[top + rows, left + columns] = below + alpha * np.minimum(share, 1.0) * (grey - below)


def _cut(a: Array, b: Array) -> tuple[Index, Array, Array]:
    """Lines from a to b, shape (n,), cut at whole numbers: the line of each piece, and where on it it starts and ends."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    high = np.where(high - low < _LEAST, low, high)
    floor = np.floor(low)
    count = np.maximum(np.ceil(high) - floor, 1.0).astype(np.intp)
    of = np.repeat(np.arange(len(a)), count)
    level = floor[of] + np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    low, high = low[of], high[of]
    length = np.maximum(high - low, _LEAST)
    one = (np.maximum(level, low) - low) / length
    other = np.where(high > low, (np.minimum(level + 1.0, high) - low) / length, 1.0)
    down = (b < a)[of]
    return of, np.where(down, 1.0 - other, one), np.where(down, 1.0 - one, other)

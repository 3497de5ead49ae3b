"""A grey picture on which polygons are drawn, each pixel by the exact share that they cover.

A side of a polygon covers, in each row of pixels that it crosses, what is to its right; the sides together leave what
is between them.  They are cut where they cross rows and columns, their shares added up in the pixels that they cross,
and the sums accumulated along the rows.
"""

from __future__ import annotations

import cv2
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
        used = np.flatnonzero((weights != 0.0).any(axis=0))
        if not len(used):
            return
        x, y, to_x, to_y = (0.5 + values[used] for values in (*start.T, *end.T))
        weights = weights.take(used, axis=1)
        first_row, end_row = self._rows
        columns = self.picture.shape[1]
        left, right = max(int(min(x.min(), to_x.min())), 0), min(int(max(x.max(), to_x.max())) + 1, columns)
        top, bottom = max(int(min(y.min(), to_y.min())), first_row), min(int(max(y.max(), to_y.max())) + 1, end_row)
        width, height = right - left, bottom - top
        if width <= 0 or height <= 0:
            return
        # Cut at rows, then at columns.
        x, to_x, y, to_y = x - left, to_x - left, y - top, to_y - top
        of, first, last = _cut(y, to_y, (0.0, height))
        dx, dy = (to_x - x)[of], (to_y - y)[of]
        row, dy = y[of] + 0.5 * (first + last) * dy, (last - first) * dy
        x, to_x = x[of] + first * dx, x[of] + last * dx
        inside = np.flatnonzero((row > 0.0) & (row < height))
        row, dy, of, x, to_x = row[inside], dy[inside], of[inside], x[inside], to_x[inside]
        piece, first, last = _cut(x, to_x)
        place = np.maximum(x[piece] + 0.5 * (first + last) * (to_x - x)[piece], 0.0)
        inside = np.flatnonzero(place < width)
        if not len(inside):
            return
        place, piece, share = place[inside], piece[inside], (last - first)[inside]
        column = place.astype(np.intp)
        at = row.astype(np.intp)[piece] * (width + 1) + column
        values = weights.take(of[piece], axis=1) * (share * dy[piece])
        ahead = values * (place - column)
        # Covered share and light of a pixel side by side, as a picture of two channels.
        at = np.concatenate([2 * at, 2 * at + 1, 2 * at + 2, 2 * at + 3])
        sums = np.bincount(at, np.concatenate([values - ahead, ahead]).ravel(), 2 * height * (width + 1))
        # Summed along rows and columns: faster than NumPy does it along the rows alone.
        above = cv2.integral(sums.reshape(height, width + 1, 2))[:, 1:-1]
        covered = above[1:, :, 0] - above[:-1, :, 0]
        inside = np.flatnonzero(covered > _LEAST)
        row, column = np.divmod(inside, width)
        share, light = covered.ravel()[inside], above[row + 1, column, 1] - above[row, column, 1]
        flat, inside = self.picture.reshape(-1), (row + top) * columns + column + left
        below = flat[inside]
        flat[inside] = below + alpha * np.minimum(share, 1.0) * (255.0 * light / share - below)


def _cut(a: Array, b: Array, limits: tuple[float, float] = (-np.inf, np.inf)) -> tuple[Index, Array, Array]:
    """Lines from a to b, shape (n,), cut at whole numbers: the line of each piece, and where on it it starts and ends.

    What is outside of the limits is of no interest.
    """
    low, high = np.minimum(a, b), np.maximum(a, b)
    high = np.where(high - low < _LEAST, low, high)
    floor = np.floor(np.clip(low, *limits))
    count = np.maximum(np.ceil(np.clip(high, *limits)) - floor, 1.0).astype(np.intp)
    of = np.repeat(np.arange(len(a)), count)
    level = floor[of] + np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    low, high = low[of], high[of]
    length = np.maximum(high - low, _LEAST)
    one = (np.maximum(level, low) - low) / length
    other = np.where(high > low, (np.minimum(level + 1.0, high) - low) / length, 1.0)
    down = (b < a)[of]
    return of, np.where(down, 1.0 - other, one), np.where(down, 1.0 - one, other)

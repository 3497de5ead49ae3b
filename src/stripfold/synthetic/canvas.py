"""A grey picture on which polygons are drawn with the exact share of each pixel that they cover."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from matplotlib.transforms import IdentityTransform
from numpy.typing import NDArray

from stripfold.arrays import Array

Grey = NDArray[np.uint8]
Box = tuple[slice, slice]

_SPARE = 1.2
"""How far the greys of a ribbon reach beyond what they are seen of, pixels."""


class Layer:
    """A picture to draw on; pixel centres are at integers.

    Agg computes the covered area of each pixel, to 1/256 of a pixel.  OpenCV's ``fillPoly`` also draws the outline and
    so makes each polygon larger by half a sample, which shows in a strip that is two pixels thin.

    Parameters
    ----------
    size
        Width and height, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._height = size[1]
        self._figure = Figure(figsize=(1.0, 1.0), dpi=72)
        self._renderer = RendererAgg(size[0], size[1], 72.0)
        self.pixels = np.asarray(self._renderer.buffer_rgba())
        self.pixels[..., 3] = 255

    def quads(self, corners: Array, greys: Array) -> None:
        """Draw quadrilaterals one after the other, shape (n, 4, 2), pixels; greys of shape (n,), 0 to 1."""
        colours = np.ones((len(greys), 4))
        colours[:, :3] = np.clip(greys, 0.0, 1.0)[:, None]
        outlines = self._up(corners)
        drawn = PolyCollection(outlines, facecolors=colours, edgecolors="none", linewidths=0, snap=False)  # type: ignore[arg-type]
        drawn.set_figure(self._figure)
        drawn.draw(self._renderer)

    def shape(self, polygons: Array, grey: float, alpha: float = 1.0) -> None:
        """Draw the union of polygons, shape (n, k, 2), pixels: where two share a side there is no seam."""
        side = np.roll(polygons, -1, axis=1)
        area = np.sum(polygons[..., 0] * side[..., 1] - side[..., 0] * polygons[..., 1], axis=1)
        same = np.where(area[:, None, None] < 0.0, polygons[:, ::-1], polygons)
        verts = self._up(np.concatenate([same, same[:, :1]], axis=1)).reshape(-1, 2)
        codes = np.full((len(polygons), polygons.shape[1] + 1), Outline.LINETO, dtype=np.uint8)
        codes[:, 0], codes[:, -1] = Outline.MOVETO, Outline.CLOSEPOLY
        context: Any = self._renderer.new_gc()  # type: ignore[no-untyped-call]
        context.set_snap(False)
        context.set_linewidth(0.0)
        context.set_alpha(alpha)
        self._renderer.draw_path(context, Outline(verts, codes.ravel()), IdentityTransform(), (grey, grey, grey))
        context.restore()

    def _up(self, points: Array) -> Array:
        """In matplotlib's frame: from the lower left corner, pixel centres at halves."""
        return np.stack([points[..., 0] + 0.5, self._height - points[..., 1] - 0.5], axis=-1)


class Canvas:
    """A layer that also takes ribbons, and draws some rows only.

    Parameters
    ----------
    size
        Width and height, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._base, self._colour, self._mask = (Layer(size) for _ in range(3))
        self._rows = (0, size[1])

    @property
    def picture(self) -> Grey:
        """Shape (height, width): a view of what was drawn."""
        return self._base.pixels[..., 0]

    def clear(self, background: Grey, rows: tuple[int, int]) -> None:
        """Begin with a picture, shape (height, width); only what is in these rows, first and end, is drawn."""
        self._rows = rows
        part = slice(*rows)
        self._base.pixels[part, :, :3] = background[part, :, None]

    def quads(self, corners: Array, greys: Array) -> None:
        """As :meth:`Layer.quads`."""
        seen = self._seen(corners)
        if np.any(seen):
            self._base.quads(corners[seen], greys[seen])

    def shape(self, polygons: Array, grey: float, alpha: float = 1.0) -> None:
        """As :meth:`Layer.shape`."""
        seen = self._seen(polygons)
        if np.any(seen):
            self._base.shape(polygons[seen], grey, alpha)

    def ribbon(self, pieces: Array, greys: Array) -> None:
        """Draw pieces of different grey that share their sides.

        Each pixel gets their grey by the share that all of them cover together.  Drawn one by one, the background would
        shine through their seams, and where they overlap their borders would be too heavy.

        Parameters
        ----------
        pieces
            Shape (n, 4, 2): corners, pixels; the first two are along the ribbon, the others across from these.
        greys
            Shape (n,), 0 to 1.
        """
        seen = self._seen(pieces)
        if not np.any(seen):
            return
        pieces, greys = pieces[seen], greys[seen]
        columns, rows = self._box(pieces)
        if columns.start >= columns.stop or rows.start >= rows.stop:
            return
        self._mask.pixels[rows, columns, 0] = 0
        self._mask.shape(pieces, 1.0)
        self._colour.pixels[rows, columns, :3] = round(255.0 * float(np.clip(greys.mean(), 0, 1)))
        self._colour.quads(_larger(pieces), greys)
        base = self._base.pixels[rows, columns]
        share = self._mask.pixels[rows, columns, 0].astype(np.float32) / np.float32(255.0)
        below = base[..., 0].astype(np.float32)
        mixed = below + share * (self._colour.pixels[rows, columns, 0] - below)
        base[..., :3] = (mixed + np.float32(0.5)).astype(np.uint8)[..., None]

    def _seen(self, polygons: Array) -> NDArray[np.bool_]:
        """Which of them reach into the rows that are drawn."""
        row = polygons[..., 1]
        return np.asarray((row.max(axis=1) > self._rows[0] - 1.0) & (row.min(axis=1) < self._rows[1]))

    def _box(self, polygons: Array) -> Box:
        """Columns and rows in which they may be."""
        low, high = np.floor(polygons.min(axis=(0, 1))), np.ceil(polygons.max(axis=(0, 1)))
        first = np.maximum(low - 1, [0, self._rows[0]]).astype(int)
        end = np.minimum(high + 2, [self._size[0], self._rows[1]]).astype(int)
        return slice(int(first[0]), int(end[0])), slice(int(first[1]), int(end[1]))


def _larger(pieces: Array) -> Array:
    """Each piece pulled out along and across the ribbon."""
    along = pieces[:, 1] - pieces[:, 0] + pieces[:, 2] - pieces[:, 3]
    across = pieces[:, 3] - pieces[:, 0] + pieces[:, 2] - pieces[:, 1]
    along, across = (_SPARE * way / np.maximum(np.hypot(*way.T), 1e-9)[:, None] for way in (along, across))
    moves = np.stack([-along - across, along - across, along + across, across - along], axis=1)
    return np.asarray(pieces + moves)

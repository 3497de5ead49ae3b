"""A grey picture on which polygons are drawn, each pixel by the exact share that they cover."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from matplotlib.transforms import IdentityTransform

from stripfold.arrays import Array, Mask, Picture

_MARGIN = 1.2
"""Distance by which the pieces of a ribbon overlap before its outline is cut out, pixels."""


class Layer:
    """A picture to draw on; pixel centres are at integers, greys from 0 to 1.

    Agg computes the covered area of each pixel to 1/256.  OpenCV's ``fillPoly`` also draws the outline: each polygon is
    half a sample larger, which shows in a strip that is two pixels thin.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size, self.rows = size, (0, size[1])
        self._figure = Figure(figsize=(1.0, 1.0), dpi=72)
        self._renderer = RendererAgg(size[0], size[1], 72.0)
        self.pixels = np.asarray(self._renderer.buffer_rgba())
        self.pixels[..., 3] = 255

    def visible(self, polygons: Array) -> Mask:
        """Which polygons reach into the rows to be drawn."""
        row = polygons[..., 1]
        return np.asarray((row.max(axis=1) > self.rows[0] - 1.0) & (row.min(axis=1) < self.rows[1]))

    def quads(self, corners: Array, greys: Array) -> None:
        """Draw quadrilaterals one after the other: corners, shape (n, 4, 2), pixels; greys, shape (n,)."""
        seen = self.visible(corners)
        if not np.any(seen):
            return
        colours = np.repeat(np.clip(greys[seen], 0.0, 1.0)[:, None], 3, axis=1)
        outlines: Any = self._flipped(corners[seen])
        drawn = PolyCollection(outlines, facecolors=colours, edgecolors="none", linewidths=0, snap=False)
        drawn.set_figure(self._figure)
        drawn.draw(self._renderer)

    def shape(self, polygons: Array, grey: float, alpha: float = 1.0) -> None:
        """Draw the union of polygons, shape (n, k, 2), pixels: no seam where two share a side."""
        polygons = polygons[self.visible(polygons)]
        if not len(polygons):
            return
        following = np.roll(polygons, -1, axis=1)
        area = np.sum(polygons[..., 0] * following[..., 1] - following[..., 0] * polygons[..., 1], axis=1)
        same = np.where(area[:, None, None] < 0.0, polygons[:, ::-1], polygons)
        verts = self._flipped(np.concatenate([same, same[:, :1]], axis=1)).reshape(-1, 2)
        codes = np.full((len(polygons), polygons.shape[1] + 1), Outline.LINETO, dtype=np.uint8)
        codes[:, 0], codes[:, -1] = Outline.MOVETO, Outline.CLOSEPOLY
        context: Any = self._renderer.new_gc()  # type: ignore[no-untyped-call]
        context.set_snap(False)
        context.set_linewidth(0.0)
        context.set_alpha(alpha)
        self._renderer.draw_path(context, Outline(verts, codes.ravel()), IdentityTransform(), (grey, grey, grey))
        context.restore()

    def _flipped(self, points: Array) -> Array:
        """In matplotlib's frame: from the lower left corner, pixel centres at halves."""
        return np.stack([points[..., 0] + 0.5, self.size[1] - points[..., 1] - 0.5], axis=-1)


class Canvas(Layer):
    """A layer on which ribbons can be drawn, too."""

    def __init__(self, size: tuple[int, int]) -> None:
        super().__init__(size)
        self._colour, self._mask = Layer(size), Layer(size)

    @property
    def picture(self) -> Picture:
        """Shape (height, width): a view of what was drawn."""
        return self.pixels[..., 0]

    def clear(self, background: Picture, rows: tuple[int, int]) -> None:
        """Begin with a picture, shape (height, width); only these rows, first and end, are drawn from now on."""
        self.rows = rows
        self.pixels[slice(*rows), :, :3] = background[slice(*rows), :, None]

    def ribbon(self, pieces: Array, greys: Array) -> None:
        """Draw the pieces of a ribbon, each with its grey, shape (n,), by the share that all of them together cover.

        ``pieces``, shape (n, 4, 2), pixels: the first two corners are along the ribbon, the others opposite to these.
        Drawn one by one, the background would show at their seams.
        """
        seen = self.visible(pieces)
        if not np.any(seen):
            return
        pieces, greys = pieces[seen], greys[seen]
        low, high = np.floor(pieces.min(axis=(0, 1))), np.ceil(pieces.max(axis=(0, 1)))
        first = np.maximum(low - 1, [0, self.rows[0]]).astype(int)
        end = np.minimum(high + 2, [self.size[0], self.rows[1]]).astype(int)
        if np.any(first >= end):
            return
        box = slice(first[1], end[1]), slice(first[0], end[0])
        self._mask.pixels[*box, 0] = 0
        self._mask.shape(pieces, 1.0)
        self._colour.pixels[*box, :3] = round(255.0 * float(np.clip(greys.mean(), 0, 1)))
        self._colour.quads(_enlarged(pieces), greys)
        share = self._mask.pixels[*box, 0].astype(np.float32) / np.float32(255.0)
        below = self.pixels[*box, 0].astype(np.float32)
        mixed = below + share * (self._colour.pixels[*box, 0] - below)
        self.pixels[*box, :3] = (mixed + np.float32(0.5)).astype(np.uint8)[..., None]


def _enlarged(pieces: Array) -> Array:
    """Each piece extended along and across the ribbon."""
    along = pieces[:, 1] - pieces[:, 0] + pieces[:, 2] - pieces[:, 3]
    across = pieces[:, 3] - pieces[:, 0] + pieces[:, 2] - pieces[:, 1]
    along, across = (_MARGIN * d / np.maximum(np.hypot(*d.T), 1e-9)[:, None] for d in (along, across))
    return np.asarray(pieces + np.stack([-along - across, along - across, along + across, across - along], axis=1))

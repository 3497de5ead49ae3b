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

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]


class Canvas:
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
        self._pixels = np.asarray(self._renderer.buffer_rgba())
        self._rows = (0, size[1])

    def clear(self, background: Grey, rows: tuple[int, int]) -> None:
        """Begin with a picture, shape (height, width); only what is in these rows, first and end, is drawn."""
        self._rows = rows
        part = slice(*rows)
        self._pixels[part, :, :3] = background[part, :, None]
        self._pixels[part, :, 3] = 255

    def quads(self, corners: Array, greys: Array) -> None:
        """Draw quadrilaterals one after the other.

        Parameters
        ----------
        corners
            Shape (n, 4, 2), pixels.
        greys
            Shape (n,), 0 to 1.
        """
        first, end = self._rows
        row = corners[..., 1]
        seen = (row.max(axis=1) > first - 1.0) & (row.min(axis=1) < end)
        if not np.any(seen):
            return
        colours = np.ones((int(seen.sum()), 4))
        colours[:, :3] = np.clip(greys[seen], 0.0, 1.0)[:, None]
        outlines = self._up(corners[seen])
        drawn = PolyCollection(outlines, facecolors=colours, edgecolors="none", linewidths=0, snap=False)  # type: ignore[arg-type]
        drawn.set_figure(self._figure)
        drawn.draw(self._renderer)

    def shape(self, polygons: Array, grey: float, alpha: float = 1.0) -> None:
        """Draw polygons of one grey at once, shape (n, k, 2), pixels: where they meet there is no seam.

        They must go round in the same sense; where they overlap they are drawn once.
        """
        count, corners, _ = polygons.shape
        row = polygons[..., 1]
        if row.max() < self._rows[0] - 1.0 or row.min() > self._rows[1]:
            return
        verts = self._up(np.concatenate([polygons, polygons[:, :1]], axis=1)).reshape(-1, 2)
        codes = np.full((count, corners + 1), Outline.LINETO, dtype=np.uint8)
        codes[:, 0], codes[:, -1] = Outline.MOVETO, Outline.CLOSEPOLY
        context: Any = self._renderer.new_gc()  # type: ignore[no-untyped-call]
        context.set_snap(False)
        context.set_linewidth(0.0)
        context.set_alpha(alpha)
        outline = Outline(verts, codes.ravel())
        self._renderer.draw_path(context, outline, IdentityTransform(), (grey, grey, grey))
        context.restore()

    @property
    def picture(self) -> Grey:
        """Shape (height, width): a view of what was drawn."""
        return self._pixels[..., 0]

    def _up(self, points: Array) -> Array:
        """In matplotlib's frame: from the lower left corner, pixel centres at halves."""
        return np.stack([points[..., 0] + 0.5, self._height - points[..., 1] - 0.5], axis=-1)

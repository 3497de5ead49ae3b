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

    def clear(self, background: Grey) -> None:
        """Begin with a picture, shape (height, width)."""
        self._pixels[..., :3] = background[..., None]
        self._pixels[..., 3] = 255

    def quads(self, corners: Array, greys: Array) -> None:
        """Draw quadrilaterals one after the other.

        Parameters
        ----------
        corners
            Shape (n, 4, 2), pixels.
        greys
            Shape (n,), 0 to 1.
        """
        if not len(corners):
            return
        colours = np.ones((len(greys), 4))
        colours[:, :3] = np.clip(greys, 0.0, 1.0)[:, None]
        drawn = PolyCollection(self._up(corners), facecolors=colours, edgecolors="none", linewidths=0, snap=False)  # type: ignore[arg-type]
        drawn.set_figure(self._figure)
        drawn.draw(self._renderer)

    def shape(self, polygons: list[Array], grey: float, alpha: float = 1.0) -> None:
        """Draw polygons of one grey at once, each of shape (n, 2), pixels: where they meet there is no seam.

        They must go round in the same sense; where they overlap they are drawn once.
        """
        verts = np.concatenate([np.vstack([self._up(one), self._up(one)[:1]]) for one in polygons])
        codes = np.full(len(verts), Outline.LINETO, dtype=np.uint8)
        ends = np.cumsum([len(one) + 1 for one in polygons])
        codes[np.concatenate([[0], ends[:-1]])] = Outline.MOVETO
        codes[ends - 1] = Outline.CLOSEPOLY
        context: Any = self._renderer.new_gc()  # type: ignore[no-untyped-call]
        context.set_snap(False)
        context.set_linewidth(0.0)
        context.set_alpha(alpha)
        outline = Outline(verts, codes)
        self._renderer.draw_path(context, outline, IdentityTransform(), (grey, grey, grey))
        context.restore()

    @property
    def picture(self) -> Grey:
        """Shape (height, width): a view of what was drawn."""
        return self._pixels[..., 0]

    def _up(self, points: Array) -> Array:
        """In matplotlib's frame: from the lower left corner, pixel centres at halves."""
        return np.stack([points[..., 0] + 0.5, self._height - points[..., 1] - 0.5], axis=-1)

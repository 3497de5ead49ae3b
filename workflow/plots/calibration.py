"""RMS error of each view of the public chessboard pictures, and the part of the picture that the boards cover."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from plots.pieces import note
from stripfold.draw.colours import BLACK, BLUE, GREY, SHADE, VERMILLION
from stripfold.draw.style import figure, legend_above, styled
from verification.calibration import EARLY, SCALED

TARGET = 0.25
"""RMS error to be reached by the calibration, pixels."""
WAYS = {
    SCALED: ("window that grows with the corners' distance", BLUE, -0.2),
    EARLY: ("half-window of 11 px, stopped at 0.1 px", VERMILLION, 0.2),
}
"""Text, colour and offset of the bars of each way to refine corners."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each view's RMS error, ours, with the fixed window, and as published; below, the places of the corners.

    ``data`` is from :func:`verification.calibration.run`.
    """
    fig = figure(4.9)
    above, below = fig.subplots(2, 1, height_ratios=(1.0, 1.35))
    draw_views(above, data)
    draw_coverage(below, data)
    legend_above(fig, ncols=1)
    return fig


def draw_views(ax: Axes, data: xr.Dataset) -> None:
    """Bars of each view's RMS error, with the published values as marks."""
    names = [str(name).removeprefix("left").removesuffix(".jpg") for name in data["view"].values]
    x = np.arange(len(names))
    for way, (text, colour, offset) in WAYS.items():
        one = data.sel(way=way)
        ax.bar(x + offset, one["view_rms"].values, 0.4, color=colour, label=f"{text}: {float(one['rms']):.3f} px")
    label = f"published: {float(data['published_rms']):.3f} px"
    ax.plot(x + 0.2, data["published_view_rms"].values, "_", color=BLACK, ms=7.0, label=label)
    ax.axhline(TARGET, color=GREY, lw=0.8, ls="--", label=f"target for all views: {TARGET:g} px")
    ax.set_xticks(x, names)
    ax.grid(False, axis="x")
    ax.set(xlabel="view", ylabel="RMS error [px]")


def draw_coverage(ax: Axes, data: xr.Dataset) -> None:
    """The picture's outline, the area between the corners of each view, and the corners."""
    width, height = data["size"].values
    pixels = data["pixels"].values
    for i, view in enumerate(pixels):
        hull = view[ConvexHull(view).vertices]
        ax.add_patch(Polygon(hull, closed=True, fc=SHADE, ec="none", zorder=1)).set_label(f"_view-{i}")
    ax.plot(*pixels.reshape(-1, 2).T, ".", color=BLUE, ms=1.5, zorder=2, label="_corners")
    ax.set(aspect="equal", xlim=(0.0, width), ylim=(height, 0.0), xlabel="x [px]", ylabel="y [px]")
    ax.grid(False)
    note(ax, f"{100.0 * float(data['coverage']):.0f} % of the picture covered", "upper right")

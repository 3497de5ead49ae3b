"""How well each view of the public chessboard pictures is fitted, and which part of the picture the boards cover."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from stripfold.plots.style import BLACK, BLUE, GREY, SHADE, VERMILLION, figure, note, styled
from studies.calibration import EARLY, SCALED

TARGET = 0.25
"""Pixels: what the calibration is meant to reach."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each view's RMS, ours, with the fixed window, and as published; below, where the boards' corners were.

    Parameters
    ----------
    data
        From :func:`studies.calibration.run`.
    """
    fig = figure(4.9)
    above, below = fig.subplots(2, 1, height_ratios=(1.0, 1.35))
    draw_views(above, data)
    draw_coverage(below, data)
    fig.legend(loc="outside upper center", ncols=1)
    return fig


def draw_views(ax: Axes, data: xr.Dataset) -> None:
    """Bars of each view's RMS, with the published values as marks."""
    names = [str(name).removeprefix("left").removesuffix(".jpg") for name in data["view"].values]
    x, wide = np.arange(len(names)), 0.4
    for way, colour, side, text in (
        (SCALED, BLUE, -0.5, "window that grows with the corners' distance"),
        (EARLY, VERMILLION, 0.5, "half-window of 11 px, stopped at 0.1 px"),
    ):
        rms, all_views = data["view_rms"].sel(way=way).values, float(data["rms"].sel(way=way))
        ax.bar(x + side * wide, rms, wide, color=colour, label=f"{text}: {all_views:.3f} px")
    published = float(data["published_rms"])
    ax.plot(
        x + 0.5 * wide,
        data["published_view_rms"].values,
        "_",
        color=BLACK,
        ms=7.0,
        label=f"published: {published:.3f} px",
    )
    ax.axhline(TARGET, color=GREY, lw=0.8, ls="--", label=f"target for all views: {TARGET:g} px")
    ax.set_xticks(x, names)
    ax.grid(False, axis="x")
    ax.set(xlabel="view", ylabel="RMS error / px")


def draw_coverage(ax: Axes, data: xr.Dataset) -> None:
    """The picture's outline, what lies between the corners of each view, and the corners."""
    width, height = data["size"].values
    pixels = data["pixels"].values
    for i, view in enumerate(pixels):
        hull = view[ConvexHull(view).vertices]
        patch = ax.add_patch(Polygon(hull, closed=True, fc=SHADE, ec="none", zorder=1))
        patch.set_label(f"_view-{i}")
    flat = pixels.reshape(-1, 2)
    (dots,) = ax.plot(flat[:, 0], flat[:, 1], ".", color=BLUE, ms=1.5, zorder=2)
    dots.set_label("_corners")
    ax.set(aspect="equal", xlim=(0.0, width), ylim=(height, 0.0), xlabel="x / px", ylabel="y / px")
    ax.grid(False)
    note(ax, f"{float(data['coverage']):.0%} of the picture", "upper right")

"""First touch on each path against its places of reference, over the length of the strip."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import LENGTH_TITLE, PATH_LOOKS, PATH_STYLES, Look, entry, path_entries
from stripfold.base.arrays import Array, Mask
from stripfold.draw.colours import BLACK, GREY, LYING
from stripfold.draw.style import figure, legend_above, styled

LANDING, LINE = (0, (6, 1)), (0, (1, 4))
"""Kinds of line of the places of reference."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the first touch less the planned one of the R-path, in L*, with its error, over the strip's length in L*.

    Hollow where the strip was laid down without a fall.  Lines: where the finished fold lands, and the fold line.

    ``data`` is from :func:`tasks.assess_data.table`.
    """
    r_path, unit = data.sel(path="r-path"), data["gravity_length"].values
    length = r_path["relative_length"].values
    fig = figure(3.3)
    ax = fig.subplots()
    order = np.argsort(length)
    planned = r_path["planned_touch_x"].values
    ax.axhline(0.0, color=BLACK, lw=0.8, zorder=1, label="_planned")
    for place, name, color, ls in ((r_path["landing_x"].values, "landing", LYING, LANDING), (0.0, "line", GREY, LINE)):
        y = (place - planned) / unit
        ax.plot(length[order], y[order], ls=ls, color=color, lw=1.0, zorder=1, label=f"_{name}")
    for name, (_, look) in PATH_LOOKS.items():
        one = data.sel(path=name)
        y, error = one["touch_error"].values / unit, one["touch_uncertainty"].values / unit
        ax.errorbar(length, y, error, fmt="none", ecolor=look.color, capsize=2.0, lw=0.8, zorder=2)
        draw_points(ax, length, y, look, one["fell"].values > 0.0, name)
    ax.set(xlabel=LENGTH_TITLE, ylabel="first touch less the planned one$\\,/\\,L^*$")
    handles = path_entries()
    handles += [entry("finished fold lands", LYING, LANDING, lw=1.0), entry("fold line", GREY, LINE, lw=1.0)]
    if np.any((data["fell"].values == 0.0) & np.isfinite(data["touch_error"].values)):
        handles.append(entry("laid down without a fall", GREY, "none", marker="o", mfc="white"))
    legend_above(fig, handles)
    return fig


def draw_points(ax: Axes, x: Array, y: Array, look: Look, filled: Mask, name: str) -> None:
    """Points joined in the order of ``x``, some hollow."""
    order = np.argsort(x)
    line = order[np.isfinite(y[order])]
    ax.plot(x[line], y[line], PATH_STYLES[name], color=look.color, lw=0.8, zorder=2, label=f"_{name}-line")
    for chosen, fill, kind in ((filled, look.color, "filled"), (~filled, "white", "hollow")):
        own = order[chosen[order]]
        ax.plot(x[own], y[own], look.marker, color=look.color, mfc=fill, zorder=3, label=f"_{name}-{kind}")

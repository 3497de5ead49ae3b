"""How far from where the folded strip lands each path lets it touch first, over the materials."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.arrays import Array, Mask
from stripfold.plots.materials import ETA_TITLE, names
from stripfold.plots.style import BLACK, BLUE, GREEN, GREY, VERMILLION, Look, figure, styled

LOOKS = {
    "r-path": ("R-path", Look(BLUE, "o")),
    "triangular": ("triangular path", Look(VERMILLION, "^")),
    "circular": ("circular path", Look(GREEN, "D")),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error of the first touch in L* over eta_b, with the strips' lengths in L* above.

    Hollow where the strip was laid down without a fall.  Strips of the commonest length are joined by a line.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.assess_data.table`.
    """
    unit = data["gravity_length"].values
    eta, long = data["eta_b"].values, data["relative_length"].sel(path="r-path").values
    joined = common(unit * long)
    fig = figure(3.3)
    ax = fig.subplots()
    ax.set_xscale("log")
    ax.axhline(0.0, color=BLACK, lw=0.8, zorder=1)
    assumed = data["assumed_touch_x"].sel(path="r-path").values - data["planned_touch_x"].sel(path="r-path").values
    order = np.argsort(eta)
    ax.plot(eta[order], (assumed / unit)[order], "--", color=BLUE, lw=0.8, zorder=1, label="_assumed")
    for name, (_, look) in LOOKS.items():
        one = data.sel(path=name)
        error = one["touch_error"].values / unit
        draw_points(ax, eta, error, look, joined, one["fell"].values > 0.0, name)
    ax.set(xlabel=f"weight-to-bending-stiffness ratio {ETA_TITLE}", ylabel="error of the first touch$\\,/\\,L^*$")
    lengths_above(ax, data, long, joined)
    handles = [Line2D([], [], color=k.colour, marker=k.marker, lw=1.0, label=text) for text, k in LOOKS.values()]
    handles.append(Line2D([], [], color=BLUE, lw=0.8, ls="--", label="R-path as planned"))
    if np.any((data["fell"].values == 0.0) & np.isfinite(data["touch_error"].values)):
        handles.append(Line2D([], [], color=GREY, marker="o", mfc="white", ls="none", label="laid down without a fall"))
    fig.legend(handles=handles, loc="outside upper center", ncols=2, columnspacing=1.2)
    return fig


def common(length: Array) -> Mask:
    """Which materials have the commonest of the strips' lengths, m; shape (n,)."""
    rounded = np.round(length, 6)
    values, counts = np.unique(rounded, return_counts=True)
    return np.asarray(rounded == values[np.argmax(counts)])


def draw_points(ax: Axes, eta: Array, y: Array, look: Look, joined: Mask, filled: Mask, name: str) -> None:
    """Points over eta_b, some joined by a line, some hollow."""
    order = np.argsort(eta)
    line = order[joined[order] & np.isfinite(y[order])]
    ax.plot(eta[line], y[line], color=look.colour, lw=1.0, zorder=2, label=f"_{name}-line")
    for chosen, fill, kind in ((filled, look.colour, "filled"), (~filled, "white", "hollow")):
        own = order[chosen[order]]
        (points,) = ax.plot(eta[own], y[own], look.marker, color=look.colour, mfc=fill, zorder=3)
        points.set_label(f"_{name}-{kind}")


def lengths_above(ax: Axes, data: xr.Dataset, long: Array, joined: Mask) -> None:
    """The strips' lengths in L* at a second axis above; what stands apart has its name there too."""
    above = ax.secondary_xaxis("top")
    labels = [f"{length:.0f}" + ("" if joined[i] else f" ({names(data)[i]})") for i, length in enumerate(long)]
    above.set_xticks(data["eta_b"].values, labels)
    above.set_xticks([], minor=True)
    above.tick_params(pad=1.0)
    above.set_xlabel("length of the strip$\\,/\\,L^*$", labelpad=2.0)
    ax.margins(x=0.1)

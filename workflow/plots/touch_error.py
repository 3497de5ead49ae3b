"""Error of the first touch on each path, relative to where the folded strip lands, over the materials."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import ETA_TITLE, Look, entry
from stripfold.arrays import Array, Mask
from stripfold.plots.colours import BLACK, BLUE, GREEN, GREY, VERMILLION
from stripfold.plots.style import figure, legend_above, styled

LOOKS = {
    "r-path": ("R-path", Look(BLUE, "o")),
    "triangular": ("triangular path", Look(VERMILLION, "^")),
    "circular": ("circular path", Look(GREEN, "D")),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error of the first touch in L* over eta_b, with the strips' lengths in L* above.

    Hollow where the strip was laid down without a fall.  Strips of the commonest length are joined by a line.

    ``data`` is from :func:`tasks.assess_data.table`.
    """
    r_path = data.sel(path="r-path")
    unit, eta = data["gravity_length"].values, data["eta_b"].values
    joined = common(unit * r_path["relative_length"].values)
    fig = figure(3.3)
    ax = fig.subplots()
    ax.set_xscale("log")
    ax.axhline(0.0, color=BLACK, lw=0.8, zorder=1)
    assumed = (r_path["assumed_touch_x"] - r_path["planned_touch_x"]).values / unit
    order = np.argsort(eta)
    ax.plot(eta[order], assumed[order], "--", color=BLUE, lw=0.8, zorder=1, label="_assumed")
    for name, (_, look) in LOOKS.items():
        one = data.sel(path=name)
        draw_points(ax, eta, one["touch_error"].values / unit, look, joined, one["fell"].values > 0.0, name)
    ax.set(xlabel=f"weight-to-bending-stiffness ratio {ETA_TITLE}", ylabel="error of the first touch$\\,/\\,L^*$")
    lengths_above(ax, data, r_path["relative_length"].values, joined)
    handles = [entry(text, k.color, marker=k.marker, lw=1.0) for text, k in LOOKS.values()]
    handles.append(entry("R-path as planned", BLUE, "--", lw=0.8))
    if np.any((data["fell"].values == 0.0) & np.isfinite(data["touch_error"].values)):
        handles.append(entry("laid down without a fall", GREY, "none", marker="o", mfc="white"))
    legend_above(fig, handles)
    return fig


def common(length: Array) -> Mask:
    """Materials with the commonest of the strips' lengths, m; shape (n,)."""
    rounded = np.round(length, 6)
    values, counts = np.unique(rounded, return_counts=True)
    return np.asarray(rounded == values[np.argmax(counts)])


def draw_points(ax: Axes, eta: Array, y: Array, look: Look, joined: Mask, filled: Mask, name: str) -> None:
    """Points over eta_b, some joined by a line, some hollow."""
    order = np.argsort(eta)
    line = order[joined[order] & np.isfinite(y[order])]
    ax.plot(eta[line], y[line], color=look.color, lw=1.0, zorder=2, label=f"_{name}-line")
    for chosen, fill, kind in ((filled, look.color, "filled"), (~filled, "white", "hollow")):
        own = order[chosen[order]]
        ax.plot(eta[own], y[own], look.marker, color=look.color, mfc=fill, zorder=3, label=f"_{name}-{kind}")


def lengths_above(ax: Axes, data: xr.Dataset, relative: Array, joined: Mask) -> None:
    """The strips' lengths in L* at a second axis above, with the names of those that are not joined."""
    names = ["" if one else f" ({name})" for one, name in zip(joined, data["material"].values, strict=True)]
    above = ax.secondary_xaxis("top")
    above.set_xticks(
        data["eta_b"].values, [f"{length:.0f}{name}" for length, name in zip(relative, names, strict=True)]
    )
    above.set_xticks([], minor=True)
    above.tick_params(pad=1.0)
    above.set_xlabel("length of the strip$\\,/\\,L^*$", labelpad=2.0)
    ax.margins(x=0.1)

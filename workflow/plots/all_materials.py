"""Folding paths of all materials over the length of the strip: first touches, and the friction that is needed."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import LENGTH_TITLE, PATH_LOOKS, PATH_STYLES, Look, entry, note
from stripfold.base.arrays import Array, Mask
from stripfold.draw.colours import BLACK, FRICTION, GREY, LYING, SKY
from stripfold.draw.style import figure, legend_above, styled, text_at

PLACES = {
    "planned": ("planned", BLACK, "-", False),
    "landing": ("finished fold lands", LYING, (0, (6, 1)), True),
    "line": ("fold line", GREY, (0, (1, 4)), False),
}
"""Places of reference: text, colour and kind of line, and whether the text is below the line."""


@styled
def draw_touch_error(data: xr.Dataset) -> Figure:
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
    last = order[-1]
    places = {"planned": planned, "landing": r_path["landing_x"].values, "line": 0.0}
    for name, (text, color, ls, below) in PLACES.items():
        y = (places[name] - planned) / unit
        ax.plot(length[order], y[order], ls=ls, color=color, lw=1.0, zorder=1, label=f"_{name}")
        how = {"ha": "right", "va": "top" if below else "bottom", "color": color, "fontsize": 8}
        text_at(ax, (length[last], y[last]), text, (-4, -2 if below else 1), **how)
    for name, (text, look) in PATH_LOOKS.items():
        one = data.sel(path=name)
        y, error = one["touch_error"].values / unit, one["touch_uncertainty"].values / unit
        ax.errorbar(length, y, error, fmt="none", ecolor=look.color, capsize=2.0, lw=0.8, zorder=2)
        draw_points(ax, length, y, look, one["fell"].values > 0.0, name)
        end = order[np.isfinite(y[order])][-1]
        how = {"ha": "left", "va": "center", "color": look.color, "fontsize": 8}
        text_at(ax, (length[end], y[end]), text.removesuffix(" path"), (6, 0), **how)
    ax.set(xlabel=LENGTH_TITLE, ylabel="first touch less the planned one$\\,/\\,L^*$")
    ax.set_xlim(right=1.2 * length[last])
    if np.any((data["fell"].values == 0.0) & np.isfinite(data["touch_error"].values)):
        legend_above(fig, [entry("laid down without a fall", GREY, "none", marker="o", mfc="white")])
    return fig


def draw_points(ax: Axes, x: Array, y: Array, look: Look, filled: Mask, name: str) -> None:
    """Points joined in the order of ``x``, some hollow."""
    order = np.argsort(x)
    line = order[np.isfinite(y[order])]
    ax.plot(x[line], y[line], PATH_STYLES[name], color=look.color, lw=0.8, zorder=2, label=f"_{name}-line")
    for chosen, fill, kind in ((filled, look.color, "filled"), (~filled, "white", "hollow")):
        own = order[chosen[order]]
        ax.plot(x[own], y[own], look.marker, color=look.color, mfc=fill, zorder=3, label=f"_{name}-{kind}")


PULL, MOMENT = r"pull: $k_f\,\Delta s\,/\,g$", r"hysteresis: $M_0\,/\,\rho_a g {L^*}^2$"
LAWS = {"pull": (PULL, Look(FRICTION, "s")), "hysteresis": (MOMENT, Look(BLACK, "x"))}
RATIOS = {"ratio_max": ("largest", Look(BLACK, "^")), "ratio_median": ("median", Look(SKY, "v"))}


@styled
def draw_friction_needed(data: xr.Dataset) -> Figure:
    """Draw over the length in L* (a) the friction that suffices, by either law, (b) pulling force over gripper force.

    ``data`` is from :func:`tasks.friction.table`.
    """
    unit, length = (data[name].values for name in ("gravity_length", "relative_length"))
    # k_f is stored in g/L*.
    factor = {"pull": data["step"].values / unit, "hysteresis": 1.0}
    suffices = {law: factor[law] * data["suffices"].sel(law=law).values for law in LAWS}
    ratios = {name: data[name].sel(law="pull").values for name in RATIOS}
    fig = figure(4.6)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.3, 1.0))
    for ax, values, looks in ((top, suffices, LAWS), (bottom, ratios, RATIOS)):
        for name, (label, look) in looks.items():
            ax.plot(length, values[name], look.marker, color=look.color, mfc="none", label=label)
        ax.set_ylim(0.0, 1.25 * ax.dataLim.y1)  # room for the letter
        ax.legend(loc="lower right", fontsize=7)
        for place in zip(length, np.min(list(values.values()), axis=0), data["material"].values, strict=True):
            text_at(ax, place[:2], str(place[2]), (0, -4), va="top", fontsize=7)
    top.margins(x=0.1)
    top.set_ylabel("friction that suffices")
    bottom.set(xlabel=LENGTH_TITLE, ylabel="pull$\\,/\\,$gripper force")
    note(top, "(a)")
    note(bottom, "(b) up to the first touch")
    fig.align_ylabels()
    return fig

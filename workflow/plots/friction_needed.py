"""The smallest internal friction with which an R-path is followed, over the length of the strip."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import LENGTH_TITLE, Look, note
from stripfold.draw.colours import BLACK, FRICTION, SKY
from stripfold.draw.style import figure, styled, text_at

PULL, MOMENT = r"pull: $k_f\,\Delta s\,/\,g$", r"hysteresis: $M_0\,/\,\rho_a g {L^*}^2$"
LAWS = {"pull": (PULL, Look(FRICTION, "s")), "hysteresis": (MOMENT, Look(BLACK, "x"))}
RATIOS = {"ratio_max": ("largest", Look(BLACK, "^")), "ratio_median": ("median", Look(SKY, "v"))}


@styled
def draw(data: xr.Dataset) -> Figure:
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

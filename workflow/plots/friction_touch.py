"""First touch on the triangular and the circular path, over the bending friction."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import PATH_LOOKS, entry, look, note
from stripfold.draw.colours import BLACK, LYING, SHADE
from stripfold.draw.style import figure, styled

NONE = 3e-3
"""Where no friction is drawn."""
LINES = ("-", "--", "-.", ":")


@styled
def draw(data: xr.Dataset, fabrics: xr.Dataset) -> Figure:
    """Draw x of the first touch less the planned one over M_0, with the band of an uncertain eta_b, for each path.

    ``data`` is from :func:`verification.friction_touch.run`, ``fabrics`` from :func:`verification.fabrics.run`.
    """
    moment = np.maximum(data["moment"].values, NONE)
    planned, real = data["planned_x"], fabrics["friction"].values
    fig = figure(5.0)
    axes = fig.subplots(2, 1, sharex=True)
    for ax, path, mark in zip(axes, data["path"].values, ("(a)", "(b)"), strict=True):
        of_path = data.sel(path=path)
        for i, length in enumerate(data["length"].values):
            one, at = of_path.sel(length=length), float(planned.sel(length=length))
            color = look(i)[0]
            ax.plot(moment, one["touch_x"] - at, ls=LINES[i % len(LINES)], color=color, label=f"$L = {length:g}\\,L^*$")
            fell = one["fell"].values == 1.0
            for chosen, fill in ((fell, color), (~fell, "white")):
                ax.plot(moment[chosen], (one["touch_x"] - at)[chosen], "o", ms=4, color=color, mfc=fill, label="_marks")
            # Beside each other, in the order of the lengths.
            beside = moment * 1.06 ** (i + 1)
            ax.vlines(beside, one["touch_softer"] - at, one["touch_stiffer"] - at, color=color, lw=0.8, label="_band")
        ax.axhline(0.0, color=LYING, lw=0.8, zorder=1)
        ax.axvspan(real.min(), real.max(), color=SHADE, lw=0.0, zorder=0)
        ax.set(xscale="log", ylabel="first touch less planned [$L^*$]")
        note(ax, f"{mark} {PATH_LOOKS[str(path)][0]}")
    ticks = [NONE, 1e-2, 1e-1, 1.0]
    axes[-1].set_xticks(ticks, ["0", "$10^{-2}$", "$10^{-1}$", "$10^{0}$"])
    axes[-1].set_xlabel(MOMENT.split(": ")[1])
    handles, _ = axes[0].get_legend_handles_labels()
    marks = [entry("fell", BLACK, "", marker="o", ms=4), entry("laid down", BLACK, "", marker="o", ms=4, mfc="white")]
    fig.legend(handles=[*handles, *marks], fontsize=7, loc="outside upper center", ncols=3)
    return fig

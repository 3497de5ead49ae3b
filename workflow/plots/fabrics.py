"""Internal friction of real fabrics beside the friction that an R-path needs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from stripfold.plots.colours import BLACK, FRICTION, GREY
from stripfold.plots.style import figure, styled

MEASURED = {"textile_friction": ("o", "$L^*$ of its slope"), "textile_friction_secant": ("s", "$L^*$ of its secant")}


@styled
def draw(data: xr.Dataset, friction: xr.Dataset) -> Figure:
    """Draw M_0 of each fabric, of the textile of data/, and the range that the R-paths of all materials need.

    ``data`` is from :func:`studies.fabrics.run`, ``friction`` from :func:`tasks.friction.table`.
    """
    needed = friction["suffices"].sel(law="hysteresis").values
    order = np.argsort(data["friction"].values)
    rows = np.arange(len(order)) + 1.0
    fig = figure(1.5 + 0.25 * len(order))
    ax = fig.subplots()
    ax.axvspan(np.nanmin(needed), np.nanmax(needed), color=FRICTION, alpha=0.5, lw=0.0, label="an R-path needs")
    ax.plot(data["friction"].values[order], rows, "o", color=BLACK, label="fabrics, Kawabata's test")
    for name, (marker, label) in MEASURED.items():
        ax.plot(data[name], 0.0, marker, color=GREY, mfc="none", label=f"dry textile, {label}")
    ax.set(xscale="log", xlabel=MOMENT.split(": ")[1], ylim=(-0.6, len(order) + 0.6))
    ax.set_yticks([0.0, *rows], ["dry textile", *data["fabric"].values[order]])
    ax.tick_params(axis="y", length=0)
    fig.legend(loc="outside upper center", ncols=2, fontsize=7)
    return fig

"""Length L* of real fabrics, and their internal friction beside that which an R-path needs."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import note
from stripfold.plots.colours import BLACK, FRICTION, GREY
from stripfold.plots.style import CM, figure, styled

MEASURED = {"textile_friction": ("o", "$L^*$ of its slope"), "textile_friction_secant": ("s", "$L^*$ of its secant")}


@styled
def draw(data: xr.Dataset, friction: xr.Dataset) -> Figure:
    """Draw (a) the share of fabrics up to each L*, (b) M_0 of those with 2HB, of the textile, and what R-paths need.

    ``data`` is from :func:`studies.fabrics.run`, ``friction`` from :func:`tasks.friction.table`.
    """
    needed = friction["suffices"].sel(law="hysteresis").values
    bent = data["friction"].sortby(data["friction"])
    rows = np.arange(len(bent)) + 1.0
    fig = figure(3.4 + 0.25 * len(rows))
    top, bottom = fig.subplots(2, 1, height_ratios=(1.4, 0.5 + 0.25 * len(rows)))
    lengths = data["gravity_length"].sortby(data["gravity_length"])
    share = (np.arange(len(lengths)) + 1.0) / len(lengths)
    tested = np.isin(lengths["fabric"].values, data["bent"].values)
    for chosen, label, fill in ((tested, "fabrics, Kawabata's test", BLACK), (~tested, "fabrics, cantilever", "white")):
        top.plot(CM * lengths.values[chosen], share[chosen], "o", ms=4, color=BLACK, mfc=fill, label=label)
    top.set(xlabel="$L^*$ [cm]", ylabel="share of fabrics", xlim=(0.0, None), ylim=(0.0, 1.05))
    bottom.axvspan(np.nanmin(needed), np.nanmax(needed), color=FRICTION, alpha=0.5, lw=0.0, label="an R-path needs")
    bottom.plot(bent.values, rows, "o", ms=4, color=BLACK, label="_bent")
    for name, (marker, label) in MEASURED.items():
        bottom.plot(data[name], 0.0, marker, color=GREY, mfc="none", label=f"dry textile, {label}")
    bottom.set(xscale="log", xlabel=MOMENT.split(": ")[1], ylim=(-0.6, len(rows) + 0.6))
    bottom.set_yticks([0.0, *rows], ["dry textile", *bent["bent"].values])
    bottom.tick_params(axis="y", length=0)
    note(top, "(a)")
    note(bottom, "(b)", "upper right")
    fig.legend(loc="outside upper center", ncols=2, fontsize=7)
    return fig

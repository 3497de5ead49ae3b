"""The rod and the solid: error of lambda_c over the element length, and of the model over the thickness."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from stripfold.plots.colours import GREY, look
from stripfold.plots.style import figure, note, styled
from studies.plots.models import LOOKS

SLOPE = 2.0
"""Order in the element length that is drawn to compare with."""
SIZE_TICKS = (0.003, 0.01, 0.03)


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| of lambda_c (a) over the element length near the lift-off, (b) over the thickness.

    In (b) the distance of the rod from the solid at each height, and that of the solid from the elastica.

    ``data`` is from :func:`studies.rod.run`.
    """
    fig = figure(4.8)
    top, bottom = fig.subplots(2, 1)
    for name in ("rod", "solid"):
        one = data.sel(model=name).isel(refinement=slice(None, -1))
        top.plot(one["size"], np.abs(one["error"]), **LOOKS[name]._asdict(), label=name)
    one = data.sel(model="rod").isel(refinement=slice(None, -1))
    sizes, first = one["size"].values, abs(float(one["error"][0]))
    top.plot(sizes, first * (sizes / sizes[0]) ** SLOPE, color=GREY, ls="--", lw=0.8, label="order 2")
    top.set(xlabel="element length near the lift-off $/\\,L^*$", ylabel=r"error of $\lambda_c$, relative")
    note(top, f"(a) $z = {data.attrs['height_star']:g}\\,L^*$, $h = {data.attrs['thickness_star']:g}\\,L^*$")
    thickness = data["thickness"].values
    for i, height in enumerate(data["height"].values):
        one, how = data.sel(height=height), look(i + 3)  # not the colours of the models
        bottom.plot(thickness, np.abs(one["model_error"]), **how._asdict(), label=f"$z = {height:g}\\,L^*$")
        bottom.plot(thickness, np.abs(one["thickness_effect"]), color=how.color, ls=":", lw=0.8)
    bottom.plot([], [], color=GREY, marker="o", label="rod from solid")
    bottom.plot([], [], color=GREY, ls=":", lw=0.8, label="solid from elastica")
    bottom.set(xlabel="thickness $h\\,/\\,L^*$", ylabel=r"difference in $\lambda_c$, relative")
    note(bottom, "(b)")
    for ax, ticks in ((top, SIZE_TICKS), (bottom, thickness)):
        ax.set(xscale="log", yscale="log")
        ax.xaxis.set_major_locator(FixedLocator(list(ticks)))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    top.legend(loc="lower right", fontsize=7)
    # Room for the legend below what is drawn.
    low, high = bottom.get_ylim()
    bottom.set_ylim(low * (low / high) ** 0.5, high)
    bottom.legend(loc="lower right", fontsize=7, ncols=2)
    fig.align_ylabels()
    return fig

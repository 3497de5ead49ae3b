"""The rod beside the solid: error of lambda_c over the element length, and of the model over the thickness."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from stripfold.plots.style import BLACK, BLUE, GREY, VERMILLION, Look, figure, look, note, styled

LOOKS = {"rod": Look(BLUE, "o"), "solid": Look(VERMILLION, "s")}
SLOPE = 2.0
"""Order in the element length that is drawn to compare with."""
SIZE_TICKS = (0.003, 0.01, 0.03)


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| of lambda_c (a) over the element length near the lift-off, (b) over the thickness.

    In (b) the distance of the rod from the solid at each height, and that of the solid from the elastica.

    Parameters
    ----------
    data
        From :func:`studies.rod.run`.
    """
    fig = figure(4.8)
    top, bottom = fig.subplots(2, 1)
    for name, how in LOOKS.items():
        one = data.sel(model=name).isel(refinement=slice(None, -1))
        top.plot(one["size"], np.abs(one["error"]), color=how.colour, marker=how.marker, label=name)
    sizes, errors = data["size"].sel(model="rod").values[:-1], np.abs(data["error"].sel(model="rod").values[:-1])
    top.plot(sizes, errors[0] * (sizes / sizes[0]) ** SLOPE, color=GREY, ls="--", lw=0.8, label="order 2")
    z, h = data.attrs["height_star"], data.attrs["thickness_star"]
    top.set(xlabel="element length near the lift-off $/\\,L^*$", ylabel=r"error of $\lambda_c$, relative")
    note(top, f"(a) $z = {z:g}\\,L^*$, $h = {h:g}\\,L^*$")
    thickness = data["thickness"].values
    for i, height in enumerate(data["height"].values):
        how, one = look(i), data.sel(height=height)
        label = f"$z = {height:g}\\,L^*$"
        bottom.plot(thickness, np.abs(one["model_error"]), color=how.colour, marker=how.marker, label=label)
        bottom.plot(thickness, np.abs(one["thickness_effect"]), color=how.colour, ls=":", lw=0.8)
    bottom.plot([], [], color=BLACK, marker="o", label="rod from solid")
    bottom.plot([], [], color=BLACK, ls=":", lw=0.8, label="solid from elastica")
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

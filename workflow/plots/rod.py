"""The rod and the solid: difference of lambda_c over the thickness."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from plots.pieces import look
from stripfold.plots.colours import GREY
from stripfold.plots.style import figure, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the distance of the rod from the solid at each height, and that of the solid from the elastica.

    ``data`` is from :func:`studies.models.run_rod`.
    """
    fig = figure(2.8)
    ax = fig.subplots()
    thickness = data["thickness"].values
    for i, height in enumerate(data["height"].values):
        one, how = data.sel(height=height), look(i + 3)  # not the colours of the models
        ax.plot(thickness, np.abs(one["model_error"]), **how._asdict(), label=f"$z = {height:g}\\,L^*$")
        ax.plot(thickness, np.abs(one["thickness_effect"]), color=how.color, ls=":", lw=0.8)
    # The orders that the two thickest strips have: of thin ones the rod's distance is that of the meshes.
    thick = np.argsort(thickness)[-2:]
    for name in ("model_error", "thickness_effect"):
        low, high = (float(np.abs(data[name].isel(thickness=int(i))).min()) for i in thick)
        order = np.log(high / low) / np.log(thickness[thick[1]] / thickness[thick[0]])
        guide = 0.5 * high * (thickness / thickness.max()) ** order
        ax.plot(thickness, guide, "--", color=GREY, lw=0.8, label=f"$h^{{{order:.1f}}}$")
    ax.plot([], [], color=GREY, marker="o", label="rod from solid")
    ax.plot([], [], color=GREY, ls=":", lw=0.8, label="solid from elastica")
    ax.set(xlabel="thickness $h\\,/\\,L^*$", ylabel=r"difference in $\lambda_c$, relative", xscale="log", yscale="log")
    ax.xaxis.set_major_locator(FixedLocator(list(thickness)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    # Room for the legend below what is drawn.
    low, high = ax.get_ylim()
    ax.set_ylim(low * (low / high) ** 0.5, high)
    ax.legend(loc="lower right", fontsize=7, ncols=2)
    return fig

"""The rod and the solid: difference of lambda_c over the thickness."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from plots.pieces import entry, look
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, legend_above, styled, text_at


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the distance of the rod from the solid at each height, and that of the solid from the elastica.

    ``data`` is from :func:`verification.models.run`.
    """
    fig = figure(3.1)
    ax = fig.subplots()
    thickness = data["thickness"].values
    for i, height in enumerate(data["gripper_height"].values):
        one, how = data.sel(gripper_height=height), look(i + 3)  # not the colours of the models
        ax.plot(thickness, np.abs(one["model_error"]), **how._asdict(), label=f"$z = {height:g}\\,L^*$")
        ax.plot(thickness, np.abs(one["thickness_effect"]), color=how.color, ls=":", lw=0.8)
    # The orders that the two thickest strips have: of thin ones the rod's distance is that of the meshes.
    thick = np.argsort(thickness)[-2:]
    for name in ("model_error", "thickness_effect"):
        low, high = (float(np.abs(data[name].isel(thickness=int(i))).min()) for i in thick)
        order = np.log(high / low) / np.log(thickness[thick[1]] / thickness[thick[0]])
        guide = 0.5 * high * (thickness / thickness.max()) ** order
        ax.plot(thickness, guide, "--", color=GREY, lw=0.8, label="_guide")
        middle = len(guide) // 2
        text_at(ax, (thickness[middle], guide[middle]), f"$h^{{{order:.1f}}}$", (4, -3), ha="left", va="top", size=8.0)
    ax.set(xlabel="thickness $h\\,/\\,L^*$", ylabel=r"difference in $\lambda_c$, relative", xscale="log", yscale="log")
    ax.xaxis.set_major_locator(FixedLocator(list(thickness)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    handles = ax.get_legend_handles_labels()[0]
    legend_above(
        fig,
        [
            *handles,
            entry("rod from solid", GREY, marker="o"),
            entry("solid from elastica", GREY, ":", lw=0.8),
            entry("order of the two thickest", GREY, "--", lw=0.8),
        ],
        fontsize=7,
    )
    return fig

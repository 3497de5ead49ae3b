"""The energy that makes a hanging strip fall: over the distance to lambda_c, and where the floor ends it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.models import LOOKS
from plots.pieces import entry, note
from stripfold.draw.colours import BLACK, GREY
from stripfold.draw.style import figure, styled, text_at

SIZES = {"rod": 5.0, "solid": 2.5}
"""Of the markers: both models nearly coincide."""
CURVES = {
    "width": (r"$\lambda_c-\lambda_t$ [$L^*$]", "-"),
    "largest": (r"barrier at $\lambda_t$ [$\rho_a g{L^*}^2$]", "--"),
    "speed": (r"its rms speed [$\sqrt{gL^*}$]", ":"),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the barrier over the distance with its law, (b) their ratio, (c) the end of the range over the height.

    ``data`` is from :func:`verification.barrier.run`.
    """
    fig = figure(6.6)
    energy, ratio, ends = fig.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0))
    distance = data["distance"].values
    color = LOOKS["elastica"].color
    for height in data["gripper_height"].values:
        one = data.sel(gripper_height=height)
        width, largest = float(one["width"]), float(one["largest"])
        inside = np.isfinite(one["barrier"].values)
        x = np.append(distance[inside], width)
        y = np.append(one["barrier"].values[inside], largest)
        for ax, values in ((energy, y), (ratio, y / x**1.5)):
            ax.plot(x, values, color=color, lw=1.0, label="_elastica")
            ax.plot(width, values[-1], "x", color=color, ms=5, label="_touch")
        text_at(energy, (width, largest), f"$z = {height:g}\\,L^*$", (6, -3), ha="left", va="top", fontsize=7)
        text_at(ratio, (width, y[-1] / width**1.5), f"${height:g}\\,L^*$", (5, 0), ha="left", va="center", fontsize=7)
        for model, size in SIZES.items():
            found = one["model_barrier"].sel(model=model).values
            style = {"color": LOOKS[model].color, "marker": LOOKS[model].marker, "ls": "none", "ms": size}
            ratio.plot(distance, found / distance**1.5, **style, label=f"_{model}")
    shown = data.isel(gripper_height=data.sizes["gripper_height"] // 2)
    law = float(shown["coefficient"]) * distance**1.5
    energy.plot(distance, law, color=GREY, ls=":", lw=3.0, zorder=1)
    energy.set(xscale="log", yscale="log", ylabel=r"barrier$\,/\,\rho_a g{L^*}^2$")
    energy.set_ylim(top=1.0)
    handles = [entry("elastica", color), entry(r"$C\,(\lambda_c-\lambda)^{3/2}$", GREY, ":", lw=3.0)]
    energy.legend(handles=handles, loc="upper left", fontsize=7, bbox_to_anchor=(0.0, 0.92))
    ratio.set(xscale="log", ylabel=r"barrier$\,/\,(\lambda_c-\lambda)^{3/2}$")
    ratio.set_xlabel(r"distance $(\lambda_c-\lambda)\,/\,L^*$")
    low, high = ratio.get_ylim()
    ratio.set_ylim(low, high + 0.1 * (high - low))
    ratio.sharex(energy)
    energy.set_xlim(right=8.0 * distance.max())
    models = [entry(m, LOOKS[m].color, "none", marker=LOOKS[m].marker, ms=size) for m, size in SIZES.items()]
    models.append(entry("sag touches", color, "none", marker="x", ms=5))
    ratio.legend(handles=models, loc="center right", fontsize=7, bbox_to_anchor=(1.0, 0.6))
    for name, (label, ls) in CURVES.items():
        ends.plot(data["range_height"], data[f"range_{name}"], color=BLACK, ls=ls, label=label)
    ends.set(xscale="log", yscale="log", xlabel="gripper height $z\\,/\\,L^*$", ylabel=r"at $\lambda_t$")
    ends.set_xticks([2, 3, 5, 10, 20], ["2", "3", "5", "10", "20"])
    ends.minorticks_off()
    ends.legend(loc="lower right", fontsize=7)
    for ax, letter in zip((energy, ratio, ends), "abc", strict=True):
        note(ax, f"({letter})")
    return fig

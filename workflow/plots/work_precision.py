"""Accuracy versus run time: error of lambda_c for models and meshes at several heights."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.models import LOOKS, draw_pareto, headroom, plain_numbers
from plots.pieces import entry, note
from stripfold.draw.colours import GREY
from stripfold.draw.style import figure, styled

LEAST = 1e-7
"""Smaller errors are drawn here: the reference is no better."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over run time, a panel per height, with the Pareto front.

    Open markers: elements of order one, or two elements across the thickness.  Dotted: uncertainty of the reference.

    ``data`` is from :func:`verification.accuracy.run`.
    """
    count = data.sizes["gripper_height"]
    rows = count // 2 + 1
    fig = figure(2.0 * rows, 5.2)
    panels = fig.subplots(rows, 2, squeeze=False, sharey=True).ravel()
    kinds = data["kind"].values
    plain = (data["order"].values == 2.0) & (data["across"].values == 1.0)
    for j, ax in enumerate(panels[:count]):
        one = data.isel(gripper_height=j)
        cost = one["seconds"].values
        error = np.maximum(np.abs(one["error"].values), LEAST)
        for kind, how in LOOKS.items():
            for filled in (True, False):
                of = (kinds == kind) & (plain == filled)
                name = kind if filled and j == 0 and of.any() else None
                face = how.color if filled else "white"
                ax.plot(cost[of], error[of], how.marker, color=how.color, mfc=face, label=name)
        draw_pareto(ax, cost, error, max(float(one["uncertain"]), LEAST))
        ax.set(xscale="log", yscale="log", xlabel="run time [s]")
        what = r"$\lambda_c$" if one["snaps"] else "first touch"
        note(ax, f"({'abcdefgh'[j]}) $z = {float(one['gripper_height']):g}\\,L^*$, {what}", loc="upper right")
    for ax in panels[count:]:
        ax.set_axis_off()
    for ax in panels[1:count]:
        ax.sharex(panels[0])
    panels[0].autoscale(axis="x")  # to what all of them show
    for ax in panels[:count]:
        plain_numbers(ax.xaxis)
    headroom(panels[0], 0.12)
    fig.supylabel(r"error of $\lambda$, relative", fontsize=9.0)
    handles = panels[0].get_legend_handles_labels()[0]
    open_marks = entry("solid, order one or two across", LOOKS["solid"].color, "none", marker="s", mfc="white")
    handles += [
        open_marks,
        entry("Pareto front", GREY, lw=1.0),
        entry("uncertainty of the reference", GREY, ":", lw=0.8),
    ]
    panels[count].legend(handles=handles, loc="center")
    return fig

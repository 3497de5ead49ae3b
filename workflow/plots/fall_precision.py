"""Accuracy versus run time of a fall: error of the first touch for models, meshes, time steps and integrators."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.models import LOOKS, draw_pareto, headroom, plain_numbers
from plots.pieces import entry, note
from stripfold.draw.colours import GREEN, GREY, PINK
from stripfold.draw.style import figure, legend_above, styled

COLOURS = {
    ("rod", "energy-momentum"): LOOKS["rod"].color,
    ("rod", "energy-momentum, conserving"): GREEN,
    ("rod", "generalised-alpha"): PINK,
    ("solid", "energy-momentum"): LOOKS["solid"].color,
}
"""Of model and integrator."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over run time, a panel per height, with the Pareto front.

    The size of a marker is that of the elements; filled: the default time step, upper half: longer steps, lower half:
    shorter ones.  Dotted: uncertainty of the reference, at which smaller errors are drawn.

    ``data`` is from :func:`verification.fall_accuracy.run`.
    """
    count = data.sizes["gripper_height"]
    fig = figure(0.6 + 1.9 * count)
    panels = fig.subplots(count, 1, squeeze=False, sharex=True, sharey=True).ravel()
    default = float(data["tolerance"].median())
    for j, (ax, height) in enumerate(zip(panels, data["gripper_height"].values, strict=True)):
        one = data.isel(gripper_height=j)
        seconds, uncertain = one["seconds"].values, float(one["uncertain"])
        error = np.maximum(np.abs(one["error"].values), uncertain)
        for i in range(data.sizes["way"]):
            model, scheme, tolerance = (one[name].values[i] for name in ("model", "scheme", "tolerance"))
            fill = "full" if tolerance == default else "top" if tolerance > default else "bottom"
            size = 5.0 * float(one["refinement"][i]) ** 0.5
            style = {"color": COLOURS[model, scheme], "fillstyle": fill, "markerfacecoloralt": "white", "ms": size}
            ax.plot(seconds[i], error[i], LOOKS[model].marker, **style)
        draw_pareto(ax, seconds, error, uncertain)
        ax.set(xscale="log", yscale="log")
        note(ax, f"({'abcdefgh'[j]}) $z = {height:g}\\,L^*$", loc="upper right")
    headroom(panels[0], 0.15)
    plain_numbers(panels[-1].xaxis)
    panels[-1].set_xlabel("run time of the fall [s]")
    fig.supylabel(r"error of the first touch$\,/\,L^*$", fontsize=9.0)
    shown = dict.fromkeys(zip(data["model"].values, data["scheme"].values, strict=True))
    handles = [entry(f"{m}, {s}", COLOURS[m, s], "none", marker=LOOKS[m].marker, ms=5.0) for m, s in shown]
    handles += [entry("Pareto front", GREY, lw=1.0), entry("uncertainty of the reference", GREY, ":", lw=0.8)]
    title = "large marks: long elements; upper half filled: longer time steps, lower half: shorter ones"
    legend_above(fig, handles, fontsize=6.5, title=title, title_fontsize=6.5)
    return fig

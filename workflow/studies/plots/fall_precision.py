"""Error of the first touch of a fall against the time of the fall, for models, meshes, time steps and integrators."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from stripfold.plots.style import BLUE, GREEN, PURPLE, VERMILLION, figure, note, styled
from studies.plots.work_precision import draw_front

COLOURS = {
    ("rod", "energy-momentum"): BLUE,
    ("rod", "energy-momentum, conserving"): GREEN,
    ("rod", "generalised-alpha"): PURPLE,
    ("solid", "energy-momentum"): VERMILLION,
}
"""Of model and integrator."""
MARKERS = {"rod": "o", "solid": "s"}
LEAST = 1e-6
"""Smaller errors are drawn here, L*."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over seconds, a panel per height, with the front of what nothing else beats.

    The size of a marker is that of the elements; filled: the default time step, upper half: longer steps, lower half:
    shorter ones.  Dotted: how well the reference is known.

    Parameters
    ----------
    data
        From :func:`studies.fall_accuracy.run`.
    """
    count = data.sizes["height"]
    fig = figure(3.0, max(3.5, 2.4 * count))
    panels = fig.subplots(1, count, squeeze=False, sharex=True, sharey=True).ravel()
    usual = float(data["tolerance"].median())
    for j, (ax, height) in enumerate(zip(panels, data["height"].values, strict=True)):
        seconds = data["seconds"].values[:, j]
        error = np.maximum(np.abs(data["error"].values[:, j]), LEAST)
        for i in range(data.sizes["way"]):
            way = data.isel(way=i)
            model, tolerance = str(way["model"].item()), float(way["tolerance"])
            fill = "full" if tolerance == usual else "top" if tolerance > usual else "bottom"
            ax.plot(
                seconds[i], error[i], MARKERS[model], color=COLOURS[model, str(way["scheme"].item())],
                fillstyle=fill, markerfacecoloralt="white", ms=5.0 * float(way["refinement"]) ** 0.5,  # type: ignore[arg-type]
            )  # fmt: skip
        draw_front(ax, seconds, error, max(float(data["uncertain"].values[j]), LEAST))
        ax.set(xscale="log", yscale="log")
        note(ax, f"({'abcdefgh'[j]}) $z = {height:g}\\,L^*$", loc="upper right")
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(low, high * (high / low) ** 0.15)
    fig.supxlabel("time of the fall, s", fontsize=9.0)
    fig.supylabel(r"error of the first touch, $L^*$", fontsize=9.0)
    shown = dict.fromkeys(zip(data["model"].values, data["scheme"].values, strict=True))
    for model, scheme in shown:
        panels[0].plot([], [], MARKERS[model], color=COLOURS[model, scheme], ms=5.0, label=f"{model}, {scheme}")
    fig.legend(loc="outside upper center", ncols=2, fontsize=7.0)
    return fig

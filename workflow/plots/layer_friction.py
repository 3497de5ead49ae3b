"""Finished folds with friction between the layers: their error over its coefficient, and their shapes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, PATH_STYLES, Look, entry, note, path_entries
from stripfold.draw.colours import GREEN, GREY, SHADE
from stripfold.draw.style import figure, legend_above, styled

LOOKS = {name: look for name, (_, look) in PATH_LOOKS.items()} | {"low": Look(GREEN, "s")}
STYLES = PATH_STYLES | {"low": "-."}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the error of the finished fold in L* over mu, gripper closed, and (b) the folds at one mu.

    Open circles: elements and time steps half as long.  ``data`` is from :func:`verification.layer_friction.run`.
    """
    fig = figure(4.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(2.4, 1.0))
    mu, shown = data["mu"].values, data.attrs["shown"]
    low, high = data.attrs["band"]
    top.axvspan(low, high, color=SHADE, lw=0.0, zorder=0, label="_fabrics")
    for name in data["path"].values:
        one, look = data.sel(path=name), LOOKS[name]
        style = {"color": look.color, "ls": STYLES[name]}
        top.plot(mu, one["error"].values, marker=look.marker, lw=1.1, **style, label=f"_{name}")
        top.plot(shown, one["finer_error"], "o", color=look.color, mfc="none", ms=8.0, label=f"_{name}-finer")
        width = 2.2 if name == "r-path" else 1.2
        bottom.plot(one["x"].values, one["z"].values, lw=width, **style, label=f"_{name}-fold")
    top.set(yscale="log", xlabel=r"coefficient of friction $\mu$", ylabel="error of the fold$\\,/\\,L^*$")
    bottom.axhline(0.0, color=GREY, lw=0.6, zorder=0)
    bottom.set(aspect="equal", xlabel="$x\\,/\\,L^*$", ylabel="$z\\,/\\,L^*$")
    bottom.set_ylim(-0.2, 1.6 * float(np.max(data["z"].values)))
    low = entry("low path", LOOKS["low"].color, STYLES["low"], marker=LOOKS["low"].marker, lw=0.9)
    legend_above(fig, [*path_entries(), low, entry("fabric on fabric", SHADE, lw=6.0)])
    note(top, "(a)")
    note(bottom, rf"(b) $\mu$ = {shown:g}", "upper right")
    return fig

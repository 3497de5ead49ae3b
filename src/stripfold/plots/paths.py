"""The gripper's paths along x, one for each height, and where they end."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from stripfold.plots.materials import NO_SNAP, points
from stripfold.plots.style import BLACK, BLUE, CM, GREY, ORANGE, equal, floor, styled


@styled
def draw(data: xr.Dataset, material: str) -> Figure:
    """Draw the paths of one material from lambda_0 to where the advance ends, in the paper's frame.

    Parameters
    ----------
    data
        Critical points of several materials (:mod:`stripfold.plots.materials`).
    material
        Name of the one to draw.

    Raises
    ------
    InvalidInputError
        No such material.
    """
    p = points(data, material)
    half = 0.5 * float(data["length"].sel(material=material))
    start, end, z = CM * (p.first - half), CM * (p.advance - half), CM * p.height
    wide = end.max() - start.min()
    limits = (start.min() - 0.05 * wide, end.max() + 0.05 * wide), (-0.04 * wide, z.max() + 0.05 * wide)
    fig, ax = equal(*limits, above=0.45)
    for i in range(len(z)):
        ax.plot([start[i], end[i]], [z[i], z[i]], color=BLUE if p.snap[i] else GREY, lw=1.0, label="_path")
    ax.plot(start, z, "|", color=BLUE, ms=5, label=r"start, $\lambda_0$")
    label = r"critical point, $\lambda_c$"
    ax.plot(end[p.snap], z[p.snap], ":o", color=BLACK, ms=2.5, label=label, gid="lambda_c", zorder=4)
    if not np.all(p.snap):
        ax.plot(end[~p.snap], z[~p.snap], "x", color=ORANGE, mew=1.5, label=NO_SNAP, gid="no-snap", zorder=4)
    ax.set(xlabel="gripper $x$ [cm]", ylabel="gripper $z$ [cm]")
    ax.grid(visible=False)
    floor(ax)
    # Columns are filled downwards: the two ends of a path first.
    fig.legend(loc="upper center", borderaxespad=0.3, ncols=2, columnspacing=1.2)
    return fig

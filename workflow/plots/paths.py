"""The gripper's paths along x, one for each height, and where they end."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.critical_points import NO_SNAP, eta_label
from plots.pieces import ETA_TITLE
from plots.readers import critical_points
from stripfold.draw.colours import CRITICAL, GREY, GRIPPER
from stripfold.draw.style import CM, equal_panels, legend_above, styled


@styled
def draw(data: xr.Dataset, material: str) -> Figure:
    """Draw the paths of one material from lambda_0 to where the advance ends, in the paper's frame.

    ``data``: critical points of several materials, padded with nan, over ``material`` and ``height_index``;
    ``material``: name of the one to draw.  Raises InvalidInputError: no such material.
    """
    p = critical_points(data, material)
    half, snap = 0.5 * float(p["length"]), p["snap"].values
    start, end, z = CM * (p["lambda_0"].values - half), CM * (p["end"].values - half), CM * p["gripper_height"].values
    margin = 0.05 * (end.max() - start.min())
    limits = (start.min() - margin, end.max() + margin), (-margin, z.max() + margin)
    fig, (ax,) = equal_panels([limits], above=0.62)
    ax.set(xlabel="gripper $x$ [cm]", ylabel="gripper $z$ [cm]")
    for x0, x1, height, snaps in zip(start, end, z, snap, strict=True):
        ax.plot([x0, x1], [height, height], color=GRIPPER if snaps else GREY, lw=1.0, label="_path")
    ax.plot(start, z, "|", color=GRIPPER, ms=5, label=r"start, $\lambda_0$")
    label = r"critical point, $\lambda_c$"
    ax.plot(end[snap], z[snap], ":o", color=CRITICAL, ms=2.5, label=label, gid="lambda_c", zorder=4)
    if not np.all(snap):
        ax.plot(end[~snap], z[~snap], "x", color=CRITICAL, mew=1.2, label=NO_SNAP, gid="no-snap", zorder=4)
    legend_above(fig, title=f"{ETA_TITLE}: {eta_label(data, material)}")
    return fig

"""Paths of the gripper as recordings show them, and where on them the strips snapped."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.plots.style import BLACK, CM, GREY, RED, figure, look, note, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the gripper's way in each recording, the onset of the snap on it, and the model's boundary of stability.

    Parameters
    ----------
    data
        Over ``recording`` (:mod:`studies.recordings`).
    """
    etas = np.unique(data["eta_b"].values)
    columns = min(len(etas), 2)
    lines = -(-len(etas) // columns)
    fig = figure(0.6 + 1.9 * lines)
    axes = fig.subplots(lines, columns, squeeze=False).ravel()
    for index, (ax, eta) in enumerate(zip(axes, etas, strict=False)):
        part = data.isel(recording=np.flatnonzero(data["eta_b"].values == eta)).sortby("height")
        how = look(index)
        for row in range(part.sizes["recording"]):
            track = CM * part["track"].values[row]
            ax.plot(*track.T, color=GREY, lw=0.8)
            if part["snapped"].values[row]:
                place = CM * float(part["lambda_event"][row]), CM * float(part["height"][row])
                ax.plot(*place, marker=how.marker, color=how.colour, ms=3.5)
        z, first = np.unique(part["height"].values, return_index=True)
        ax.plot(CM * part["lambda_model"].values[first], CM * z, color=RED, lw=1.0)
        ax.set(xlabel=r"$\lambda$ [cm]", ylabel="$z$ [cm]", ylim=(0.0, 1.08 * CM * float(part["height"].max())))
        note(ax, rf"$\eta_b$ = {eta:.5g} m$^{{-4}}$ s$^2$")
    for ax in axes[len(etas) :]:
        ax.set_visible(False)
    handles = [
        Line2D([], [], color=GREY, lw=0.8, label="gripper, by the video"),
        Line2D([], [], color=BLACK, marker="o", ms=3.5, lw=0.0, label="onset of the snap"),
        Line2D([], [], color=RED, lw=1.0, label="model without friction"),
    ]
    fig.legend(handles=handles, loc="outside upper center", ncols=2)
    return fig

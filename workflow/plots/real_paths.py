"""Paths of the gripper in recordings, and the points on them where the strips snapped."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import entry, note
from plots.readers import recordings
from stripfold.plots.colours import BLACK, CRITICAL, GRIPPER
from stripfold.plots.style import CM, figure, legend_above, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the gripper's way in each recording, the onset of the snap on it, and the model's boundary of stability.

    ``data`` is the table of measured recordings, over ``recording``.
    """
    groups = list(recordings(data))
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    fig = figure(0.6 + 1.9 * rows)
    axes = fig.subplots(rows, columns, squeeze=False).ravel()
    for ax, (eta, look, part) in zip(axes, groups, strict=False):
        for track in part["track"].values:
            ax.plot(*(CM * track).T, color=GRIPPER, lw=0.8)
        snapped = part.isel(recording=part["snapped"].values == 1.0)
        ax.plot(CM * snapped["lambda_event"], CM * snapped["height"], look.marker, color=look.color, mfc="none", ms=3.5)
        z, first = np.unique(part["height"].values, return_index=True)
        ax.plot(CM * part["lambda_model"].values[first], CM * z, ":", color=CRITICAL)
        ax.set(xlabel=r"$\lambda$ [cm]", ylabel="$z$ [cm]")
        ax.margins(y=0.2)
        note(ax, rf"$\eta_b$ = {eta:.5g} m$^{{-4}}$ s$^2$")
    for ax in axes[len(groups) :]:
        ax.set_visible(False)
    handles = [
        entry("gripper, by the video", GRIPPER, lw=0.8),
        entry("onset of the snap", BLACK, "none", marker="o", mfc="none", ms=3.5),
        entry(r"$\lambda_c$ without friction", CRITICAL, ":"),
    ]
    legend_above(fig, handles)
    return fig

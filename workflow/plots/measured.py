"""lambda measured in recordings over the gripper height, with the frictionless model's lambda_c."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import ETA_TITLE, entry, note, speed_mark
from plots.readers import recordings
from stripfold.draw.colours import BLACK
from stripfold.draw.style import CM, MILLI, figure, legend_above, styled

LINES = ("-", "--")
"""Kinds of the lines below, of the slowest gripper and of others."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the model's lambda_c as lines and the measured values as marks, small for the slowest gripper.

    Below is the distance of each value from the line with its 95 % interval: friction and the speed of the gripper make
    the strip snap later.

    ``data`` is the table of measured recordings, over ``recording``.
    """
    fig = figure(5.8)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.5, 1.6))
    speeds = np.unique(np.round(data["speed"].values, 4))
    handles = []
    for eta, look, part in recordings(data):
        z, first = np.unique(part["gripper_height"].values, return_index=True)
        top.plot(CM * z, CM * part["lambda_model"].values[first], color=look.color, lw=1.0)
        for i, speed in enumerate(speeds):
            some = part.isel(recording=(np.round(part["speed"].values, 4) == speed) & (part["snapped"].values == 1.0))
            names = ("gripper_height", "lambda_event", "lambda_low", "lambda_high", "lambda_model")
            z, event, low, high, model = (CM * some[name].values for name in names)
            options = {"marker": look.marker, "color": look.color, **speed_mark(i, look.color)}
            top.plot(z, event, ls="none", **options)
            interval = [event - low, high - event]
            bottom.errorbar(z, event - model, interval, ls=LINES[i > 0], lw=0.7, capsize=1.5, **options)
        handles.append(entry(f"{eta:.5g}", look.color, marker=look.marker, ms=3.5, lw=1.0))
    bottom.axhline(0.0, color=BLACK, lw=0.8)
    top.set(ylabel=r"$\lambda$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    bottom.set(ylabel=r"$\lambda - \lambda_c$ [cm]", xlabel="gripper height $z$ [cm]")
    for i, speed in enumerate(speeds):
        options = {"marker": "o", "lw": 0.7, **speed_mark(i, BLACK)}
        handles.append(entry(f"{MILLI * speed:.2g} mm/s", BLACK, LINES[i > 0], **options))
    legend_above(fig, handles, ncols=3, title=f"{ETA_TITLE} and speed of the gripper")
    if np.all(data["synthetic"].values == 1.0):
        note(top, "synthetic recordings; lines: $\\lambda_c$ without friction")
    note(bottom, "measured less $\\lambda_c$; bars: 95 % intervals")
    return fig

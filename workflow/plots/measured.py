"""lambda measured in recordings over the gripper height, with the frictionless model's lambda_c."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import ETA_TITLE, entry, note
from plots.readers import recordings
from stripfold.plots.colours import BLACK
from stripfold.plots.style import CM, MILLI, figure, legend_above, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the model's lambda_c as lines and the measured values as dots with 95 % intervals.

    Below is the distance of each value from the line: friction and the speed of the gripper make the strip snap later.

    ``data`` is the table of measured recordings, over ``recording``.
    """
    fig = figure(5.2)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.3))
    speeds = np.unique(np.round(data["speed"].values, 4))
    handles = []
    for eta, look, part in recordings(data):
        z, first = np.unique(part["height"].values, return_index=True)
        top.plot(CM * z, CM * part["lambda_model"].values[first], color=look.color, lw=1.0)
        for speed in speeds:
            some = part.isel(recording=(np.round(part["speed"].values, 4) == speed) & (part["snapped"].values == 1.0))
            names = ("height", "lambda_event", "lambda_low", "lambda_high", "lambda_model")
            z, event, low, high, model = (CM * some[name].values for name in names)
            fill = look.color if speed == speeds[0] else "white"
            # Small and filled in large and open: above both speeds are nearly at one place.
            size = 2.5 if speed == speeds[0] else 5.5
            options = {"fmt": look.marker, "color": look.color, "mfc": fill, "ms": size, "capsize": 1.5, "lw": 0.8}
            options["zorder"] = 4 if speed == speeds[0] else 3
            for ax, y in ((top, event), (bottom, event - model)):
                ax.errorbar(z, y, yerr=[event - low, high - event], **options)
        handles.append(entry(f"{eta:.5g}", look.color, marker=look.marker, ms=3.5, lw=1.0))
    bottom.axhline(0.0, color=BLACK, lw=0.8)
    top.set(ylabel=r"$\lambda$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    bottom.set(ylabel=r"$\lambda - \lambda_c$ [cm]", xlabel="gripper height $z$ [cm]")
    for i, speed in enumerate(speeds):
        fill = "white" if i else BLACK
        size = 5.5 if i else 2.5
        handles.append(entry(f"{MILLI * speed:.2g} mm/s", BLACK, "none", marker="o", mfc=fill, ms=size))
    legend_above(fig, handles, ncols=3, title=ETA_TITLE)
    if np.all(data["synthetic"].values == 1.0):
        note(top, "synthetic recordings; lines: $\\lambda_c$ without friction")
    return fig

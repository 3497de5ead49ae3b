"""lambda measured in recordings over the gripper height, with the frictionless model's lambda_c."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.plots.materials import ETA_TITLE
from stripfold.plots.style import BLACK, CM, figure, look, note, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the model's lambda_c as lines and the measured values as dots with 95 % intervals.

    Below is how far each value lies above the line: friction and the speed of the gripper make the strip snap later.

    Parameters
    ----------
    data
        Over ``recording`` (:mod:`studies.recordings`).
    """
    fig = figure(5.2)
    ax, above = fig.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.3))
    speeds = np.unique(np.round(data["speed"].values, 4))
    for index, eta in enumerate(np.unique(data["eta_b"].values)):
        part = data.isel(recording=np.flatnonzero(data["eta_b"].values == eta)).sortby("height")
        how = look(index)
        z, first = np.unique(part["height"].values, return_index=True)
        ax.plot(CM * z, CM * part["lambda_model"].values[first], color=how.colour, lw=1.0)
        for speed in speeds:
            rows = np.flatnonzero((np.round(part["speed"].values, 4) == speed) & (part["snapped"].values == 1.0))
            some = part.isel(recording=rows)
            event, low, high = (CM * some[name].values for name in ("lambda_event", "lambda_low", "lambda_high"))
            options = {
                "fmt": how.marker,
                "color": how.colour,
                "mfc": how.colour if speed == speeds[0] else "white",
                "ms": 3.5,
                "capsize": 1.5,
                "lw": 0.8,
            }
            bars = [event - low, high - event]
            ax.errorbar(CM * some["height"].values, event, yerr=bars, **options)
            model = CM * some["lambda_model"].values
            above.errorbar(CM * some["height"].values, event - model, yerr=bars, **options)
    above.axhline(0.0, color=BLACK, lw=0.8)
    ax.set(ylabel=r"$\lambda$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    above.set(ylabel=r"$\lambda - \lambda_c$ [cm]", xlabel="gripper height $z$ [cm]")
    handles = [
        Line2D([], [], color=look(i).colour, marker=look(i).marker, ms=3.5, lw=1.0, label=f"{eta:.5g}")
        for i, eta in enumerate(np.unique(data["eta_b"].values))
    ]
    handles += [
        Line2D([], [], color=BLACK, marker="o", mfc=fill, ms=3.5, lw=0.0, label=f"{1e3 * speed:.2g} mm/s")
        for speed, fill in zip(speeds, (BLACK, "white", "white"), strict=False)
    ]
    fig.legend(handles=handles, title=ETA_TITLE, loc="outside upper center", ncols=3)
    if np.all(data["synthetic"].values == 1.0):
        note(ax, "synthetic recordings")
    return fig

"""What measured values are worth: their errors against the standard deviation that they claim."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from stripfold.plots.style import BLACK, BLUE, GREY, RED, figure, note, styled
from stripfold.vision.measure import COVERED
from studies.recordings_accuracy import MEASURED, error


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error of lambda in each synthetic recording with its interval, and the share that holds the truth.

    Parameters
    ----------
    data
        Over ``case`` (:mod:`studies.recordings_accuracy`).
    """
    measured = data["outcome"].values == MEASURED
    off, sd = 1e3 * error(data), 1e3 * data["sd"].values[measured]
    flagged = data["flags"].values[measured] != ""
    inside = np.abs(off) <= COVERED * sd
    fig = figure(4.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.5, 1.0))
    order = np.argsort(sd)
    rank = np.arange(len(off))
    colours = np.where(inside[order], BLUE, RED)
    limit = 1.1 * float(np.quantile(np.abs(off) + COVERED * sd, 0.97)) if len(off) else 1.0
    top.vlines(rank, (off - COVERED * sd)[order], (off + COVERED * sd)[order], colors=colours, lw=0.7)
    top.scatter(rank, np.clip(off[order], -limit, limit), s=3.0, c=colours, zorder=3)
    top.axhline(0.0, color=BLACK, lw=0.8)
    top.set(ylim=(-limit, limit), ylabel=r"error of $\lambda$ [mm]", xlabel="recordings, by their claimed deviation")
    held = f"{100.0 * inside.mean():.1f} % of " if len(off) else ""
    note(top, f"95 % intervals: {held}{len(off)} hold the truth")
    z = np.clip(off / sd, -5.0, 5.0)
    bins = np.linspace(-5.0, 5.0, 41)
    bottom.hist([z[~flagged], z[flagged]], bins, stacked=True, color=[BLUE, GREY], label=["no flag", "flagged"])
    x = np.linspace(-5.0, 5.0, 201)
    bottom.plot(x, len(z) * (bins[1] - bins[0]) * np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi), color=BLACK, lw=0.8)
    bottom.set(xlabel="error / claimed standard deviation", ylabel="recordings", xlim=(-5.0, 5.0))
    bottom.legend(loc="upper right")
    return fig

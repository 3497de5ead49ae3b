"""Errors of measured values against the standard deviation that the measurement states."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from scipy import stats

from stripfold.base.arrays import Mask
from stripfold.draw.colours import BLACK, BLUE, GREY, SKY, VERMILLION
from stripfold.draw.style import MILLI, figure, styled
from stripfold.film.measurement import WARNING, half_width
from verification.recordings_accuracy import MEASURED, error

LINEAR = 0.3
"""Errors below are drawn on a linear scale, larger ones on a logarithmic one, mm."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the error of lambda in each synthetic recording with its interval, and the share that holds the truth.

    ``data`` is over ``case`` (:mod:`verification.recordings_accuracy`).
    """
    measured = data["outcome"].values == MEASURED
    order = np.argsort(data["sd"].values[measured])
    off, sd = (MILLI * values[order] for values in (error(data), data["sd"].values[measured]))
    warned = np.array([WARNING in text for text in data["flags"].values[measured][order]], dtype=bool)
    half, rank = half_width(0.95) * sd, np.arange(len(off))
    inside = np.abs(off) <= half
    colours = np.where(inside, GREY, VERMILLION)
    fig = figure(4.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.5, 1.0))
    limit = 1.1 * float((np.abs(off) + half).max()) if len(off) else 1.0
    top.vlines(rank, off - half, off + half, colors=colours, lw=0.7)
    top.scatter(rank, off, s=3.0, c=np.where(inside, BLACK, VERMILLION), zorder=3)
    top.axhline(0.0, color=BLACK, lw=0.8)
    top.set_yscale("symlog", linthresh=LINEAR)
    top.set_yticks([sign * 10.0**power for power in range(-1, 4) for sign in (-1.0, 1.0)] + [0.0])
    top.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    top.set(ylim=(-limit, limit), ylabel=r"error of $\lambda$ [mm]", xlabel="recordings, ordered by standard deviation")
    generator = data["generator"].values[measured][order]
    shares = {name: _share(inside[generator == name]) for name in np.unique(generator)}
    apart = ", ".join(f"{name}: {share}" for name, share in shares.items())
    said = f"95 % intervals: {_share(inside)} hold the truth\n({apart})" if len(off) else "nothing was measured"
    top.set_title(said, loc="left", fontsize=7)
    z, bins = off / sd, np.linspace(-5.0, 5.0, 41)
    shown = np.clip(z, bins[0], bins[-1])  # beyond: in the outermost bin
    bottom.hist([shown[~warned], shown[warned]], bins, stacked=True, color=[BLUE, SKY], label=["no warning", "warning"])
    x = np.linspace(-5.0, 5.0, 201)
    area = len(z) * (bins[1] - bins[0])
    bottom.plot(x, area * stats.norm.pdf(x), color=BLACK, lw=1.0, label="normal, as stated")
    bottom.set(xlabel="error / standard deviation", ylabel="recordings", xlim=(-5.0, 5.0))
    bottom.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=7)
    return fig


def _share(inside: Mask) -> str:
    return f"{100.0 * inside.mean():.1f} % of {len(inside)}"

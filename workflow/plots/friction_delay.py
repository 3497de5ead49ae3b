"""How bending friction delays the snap, and the friction from which on there is none."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import entry, look, note
from stripfold.draw.colours import BLACK, FRICTION, GREY, SHADE
from stripfold.draw.style import figure, styled

LINES = ("-", "--", "-.", ":")


@styled
def draw(data: xr.Dataset, fabrics: xr.Dataset, friction: xr.Dataset) -> Figure:
    """Draw (a) the rise of lambda over M_0 at each height, (b) over the height the M_0 from which on nothing snaps.

    ``data`` is from :func:`verification.friction_delay.run`, ``fabrics`` from :func:`verification.fabrics.run`,
    ``friction`` from :func:`tasks.friction.table`.
    """
    fig = figure(5.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.5, 1.0))
    needed = friction["suffices"].sel(law="hysteresis").values
    real = fabrics["friction"].values
    with_friction = data.isel(moment=slice(1, None)).sortby("gripper_height")
    moment = with_friction["moment"].values
    for i, height in enumerate(with_friction["gripper_height"].values):
        one, (color, _) = with_friction.sel(gripper_height=height), look(i)
        snaps, rise = one["outcome"].values == 1.0, one["rise"].values
        top.plot(moment, rise, ls=LINES[i % len(LINES)], color=color, label=f"$z = {height:g}\\,L^*$")
        top.plot(moment[snaps], rise[snaps], "o", color=color, ms=4, label="_snap")
        top.plot(moment[~snaps], rise[~snaps], "o", color=color, ms=4, mfc="white", label="_touch")
    law = float(with_friction["coefficient"].max())
    top.plot(moment, law * moment, color=GREY, lw=0.6, label="_law")
    top.set(xscale="log", yscale="log", ylabel=r"rise of $\lambda\,/\,L^*$", ylim=(0.01, 20.0))
    marks = [entry("snap", BLACK, "", marker="o", ms=4), entry("touch", BLACK, "", marker="o", ms=4, mfc="white")]
    handles, _ = top.get_legend_handles_labels()
    small = entry("small $M_0$, highest $z$", GREY, lw=0.6)
    fig.legend(handles=[*handles, *marks, small], fontsize=7, loc="outside upper center", ncols=3)
    order = data.sortby("gripper_height")
    limits = np.array([order["vanishes_above"].values, order["vanishes_below"].values])
    bottom.vlines(order["gripper_height"].values, *limits, color=BLACK, lw=2.0, label="_brackets")
    bottom.plot(order["gripper_height"].values, np.sqrt(limits.prod(axis=0)), color=BLACK, label="_vanishing")
    bottom.set(yscale="log", xlabel="$z\\,/\\,L^*$", ylabel=MOMENT.split(": ")[1], ylim=(0.003, 3.0))
    for ax, span in ((top, Axes.axvspan), (bottom, Axes.axhspan)):
        span(ax, real.min(), real.max(), color=SHADE, lw=0.0, zorder=0)
        span(ax, np.nanmin(needed), np.nanmax(needed), color=FRICTION, alpha=0.5, lw=0.0, zorder=0)
    top.set_xlabel(MOMENT.split(": ")[1])
    middle = float(order["gripper_height"].mean())
    bottom.text(middle, np.sqrt(real.min() * real.max()), "fabrics", ha="center", va="center")
    bottom.text(middle, 0.0045, "an R-path needs", ha="center", va="center", color=BLACK)
    bottom.text(float(order["gripper_height"].max()), 0.04, "snap", ha="right")
    bottom.text(float(order["gripper_height"].min()), 0.13, "touch without a snap", ha="left")
    note(top, "(a)")
    note(bottom, "(b)")
    return fig

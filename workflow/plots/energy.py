"""The energies of a fall over time, and the error of their balance."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.base.progress import FALL
from stripfold.draw.collapse_curve import Collapse, collapse, require
from stripfold.draw.colours import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, SKY, VERMILLION
from stripfold.draw.style import MILLI, figure, styled, text_at

STACKED = {
    "kinetic": ("kinetic", GREEN),
    "air": ("dissipated: air", SKY),
    "viscous": ("dissipated: fabric", ORANGE),
    "contact": ("dissipated: impacts", PINK),
    "numerical": ("dissipated: scheme", GREY),
}
TITLES = ("(a) elastic and gravity energy since the start", "(b) the energy released", "(c) error of the balance")


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw over the time of the fall: (a) elastic and gravity energy, (b) what became of them, (c) the closing error.

    All per width and relative to the start of the fall.  Dissipation is stacked on the kinetic energy: together they
    reach the line of what elasticity and gravity released and the gripper gave.

    ``data`` is from :func:`stripfold.ask.collapse.run`.
    """
    found = collapse(data)
    names = ("elastic", "gravity", "work", "closing", *STACKED)
    require(data, names, "a collapse with its energies")
    fall = data.isel(state=found.part(FALL))
    time, e = fall["time"].values, {name: MILLI * fall[name].values for name in names}
    gained = {name: e[name] - e[name][0] for name in ("elastic", "gravity")}
    released = e["work"] - gained["elastic"] - gained["gravity"] + e["kinetic"][0]
    error = np.abs(e["closing"]) / max(float(np.abs(values).max()) for values in gained.values())

    fig = figure(5.0)
    top, middle, bottom = axes = fig.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.25, 0.6))
    top.plot(time, gained["elastic"], color=VERMILLION, label="elastic")
    top.plot(time, gained["gravity"], color=BLUE, label="gravity")
    labels, colours = zip(*STACKED.values(), strict=True)
    middle.stackplot(time, *(e[name] for name in STACKED), colors=colours, labels=labels, lw=0.0)
    middle.plot(time, released, color=BLACK, lw=0.9, label="released")
    bottom.semilogy(time, np.where(error > 0.0, error, np.nan), color=BLACK, lw=0.8, label="_closing")
    bottom.set(xlabel="time since the start of the fall [s]", ylabel="relative to (a)", xlim=(0.0, 1.03 * time[-1]))
    top.legend(loc="upper left")
    middle.legend(loc="upper left", reverse=True, fontsize=7, labelspacing=0.3)
    for ax, title in zip(axes, TITLES, strict=True):
        ax.set_title(title)
    for ax in (top, middle):
        ax.set_ylabel("energy [mJ m$^{-1}$]")
    fig.align_ylabels()
    _events(axes, found)
    return fig


def _events(axes: tuple[Axes, ...], found: Collapse) -> None:
    """Lines at the touch and at rest, named in the first panel."""
    for name, text, time in (("touch", "touch", found.touch_time), ("settle", "at rest", found.settle_time)):
        if np.isnan(time):
            continue
        for ax in axes:
            ax.axvline(time, color=BLACK, lw=0.7, ls="--", zorder=4, label=f"_{name}")
        middle = 0.5 * sum(axes[0].get_ylim())
        text_at(axes[0], (time, middle), f"{text}\n{time:.2f} s", (-3, 0), ha="right", va="center")

"""The energies of a fall over time, and what their balance lacks."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.analysis.phases import FALL
from stripfold.errors import InvalidInputError
from stripfold.plots.phases import Collapse, collapse
from stripfold.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, figure, styled

MILLI = 1000.0
"""Millijoules in a joule."""
LOSSES = {
    "air": ("lost: air", SKY),
    "viscous": ("lost: fabric", ORANGE),
    "contact": ("lost: impacts", PURPLE),
    "numerical": ("lost: scheme", GREY),
}
ENERGIES = ("kinetic", "elastic", "gravity", "work", *LOSSES, "closing")


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw over the time of the fall: (a) elastic and gravity energy, (b) what became of them, (c) the closing error.

    All per width and relative to the start of the fall.  Losses are stacked on the kinetic energy: together they reach
    the line of what elasticity and gravity released and the gripper gave.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.collapse_data.run`.
    """
    found = collapse(data)
    missing = [name for name in ENERGIES if name not in data]
    if missing:
        raise InvalidInputError("data", f"a collapse without {', '.join(missing)}", "one with its energies")
    fall = data.isel(state=found.part(FALL))
    time = fall["time"].values
    e = {name: MILLI * fall[name].values for name in ENERGIES}
    gained = {name: e[name] - e[name][0] for name in ("elastic", "gravity")}

    fig = figure(5.0)
    top, middle, bottom = fig.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.25, 0.6))
    top.plot(time, gained["elastic"], color=VERMILLION, label="elastic")
    top.plot(time, gained["gravity"], color=BLUE, label="gravity")
    released = e["work"] - gained["elastic"] - gained["gravity"] + e["kinetic"][0]
    names = [label for label, _ in LOSSES.values()]
    colours = [colour for _, colour in LOSSES.values()]
    parts = [e["kinetic"], *(e[name] for name in LOSSES)]
    middle.stackplot(time, *parts, colors=[GREEN, *colours], labels=["kinetic", *names], lw=0.0)
    middle.plot(time, released, color=BLACK, lw=0.9, label="released")
    exchanged = max(float(np.abs(values).max()) for values in gained.values())
    error = np.abs(e["closing"]) / exchanged
    bottom.semilogy(time, np.where(error > 0.0, error, np.nan), color=BLACK, lw=0.8, label="_closing")
    bottom.set(xlabel="time since the start of the fall [s]", ylabel="share of (a)", xlim=(0.0, 1.03 * time[-1]))
    top.legend(loc="upper left")
    middle.legend(loc="upper left", reverse=True, fontsize=7, labelspacing=0.3)
    titles = ("(a) elastic and gravity energy since the start", "(b) what they released", "(c) what the balance lacks")
    for ax, text in zip((top, middle, bottom), titles, strict=True):
        ax.set_title(text, loc="left")
    for ax in (top, middle):
        ax.set_ylabel("energy [mJ m$^{-1}$]")
    fig.align_ylabels()
    _moments((top, middle, bottom), found)
    return fig


def _moments(axes: tuple[Axes, ...], found: Collapse) -> None:
    """Lines at the touch and at rest, named in the first panel."""
    for name, text, time in (("touch", "touch", found.touch_time), ("settle", "at rest", found.settle_time)):
        if np.isnan(time):
            continue
        for ax in axes:
            ax.axvline(time, color=BLACK, lw=0.7, ls="--", zorder=4, label=f"_{name}")
        at = (time, 0.5)
        axes[0].annotate(
            f"{text}\n{time:.2f} s",
            at,
            (-3, 0),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="right",
            va="center",
        )

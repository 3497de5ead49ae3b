"""Error of the end of the advance against the time it takes, for models and meshes, at several heights."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.plots.style import BLACK, BLUE, GREEN, GREY, PURPLE, VERMILLION, Look, figure, note, styled

LOOKS = {
    "elastica": Look(GREEN, "^"),
    "rod": Look(BLUE, "o"),
    "rod, nodes": Look(PURPLE, "D"),
    "solid": Look(VERMILLION, "s"),
    "solid, from lambda_0": Look(BLACK, "v"),
}
NAMES = {"solid, from lambda_0": r"solid, from $\lambda_0$"}
LEAST = 1e-7
"""Smaller errors are drawn here: the reference is no better."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw |error| over seconds, a panel per height, with the front of what nothing else beats; last, over memory.

    Open markers: elements of order one, or two elements across the thickness.  Dotted: how well the reference is known.

    Parameters
    ----------
    data
        From :func:`studies.accuracy.run`.
    """
    count = data.sizes["height"]
    rows = count // 2 + 1
    fig = figure(2.4 * rows + 0.5, 7.0)
    panels = fig.subplots(rows, 2, squeeze=False, sharey=True).ravel()
    kinds = data["kind"].values
    plain = (data["order"].values == 2.0) & (data["across"].values == 1.0)
    columns = [*data["seconds"].values.T, data["way_memory"].values]
    for j, (ax, price) in enumerate(zip(panels, columns, strict=False)):
        at = min(j, count - 1)
        height = data["height"].values[at]
        error = np.maximum(np.abs(data["error"].values[:, at]), LEAST)
        for kind, how in LOOKS.items():
            for filled in (True, False):
                of = (kinds == kind) & (plain == filled)
                face = how.colour if filled else "white"
                name = NAMES.get(kind, kind) if filled and j == 0 and of.any() else None
                ax.plot(price[of], error[of], how.marker, color=how.colour, mfc=face, label=name)
        draw_front(ax, price, error, max(float(data["uncertain"].values[at]), LEAST))
        of_time = j < count
        ax.set(xscale="log" if of_time else "linear", yscale="log", xlabel="time, s" if of_time else "peak memory, MB")
        what = r"$\lambda_c$" if data["snaps"].values[at] else "first touch"
        note(ax, f"({'abcdefgh'[j]}) $z = {height:g}\\,L^*$, {what}", loc="upper right")
    for ax in panels[count + 1 :]:
        ax.set_axis_off()
    for ax in panels[1:count]:
        ax.sharex(panels[0])
    low, high = panels[0].get_ylim()
    panels[0].set_ylim(low, high * (high / low) ** 0.12)
    fig.supylabel(r"error of $\lambda$, relative", fontsize=9.0)
    fig.legend(loc="outside upper center", ncols=len(LOOKS), fontsize=7.0)
    return fig


def draw_front(ax: Axes, price: Array, error: Array, uncertain: float) -> None:
    """Draw the front of what nothing else beats, grey, and dotted how well the reference is known."""
    best = front(price, np.where(np.isfinite(error), error, np.inf))
    ax.step(price[best], error[best], where="post", color=GREY, lw=1.0, zorder=1)
    ax.axhline(uncertain, color=GREY, ls=":", lw=0.8)


def front(seconds: Array, error: Array) -> NDArray[np.intp]:
    """Indices of the ways, shape (n,) each, that no other is both faster and nearer than, fastest first."""
    best, kept = np.inf, []
    for i in np.lexsort((error, seconds)):
        if np.isfinite(seconds[i]) and error[i] < best:
            best = error[i]
            kept.append(int(i))
    return np.array(kept, dtype=np.intp)

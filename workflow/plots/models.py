"""Pieces that several figures of studies share: one look for each model, the Pareto front."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from plots.pieces import Look
from stripfold.base.arrays import Array, Index
from stripfold.draw.colours import BLUE, GREEN, GREY, VERMILLION

LOOKS = {"elastica": Look(GREEN, "^"), "rod": Look(BLUE, "o"), "solid": Look(VERMILLION, "s")}


def draw_pareto(ax: Axes, cost: Array, error: Array, uncertain: float) -> None:
    """Draw the Pareto front of cost and error in grey, and dotted the uncertainty of the reference."""
    best = pareto(cost, np.where(np.isfinite(error), error, np.inf))
    ax.step(cost[best], error[best], where="post", color=GREY, lw=1.0, zorder=1)
    ax.axhline(uncertain, color=GREY, ls=":", lw=0.8)


def pareto(cost: Array, error: Array) -> Index:
    """Indices of the runs, shape (n,) each, that no other beats in both, cheapest first."""
    order = [int(i) for i in np.lexsort((error, cost)) if np.isfinite(cost[i])]
    least = np.minimum.accumulate([np.inf, *error[order]])
    return np.array([i for i, before in zip(order, least, strict=False) if error[i] < before], dtype=np.intp)


def plain_numbers(axis: Axis) -> None:
    """Label a logarithmic axis of about a decade at 1, 2 and 5; labels of minor ticks would overlap."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def headroom(ax: Axes, share: float) -> None:
    """Room above what is drawn on a logarithmic axis, as a share of its decades, for a note."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high * (high / low) ** share)

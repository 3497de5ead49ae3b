"""Pieces that only these figures share, beside those of :mod:`stripfold.draw.style`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.offsetbox import AnchoredText
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from stripfold.base.arrays import Array, Index
from stripfold.draw.colours import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, SKY, VERMILLION
from stripfold.draw.style import CM, WIDTH, Point, Span

ETA_TITLE = r"$\eta_b$ [m$^{-4}$ s$^2$]"
"""Name and unit of the weight-to-bending-stiffness ratio."""


class Look(NamedTuple):
    """Colour and marker of an entry of a legend."""

    color: str
    marker: str


LENGTH_TITLE = "length of the strip$\\,/\\,L^*$"
PATH_LOOKS = {
    "r-path": ("R-path", Look(BLACK, "o")),
    "triangular": ("triangular path", Look(SKY, "^")),
    "circular": ("circular path", Look(PINK, "D")),
}
"""Name and look of each folding path where results of all three are compared."""
PATH_STYLES = {"r-path": "-", "triangular": "--", "circular": ":"}
"""Their kinds of line."""

_COLOURS = (BLUE, VERMILLION, GREEN, PINK, ORANGE, SKY, BLACK)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "p")


def look(index: int) -> Look:
    """Look of the material at ``index`` of its dataset; a repeated colour has another marker."""
    return Look(_COLOURS[index % len(_COLOURS)], _MARKERS[index % len(_MARKERS)])


def speed_mark(speed: int, color: str) -> dict[str, Any]:
    """Options of marks by the index of their speed: small and filled is seen in large and open at the same place."""
    fill, size = ("white", 5.5) if speed else (color, 2.5)
    return {"mfc": fill, "ms": size, "mew": 0.8, "zorder": 3 if speed else 4}


def drawings(xlim: Span, ylims: Sequence[Span], titles: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """Panels below each other without axes that fill the figure; equal scales, a title at the upper left."""
    heights = [high - low for low, high in ylims]
    fig = Figure(figsize=(WIDTH, WIDTH * sum(heights) / (xlim[1] - xlim[0])))
    fill = {"left": 0, "right": 1, "bottom": 0, "top": 1, "hspace": 0}
    axes = fig.subplots(len(ylims), 1, height_ratios=heights, gridspec_kw=fill)
    for ax, ylim, title in zip(axes, ylims, titles, strict=True):
        ax.set(aspect="equal", xlim=xlim, ylim=ylim)
        ax.axis("off")
        ax.annotate(title, (0, 1), (4, -3), xycoords="axes fraction", textcoords="offset points", va="top")
    return fig, list(axes)


def draw_states(ax: Axes, states: Iterable[Array], name: str, **options: Any) -> None:
    """Draw mid-surfaces, shape (n, 2) each, m; ``name`` is a label that no legend shows."""
    for state in states:
        ax.plot(*(CM * state).T, **{"lw": 0.8} | options, label=f"_{name}")


def entry(label: str, color: str, ls: Any = "-", **options: Any) -> Line2D:
    """An entry of a legend."""
    return Line2D([], [], color=color, ls=ls, label=label, **options)


def path_entries() -> list[Line2D]:
    """Entries of a legend for the three folding paths."""
    return [
        entry(text, how.color, PATH_STYLES[name], marker=how.marker, lw=0.9) for name, (text, how) in PATH_LOOKS.items()
    ]


def arrow(ax: Axes, tail: Point, head: Point, **options: Any) -> None:
    """An arrow from ``tail`` to ``head``, data coordinates."""
    look = {"arrowstyle": "-|>", "lw": 0.8, "color": BLACK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8} | options
    ax.annotate("", xy=(head[0], head[1]), xytext=(tail[0], tail[1]), arrowprops=look, zorder=5)


def note(ax: Axes, text: str, loc: str = "upper left") -> None:
    """Small text in a corner of ``ax``."""
    box = AnchoredText(text, loc=loc, frameon=False, pad=0.2, borderpad=0.2, prop={"size": 8.0})
    box.set_zorder(5)
    ax.add_artist(box)


MODEL_LOOKS = {"elastica": Look(GREEN, "^"), "rod": Look(BLUE, "o"), "solid": Look(VERMILLION, "s")}


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
    """Label a logarithmic axis at 1, 2 and 5, one of more than two decades at 1: others would overlap."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def headroom(ax: Axes, share: float) -> None:
    """Room above what is drawn on a logarithmic axis, as a share of its decades, for a note."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high * (high / low) ** share)

"""The x-axis motion: states from lambda_0 to the critical point, and unstable ones past it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.arrays import Array
from stripfold.plots.states import Branch, branch
from stripfold.plots.style import BLACK, BLUE, CM, UNSTABLE, equal, floor, styled

STATES, UNSTABLE_STATES = 9, 2
"""Largest numbers of states drawn between lambda_0 and lambda_c, and past it."""


@styled
def draw(data: xr.Dataset, height: float | None = None) -> Figure:
    """Draw mid-surfaces along the branch of one gripper height: stable ones solid, unstable ones dashed.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.x_axis.run`.
    height
        Gripper height, m; the nearest one with a snap is drawn, by default the one nearest 5 L*.
    """
    chosen = branch(data, height)
    half = 0.5 * CM * float(data.attrs["length"])
    # As wide as the states need: all of a strip that lies flat tells nothing.
    left = min(CM * float(state[:, 0].min()) for state in chosen.states)
    gripper = CM * float(chosen.states[chosen.critical][0, 0])
    right = min(half, gripper + 0.4 * (gripper - left))
    margin = 0.04 * (right - left)
    limits = (left - margin, right + margin), (-margin, 1.12 * CM * chosen.height + 2.0 * margin)
    fig, ax = equal(*limits, above=0.25)
    _states(ax, chosen)
    _path(ax, chosen)
    ax.set(xlabel="$x$ [cm]", ylabel="$z$ [cm]")
    ax.grid(visible=False)
    floor(ax)
    handles = [
        Line2D([], [], color="0.55", lw=0.9, label="stable"),
        Line2D([], [], color=UNSTABLE, lw=0.9, ls="--", label="unstable"),
    ]
    fig.legend(handles=handles, loc="upper center", borderaxespad=0.3, ncols=2)
    return fig


def _states(ax: Axes, chosen: Branch) -> None:
    first, last = 0, chosen.critical
    between = chosen.evenly(first, last, STATES)
    # From light to dark as the gripper advances.
    for shade, i in zip(np.linspace(0.82, 0.5, len(between)), between, strict=True):
        ax.plot(*(CM * chosen.states[i]).T, color=str(shade), lw=0.9, zorder=2)
    for i, name in ((first, "lambda_0"), (last, "lambda_c")):
        ax.plot(*(CM * chosen.states[i]).T, color=BLACK, lw=1.5, zorder=4, label=f"_{name}")
    past = np.flatnonzero(~chosen.stable)
    if len(past):
        end = len(chosen.stable) - 1
        for i in [*chosen.evenly(last, end, UNSTABLE_STATES - 1), end]:
            ax.plot(*(CM * chosen.states[i]).T, color=UNSTABLE, lw=0.9, ls="--", zorder=3)


def _path(ax: Axes, chosen: Branch) -> None:
    """The gripper's way and the names of its ends."""
    start, end = chosen.states[0][0], chosen.states[chosen.critical][0]
    gripper(ax, start, end)
    for point, text in ((start, r"$\lambda_0$"), (end, r"$\lambda_c$")):
        above(ax, point, text)


def gripper(ax: Axes, start: Array, end: Array, label: Array | None = None) -> None:
    """The gripper's way between two points, m, as an arrow that tells its height, halfway or over ``label``."""
    a, b = CM * start, CM * end
    arrow = {"arrowstyle": "-|>", "lw": 1.2, "color": BLUE, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}
    ax.annotate("", xy=(b[0], b[1]), xytext=(a[0], a[1]), arrowprops=arrow, zorder=5)
    above(ax, 0.5 * (start + end) if label is None else label, f"gripper, $z$ = {a[1]:.1f} cm", BLUE)
    ax.plot(*a, "o", ms=3, color=BLUE, zorder=6, label="_gripper")


def above(ax: Axes, point: Array, text: str, colour: str = BLACK) -> None:
    """Text over a point, m."""
    at = (CM * float(point[0]), CM * float(point[1]))
    ax.annotate(text, at, (0, 4), textcoords="offset points", ha="center", va="bottom", color=colour)

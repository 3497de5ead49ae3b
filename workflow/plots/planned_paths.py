"""The paper's three folding paths, and the states assumed in planning them."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from plots.path_readers import Part, planned
from plots.pieces import draw_states, entry, note
from stripfold.draw.colours import FIXED, GRIPPER
from stripfold.draw.style import CM, Limits, around, equal_panels, legend_above, styled

TITLES = {"triangular": "(a) triangular path", "circular": "(b) circular path", "r-path": "(c) R-path"}
STATES = 9
"""Number of states drawn on each path, the flat strip among them."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each path dashed, the states assumed on it solid, from light to dark, and a blue mark at the fold line.

    ``data`` is from :func:`tasks.plans.dataset`.
    """
    plans = [planned(data, name) for name in TITLES]
    fig, axes = equal_panels([limits([plan]) for plan in plans], above=0.25, one_x=True)
    for ax, plan, title in zip(axes, plans, TITLES.values(), strict=True):
        shown = plan.evenly(STATES)
        for shade, i in zip(np.linspace(0.78, 0.0, len(shown)), shown, strict=True):
            draw_states(ax, plan.states[[i]], "state", color=str(shade), lw=1.0, zorder=3, clip_on=False)
        path = draw_path(ax, plan)
        ax.plot(0.0, 0.0, marker=CARETUP, color=FIXED, ms=7, mew=0, zorder=6, label="_fold-line")
        note(ax, title)
    fold = entry("fold line", FIXED, "none", marker="^", ms=5, mew=0)
    legend_above(fig, [path, entry("assumed states", "0.4", lw=1.0), fold], ncols=3)
    return fig


def draw_path(ax: Axes, plan: Part) -> Line2D:
    """Draw the gripper's path; returns its entry of a legend."""
    draw_states(ax, [plan.states[:, 0]], "path", color=GRIPPER, ls="--", zorder=1.5)
    return entry("gripper path", GRIPPER, "--", lw=0.8)


def limits(shown: list[Part]) -> Limits:
    """Limits of x and z, cm, that show all states, with room for a note above them."""
    return around(CM * np.concatenate([part.states.reshape(-1, 2) for part in shown]), 0.04, 0.024)

"""The paper's three folding paths, and the states that each takes for granted."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from stripfold.plots.followed import Part, planned
from stripfold.plots.style import BLACK, BLUE, CM, Limits, equal_panels, floor, note, styled

TITLES = {
    "triangular": "(a) triangular path",
    "circular": "(b) circular path",
    "r-path": "(c) R-path",
}
STATES = 9
"""Number of states drawn on each path, the flat strip among them."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw each path dashed, the states assumed on it solid, from light to dark, and a blue mark at the fold line.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.plans.dataset`.
    """
    fig, axes = equal_panels([limits([planned(data, name)]) for name in TITLES], above=0.25, one_x=True)
    for ax, (name, title) in zip(axes, TITLES.items(), strict=True):
        plan = planned(data, name)
        chosen = plan.evenly(STATES)
        for shade, i in zip(np.linspace(0.78, 0.0, len(chosen)), chosen, strict=True):
            ax.plot(*(CM * plan.states[i]).T, color=str(shade), lw=1.0, zorder=3, clip_on=False, label="_state")
        ax.plot(*(CM * plan.states[:, 0]).T, "--", color=BLACK, lw=0.8, zorder=2, label="_path")
        ax.plot(0.0, 0.0, marker=CARETUP, color=BLUE, ms=7, mew=0, zorder=6, label="_fold-line")
        ax.set(ylabel="$z$ [cm]")
        ax.grid(visible=False)
        floor(ax)
        note(ax, title)
    axes[-1].set_xlabel("$x$ [cm]")
    handles = [
        Line2D([], [], color=BLACK, lw=0.8, ls="--", label="gripper path"),
        Line2D([], [], color="0.4", lw=1.0, label="assumed states"),
        Line2D([], [], color=BLUE, marker="^", ls="none", ms=5, mew=0, label="fold line"),
    ]
    fig.legend(handles=handles, loc="upper center", borderaxespad=0.3, ncols=3, columnspacing=1.2)
    return fig


def limits(shown: list[Part]) -> Limits:
    """What of x and z has to be seen, cm: all states, with room for a note above them."""
    x, z = (CM * np.concatenate([part.states[..., i].ravel() for part in shown]) for i in range(2))
    margin = 0.04 * float(np.ptp(x))
    return (float(x.min()) - margin, float(x.max()) + margin), (-margin, float(z.max()) + 0.6 * margin)

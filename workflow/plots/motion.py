"""The x-axis motion: states from lambda_0 to the critical point, and unstable ones past it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import arrow, draw_states, entry
from plots.readers import branch, evenly
from stripfold.base.arrays import Array
from stripfold.draw.colours import CRITICAL, GRIPPER, UNSTABLE
from stripfold.draw.style import CM, equal_panels, legend_above, styled, text_at

STATES, UNSTABLE_STATES = 9, 2
"""Largest numbers of states drawn between lambda_0 and lambda_c, and past it."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw mid-surfaces along one branch: stable ones solid, unstable ones dashed.

    ``data`` is from :func:`tasks.x_axis.run`; the gripper height nearest 10 L* is drawn.
    """
    chosen = branch(data, 10.0)
    states, last = chosen.states, chosen.critical
    start, end = states[0][0], states[last][0]
    # As wide as the states need: most of the flat part is left out.
    left = min(float(state[:, 0].min()) for state in states)
    right = min(0.5 * float(data.attrs["length"]), float(end[0]) + 0.4 * float(end[0] - left))
    margin = CM * 0.04 * (right - left)
    xlim, ylim = (CM * left - margin, CM * right + margin), (-margin, 1.12 * CM * chosen.height + 2.0 * margin)
    fig, (ax,) = equal_panels([(xlim, ylim)], above=0.25)
    between = evenly(chosen.deflection, 0, last, STATES + 2)[1:-1]
    # From light to dark as the gripper advances.
    for shade, i in zip(np.linspace(0.82, 0.5, len(between)), between, strict=True):
        draw_states(ax, [states[i]], "stable", color=str(shade), lw=0.9, zorder=2)
    for i, name in ((0, "lambda_0"), (last, "lambda_c")):
        draw_states(ax, [states[i]], name, color=CRITICAL, lw=1.5, zorder=4)
    past = evenly(chosen.deflection, last, len(states) - 1, UNSTABLE_STATES + 1)[1:]
    draw_states(ax, [states[i] for i in past], "unstable", color=UNSTABLE, lw=0.9, ls="--", zorder=3)
    draw_gripper(ax, start, end)
    text_at(ax, CM * start, r"$\lambda_0$")
    text_at(ax, CM * end, r"$\lambda_c$")
    legend_above(fig, [entry("stable", "0.55", lw=0.9), entry("unstable", UNSTABLE, "--", lw=0.9)])
    return fig


def draw_gripper(ax: Axes, start: Array, end: Array, label: Array | None = None) -> None:
    """The gripper's way between two points, m, as an arrow with its height, halfway or over ``label``."""
    arrow(ax, CM * start, CM * end, color=GRIPPER, lw=1.2)
    at = CM * (0.5 * (start + end) if label is None else label)
    text_at(ax, at, f"gripper, $z$ = {CM * start[1]:.1f} cm", color=GRIPPER)
    ax.plot(*(CM * start), "o", ms=3, color=GRIPPER, zorder=6, label="_gripper")

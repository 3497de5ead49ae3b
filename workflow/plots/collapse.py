"""The whole x-axis motion, as the paper shows it: statics to the critical point, the fall, statics after it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.motion import draw_gripper
from plots.pieces import draw_states, entry, note
from plots.readers import evenly, travel
from stripfold.base.progress import AFTER, FALL
from stripfold.draw.collapse_curve import Collapse, collapse
from stripfold.draw.colours import CRITICAL, FALLING, SETTLED, STATIC
from stripfold.draw.style import CM, Limits, around, draw_held_end, equal_panels, legend_above, styled, text_at

STATES, TO_TOUCH, TO_REST = 12, 5, 3
"""Largest numbers of states drawn in each static part, in the fall up to the touch, and from there to rest."""
MOVING = 0.25
"""The part of the strip that moves at least this share of the largest displacement in the fall is enlarged."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the fall, large, from the critical state (black) to rest (green); below, all of the motion along x.

    Mid-surfaces are grey before lambda_c, black at it, red in the fall, green after it.

    The states of each part are even in how far the strip moved; in the fall up to the touch and from there to rest.

    ``data`` is from :func:`stripfold.ask.collapse.run`.
    """
    found = collapse(data)
    states, critical = found.states, found.critical
    way = travel(states, data["arc"].values)
    fall, after = found.part(FALL), found.part(AFTER)
    fig, (near, whole) = equal_panels([_limits_of_fall(found), around(CM * states)], above=0.42)
    draw_states(whole, states[evenly(way, 0, critical, STATES + 1)[:-1]], "before", color=STATIC, zorder=2.0)
    if len(after):
        shown = evenly(way, int(after[0]), int(after[-1]), STATES + 1)[1:]
        draw_states(whole, states[shown], "after", color=SETTLED, zorder=2.5)
    shown = evenly(way, int(fall[0]), found.touch, TO_TOUCH + 1)[1:]
    shown += evenly(way, found.touch, int(fall[-1]), TO_REST + 1)[1:]
    for ax, width, thick in ((whole, 0.5, 1.4), (near, 0.7, 2.2)):
        draw_states(ax, states[shown], "fall", color=FALLING, lw=width, zorder=3.0)
        draw_states(ax, states[[critical]], "lambda_c", color=CRITICAL, lw=thick, zorder=4.0)
        if np.isfinite(found.touch_x):
            ax.plot(CM * found.touch_x, 0.0, marker=6, color=FALLING, ms=5, mew=0, zorder=6, label="_touch")
    draw_held_end(whole, found.states[0, -1])
    _gripper(whole, found)
    if np.isfinite(found.settle_time):
        draw_states(near, states[fall[-1:]], "rest", color=SETTLED, lw=2.2, zorder=3.5)
    touch = f": touch ($\\blacktriangle$) after {found.touch_time:.2f} s" if np.isfinite(found.touch_time) else ""
    note(near, f"the fall, gripper held{touch}")
    handles = [
        entry("static, before", STATIC, lw=0.8),
        entry(r"critical state, $\lambda_c$", CRITICAL, lw=2.0),
        entry("fall", FALLING, lw=0.8),
        entry("at rest, and static after", SETTLED, lw=1.4),
    ]
    legend_above(fig, handles if len(after) else handles[:3])
    return fig


def _limits_of_fall(found: Collapse) -> Limits:
    """Limits of the part of the strip that moves in the fall, cm, down to the floor."""
    fall = CM * found.states[found.part(FALL)]
    moved = np.linalg.norm(fall - fall[0], axis=2).max(axis=0)
    return around(fall[:, moved >= MOVING * moved.max()], 0.06, 0.12)


def _gripper(ax: Axes, found: Collapse) -> None:
    start, critical, end = (found.states[i, 0] for i in (0, found.critical, -1))
    # The height over the longer part of the way, clear of the name of lambda_c.
    a, b = max(((start, critical), (critical, end)), key=lambda part: float(part[1][0] - part[0][0]))
    draw_gripper(ax, start, end, label=0.5 * (a + b))
    text_at(ax, CM * start, r"$\lambda_0$")
    text_at(ax, CM * critical, r"$\lambda_c$")

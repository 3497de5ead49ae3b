"""The whole x-axis motion, as the paper shows it: statics to the critical point, the fall, statics after it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.analysis.phases import AFTER, FALL
from stripfold.plots.motion import above, gripper
from stripfold.plots.phases import Collapse, collapse
from stripfold.plots.style import BLACK, CM, FALLING, SETTLED, STATES_GREY, Limits, equal_panels, floor, note, styled

STATIC, TO_TOUCH, TO_REST = 12, 5, 3
"""Largest numbers of states drawn in each static part, in the fall up to the touch, and from there to rest."""
MOVING = 0.25
"""What moves at least this part of the largest displacement in the fall is enlarged."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw mid-surfaces: grey before lambda_c, black at it, red in the fall, green after it; below, the fall enlarged.

    The states of each part are even in how far the strip moved; in the fall up to the touch and from there to rest.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.collapse_data.run`.
    """
    found = collapse(data)
    fig, (whole, near) = equal_panels([limits(found), _limits_of_fall(found)], above=0.42)
    _static(whole, found)
    for ax, width in ((whole, 0.5), (near, 0.9)):
        _fall(ax, found, width)
        ax.set(xlabel="$x$ [cm]", ylabel="$z$ [cm]")
        ax.grid(visible=False)
        floor(ax)
    _gripper(whole, found)
    touch = f"; touch ($\\blacktriangle$) after {found.touch_time:.2f} s" if np.isfinite(found.touch_time) else ""
    note(near, f"the fall, enlarged{touch}")
    fig.legend(handles=_handles(found), loc="upper center", borderaxespad=0.3, ncols=2, columnspacing=1.2)
    return fig


def limits(found: Collapse) -> Limits:
    """What of x and z has to be seen of a motion, cm: all of it, with room for the gripper's name."""
    x, z = CM * found.states[:, :, 0], CM * found.states[:, :, 1]
    margin = 0.03 * float(np.ptp(x))
    return (float(x.min()) - margin, float(x.max()) + margin), (-margin, float(z.max()) + 3.5 * margin)


def _limits_of_fall(found: Collapse) -> Limits:
    """What moves in the fall, cm, down to the floor."""
    fall = CM * found.states[found.part(FALL)]
    moved = np.linalg.norm(fall - fall[0], axis=2).max(axis=0)
    x, z = np.moveaxis(fall[:, moved >= MOVING * moved.max()], 2, 0)
    margin = 0.06 * float(np.ptp(x))
    return (float(x.min()) - margin, float(x.max()) + margin), (-margin, float(z.max()) + 2.0 * margin)


def _show(ax: Axes, found: Collapse, indices: list[int], name: str, colour: str, width: float, order: float) -> None:
    for i in indices:
        ax.plot(*(CM * found.states[i]).T, color=colour, lw=width, zorder=order, label=f"_{name}")


def _static(ax: Axes, found: Collapse) -> None:
    after = found.part(AFTER)
    _show(ax, found, found.evenly(0, found.critical, STATIC + 1)[:-1], "before", STATES_GREY, 0.8, 2.0)
    if len(after):
        indices = found.evenly(int(after[0]), int(after[-1]), STATIC + 1)[1:]
        _show(ax, found, indices, "after", SETTLED, 0.8, 2.5)


def _fall(ax: Axes, found: Collapse, width: float) -> None:
    fall, touch = found.part(FALL), found.touch
    indices = found.evenly(int(fall[0]), touch, TO_TOUCH + 1) + found.evenly(touch, int(fall[-1]), TO_REST + 1)[1:]
    _show(ax, found, indices[1:], "fall", FALLING, width, 3.0)
    _show(ax, found, [found.critical], "lambda_c", BLACK, 1.4, 4.0)
    if np.isfinite(found.touch_x):
        ax.plot(CM * found.touch_x, 0.0, marker=6, color=FALLING, ms=5, mew=0, zorder=6, label="_touch")


def _gripper(ax: Axes, found: Collapse) -> None:
    start, critical, end = found.states[0][0], found.states[found.critical][0], found.states[-1][0]
    # The height in the longer part of the way, clear of the name of lambda_c.
    parts = ((start, critical), (critical, end))
    a, b = max(parts, key=lambda part: float(part[1][0] - part[0][0]))
    gripper(ax, start, end, label=0.5 * (a + b))
    above(ax, start, r"$\lambda_0$")
    above(ax, critical, r"$\lambda_c$")


def _handles(found: Collapse) -> list[Line2D]:
    parts = [
        (STATES_GREY, 0.8, "static, before"),
        (BLACK, 1.4, r"critical state, $\lambda_c$"),
        (FALLING, 0.8, "fall"),
    ]
    if len(found.part(AFTER)):
        parts.append((SETTLED, 0.8, "static, after"))
    return [Line2D([], [], color=colour, lw=width, label=label) for colour, width, label in parts]

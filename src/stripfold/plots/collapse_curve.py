"""The control-parameter/deflection curve through a collapse."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.analysis.phases import AFTER, BEFORE, FALL
from stripfold.plots.deflection import enlarged, level, name_axes
from stripfold.plots.phases import Collapse, collapse
from stripfold.plots.style import BLACK, CM, FALLING, GREY, SETTLED, figure, styled

LABELS = {BEFORE: "static, before", FALL: "fall", AFTER: "static, after"}
COLOURS = {BEFORE: BLACK, FALL: FALLING, AFTER: SETTLED}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda over the deflection: black to lambda_c, red in the fall, green after it.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.collapse_data.run`.
    """
    found = collapse(data)
    fig = figure(3.1)
    ax = fig.subplots()
    ax.grid(visible=False)  # it would run behind the inset's numbers
    right = CM * float(found.deflection.max())
    low, high = CM * found.lambda_0, CM * float(found.advance.max())
    level(ax, "lambda_0", found.lambda_0, 0.12 * right)
    # Label and inset go where the curve leaves room.
    fall_is_high = CM * found.lambda_c > low + 0.6 * (high - low)
    level(ax, "lambda_c", found.lambda_c, 0.0 if fall_is_high else 0.65 * right)
    _curve(ax, found)
    ax.set_xlim(-0.02 * right, 1.05 * right)
    ax.set_ylim(low - 0.07 * (high - low), high + 0.08 * (high - low))
    name_axes(ax)
    title = f"gripper height $z$ = {CM * found.height:.1f} cm"
    fig.legend(loc="outside upper center", ncols=3, columnspacing=1.2, title=title)
    _zoom(ax, found, (0.57, 0.2, 0.4, 0.3) if fall_is_high else (0.1, 0.66, 0.36, 0.3))
    return fig


def _curve(ax: Axes, found: Collapse) -> None:
    for phase, colour in COLOURS.items():
        part = found.part(phase)
        x, y = CM * found.deflection[part], CM * found.advance[part]
        ax.plot(x, y, color=colour, lw=1.5, zorder=3, label=LABELS[phase] if len(part) else "_none")
    critical = found.critical
    ax.plot(CM * found.deflection[critical], CM * found.advance[critical], "o", color=BLACK, ms=3.0, zorder=4)


def _zoom(ax: Axes, found: Collapse, where: tuple[float, float, float, float]) -> None:
    """The fall, in which only a part of the strip moves; the gripper is held a little past lambda_c."""
    fall = found.part(FALL)
    x = CM * found.deflection[fall]
    inset = enlarged(ax, where)
    _curve(inset, found)
    inset.axhline(CM * found.lambda_c, color=SETTLED, lw=1.0, zorder=1)
    wide = float(np.ptp(x))
    inset.set_xlim(x.min() - 0.7 * wide, x.max() + 0.7 * wide)
    y = CM * found.lambda_c
    inset.set_ylim(y - 0.7 * wide, y + 0.7 * wide)
    ax.indicate_inset_zoom(inset, edgecolor=GREY)

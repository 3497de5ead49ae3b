"""The control-parameter/deflection curve of one gripper height."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.readers import Branch, branch
from stripfold.draw.collapse_curve import deflection_axes, enlarged, level, smooth
from stripfold.draw.colours import BLACK, CRITICAL, GREY, LEVEL, UNSTABLE
from stripfold.draw.style import CM, figure, styled


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda over the deflection: stable solid, unstable dashed, lambda_0 and lambda_c in green.

    ``data`` is from :func:`tasks.x_axis.run`; the gripper height nearest 3 L* is drawn.
    """
    chosen = branch(data, 3.0)
    right, low, high = CM * float(chosen.deflection.max()), CM * chosen.lambda_0, CM * chosen.lambda_c
    fig = figure(2.7)
    ax = fig.subplots()
    deflection_axes(ax, right, low, high)
    _curve(ax, chosen)
    level(ax, "lambda_0", chosen.lambda_0, 0.12 * right)
    level(ax, "lambda_c", chosen.lambda_c)
    ax.set_ylim(top=high + 0.12 * (high - low))
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, 0.86), title=f"$z$ = {CM * chosen.height:.1f} cm")
    point = chosen.critical
    if point < len(chosen.advance) - 1:
        # Enlarged: the neighbourhood of the critical point, where the curve turns.
        x, y = CM * chosen.deflection, CM * chosen.advance
        wide, deep = x[point:].max() - x[point], y[point] - y[point:].min()
        inset = enlarged(ax, (0.53, 0.16, 0.44, 0.42))
        _curve(inset, chosen, ".")
        inset.axhline(high, color=LEVEL, lw=1.0, zorder=1)
        inset.set_xlim(x[point] - 1.5 * wide, x[point] + 1.2 * wide)
        inset.set_ylim(y[point] - 1.2 * deep, y[point] + 0.25 * deep)
        ax.indicate_inset_zoom(inset, edgecolor=GREY)
    return fig


def _curve(ax: Axes, chosen: Branch, marker: str = "") -> None:
    """The branch, with a marker on each stored point, and its critical point."""
    x, y = CM * chosen.deflection, CM * chosen.advance
    curve = smooth(x, y)
    # Along the branch the deflection grows.
    unstable = curve[0] > x[chosen.critical]
    for part, name, colour, line in ((~unstable, "stable", BLACK, "-"), (unstable, "unstable", UNSTABLE, "--")):
        if not part.any():
            continue
        ax.plot(curve[0][part], curve[1][part], color=colour, ls=line, zorder=3, label=name)
        if marker:
            states = chosen.stable if name == "stable" else ~chosen.stable
            ax.plot(x[states], y[states], marker, color=colour, ms=3, zorder=3)
    point = CM * chosen.deflection[chosen.critical], CM * chosen.lambda_c
    ax.plot(*point, "o", color=CRITICAL, zorder=4, label="critical point")

"""The control-parameter/displacement curve of an R-path, without internal friction and with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.path_readers import Part, parts, planned, post_critical, with_friction
from plots.pieces import arrow, note
from stripfold.base.arrays import Array
from stripfold.base.progress import FALL
from stripfold.draw.colours import CRITICAL, FRICTION, HANGING, SETTLED, SHADE, TOUCHING
from stripfold.draw.style import CM, MILLI, figure, legend_above, styled, text_at

AROUND = 0.04
"""Pseudo time shown in (b) before the critical point and after the falls of the post-critical branches."""
PLANNED, BEFORE, HELD = "planned", "without friction", "with friction"
AFTER, TOUCHES, HANGS = (
    "after the fall at the critical point",
    "after a fall that touches",
    "after a fall without a touch",
)


class Curve(NamedTuple):
    """Parts to draw, with the name in the legend, colour, and kind and width of the line."""

    name: str
    parts: list[Part]
    color: str
    ls: str = "-"
    lw: float = 1.0


@styled
def draw(r_path: xr.Dataset, ways: xr.Dataset, friction: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw pseudo time over (a) the displacement from the flat strip, (b) the mean height over the planned state.

    Falls are dashed.  Black to the critical point; red the fall from there, green static states after it.  Past that
    point the planned state, unstable, has two post-critical branches, red and blue.  Orange: with the paper's friction.
    Dotted: the plan.  (b) enlarges the critical point.  Curves that coincide have different widths.

    ``r_path``: from :func:`tasks.assess_data.run`.  ``ways``: from :func:`tasks.post_critical.two_ways`.  ``friction``:
    from :func:`tasks.friction.run`; the paper's pull is drawn.  ``plans``: from :func:`tasks.plans.dataset`, for the
    same strip.
    """
    plan, (before, *behind), branches = planned(plans, "r-path"), parts(r_path), post_critical(ways)
    critical = before if float(r_path.attrs["critical_points"]) > 0.0 else None
    curves = [
        Curve(HELD, [with_friction(friction)[0]], FRICTION, lw=2.8),
        Curve(BEFORE, [before], CRITICAL, lw=1.4),
    ]
    if behind:
        falls, settled = ([part for part in behind if (part.phase == FALL) == fell] for fell in (True, False))
        curves += [Curve("_fall", falls, TOUCHING, "--"), Curve(AFTER, settled, SETTLED, lw=2.2)]
    for branch in branches:
        name, colour = (TOUCHES, TOUCHING) if branch.touches else (HANGS, HANGING)
        curves += [Curve(f"_{name}", [branch.fall], colour, "--"), Curve(name, [branch.after], colour, lw=1.2)]
    curves.append(Curve(PLANNED, [plan], CRITICAL, ":", 0.8))
    fig = figure(6.2)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.0, 1.6))
    _draw(top, curves, lambda part: CM * part.displacement(), critical)
    _draw(bottom, curves, lambda part: MILLI * part.above(plan), critical)
    for branch in branches:
        _arrows(bottom, MILLI * branch.fall.above(plan), branch.fall.pseudo_time)
    if branches:
        # Both begin in the planned state, and jump at its pseudo time.
        start = 0.0, branches[0].fall.pseudo_time[0]
        bottom.plot(*start, "o", color=CRITICAL, mfc="white", ms=4.0, zorder=13, label="_start")
        text_at(bottom, start, "unstable\nplanned state", (5, -3), ha="left", va="top", fontsize=8)
    if critical and behind:
        _arrows(bottom, MILLI * behind[0].above(plan), behind[0].pseudo_time)
    top.set_xlabel("deflection: rms displacement from the flat strip [cm]")
    bottom.set_xlabel("mean height of the strip over the planned state [mm]")
    if critical:
        times = [float(part.pseudo_time[-1]) for part in (critical, *(branch.fall for branch in branches))]
        bottom.set_ylim(times[0] - AROUND, max(times) + AROUND)
        top.axhspan(*bottom.get_ylim(), color=SHADE, lw=0.0, zorder=0)
        point = MILLI * critical.above(plan)[-1], times[0]
        text_at(bottom, point, "critical point", (-4, -4), ha="right", va="top", fontsize=8)
    legend_above(fig, top.get_legend_handles_labels()[0], fontsize=7)
    note(top, "(a)")
    note(bottom, "(b) the shaded times")
    return fig


def _arrows(ax: Axes, x: Array, y: Array) -> None:
    """An arrowhead in the middle of a fall, which goes along x."""
    middle = 0.5 * (x[0] + x[-1])
    reach = 0.02 * np.sign(x[-1] - x[0]) * max(abs(x[-1] - x[0]), 1e-9)
    arrow(ax, np.array([middle - reach, y[0]]), np.array([middle + reach, y[0]]))


def _draw(ax: Axes, curves: list[Curve], of: Callable[[Part], Array], critical: Part | None) -> None:
    gap = [np.nan]
    for order, curve in enumerate(curves):
        x = np.concatenate([values for part in curve.parts for values in (of(part), gap)][:-1])
        y = np.concatenate([values for part in curve.parts for values in (part.pseudo_time, gap)][:-1])
        ax.plot(x, y, curve.ls, color=curve.color, lw=curve.lw, zorder=3 + order, label=curve.name)
    if critical:
        point = of(critical)[-1], critical.pseudo_time[-1]
        ax.plot(*point, "o", color=CRITICAL, ms=3.5, zorder=12, label="_critical-point")
    ax.set_ylabel(r"pseudo time $\lambda$")

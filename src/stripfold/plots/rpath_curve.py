"""The control-parameter/displacement curve of an R-path, without internal friction and with it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.arrays import Array
from stripfold.plots.followed import Part, held, parts, planned, ways_out
from stripfold.plots.style import BLACK, CM, GREY, HANGING, HELD, TOUCHING, figure, note, styled

MILLI = 1000.0
"""Millimetres in a metre."""
AROUND = 0.04
"""Pseudo time shown in (b) before the critical point and behind the two ways' falls."""
PLANNED, BEFORE = "planned", "static, to the critical point"
WHOLE, BEHIND = "static", "falls at the critical point"
TOUCHES, HANGS, FRICTION = "falls and touches", "rests without touching", "with friction"

Curve = tuple[str, list[Part], str, str]
"""Name, parts, colour and kind of line."""


@styled
def draw(r_path: xr.Dataset, ways: xr.Dataset, friction: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw pseudo time over (a) the displacement from the flat strip, (b) the mean height over the planned state.

    Black to the critical point, dotted from there: the fall, and static states after it.  Behind it the planned state,
    unstable, can go two ways, red and blue, again a fall and static states.  Orange: with the paper's friction.  (b)
    shows where this happens.

    Parameters
    ----------
    r_path
        From :func:`stripfold.analysis.assess_data.run`.
    ways
        From :func:`stripfold.analysis.friction_data.two_ways`.
    friction
        From :func:`stripfold.analysis.friction_data.run`; the paper's pull is drawn.
    plans
        From :func:`stripfold.analysis.plans.dataset`, for the same strip.
    """
    plan, (before, *behind), out = planned(plans, "r-path"), parts(r_path), ways_out(ways)
    critical = float(before.pseudo_time[-1]) if float(r_path.attrs["critical_points"]) > 0.0 else np.nan
    curves: list[Curve] = [(PLANNED, [plan], GREY, "--"), (FRICTION, [held(friction)[0]], HELD, "-")]
    curves.append((BEFORE if np.isfinite(critical) else WHOLE, [before], BLACK, "-"))
    if behind:
        curves.append((BEHIND, behind, TOUCHING, ":"))
    for way in out:
        name, colour = (TOUCHES, TOUCHING) if way.touches else (HANGS, HANGING)
        curves.append((name, [way.fall, way.after], colour, "-"))
    fig = figure(5.4)
    top, bottom = fig.subplots(2, 1)
    _draw(top, curves, lambda part: CM * part.displacement(), CM * before.displacement()[-1], critical)
    _draw(bottom, curves, lambda part: MILLI * part.above(plan), MILLI * before.above(plan)[-1], critical)
    top.set_xlabel("deflection: rms displacement from the flat strip [cm]")
    bottom.set_xlabel("mean height of the strip over the planned state [mm]")
    if np.isfinite(critical):
        last = max([critical, *(float(way.fall.pseudo_time[-1]) for way in out)])
        bottom.set_ylim(critical - AROUND, last + AROUND)
    fig.legend(*top.get_legend_handles_labels(), loc="outside upper center", ncols=2, columnspacing=1.2)
    note(top, "(a)")
    note(bottom, "(b)")
    return fig


def _draw(ax: Axes, curves: list[Curve], of: Callable[[Part], Array], at: float, critical: float) -> None:
    for order, (name, shown, colour, line) in enumerate(curves):
        x = np.concatenate([of(part) for part in shown])
        y = np.concatenate([part.pseudo_time for part in shown])
        ax.plot(x, y, line, color=colour, lw=1.4 if line == "-" else 0.9, zorder=3 + order, label=name)
    if np.isfinite(critical):
        ax.plot(at, critical, "o", color=BLACK, ms=3.5, zorder=12, label="critical point")
    ax.set_ylabel(r"pseudo time $\lambda$")

"""The R-path without internal friction, where the strip leaves the plan in one of two directions, and with it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from stripfold.arrays import Array
from stripfold.plots.evolutions import evolution
from stripfold.plots.followed import Way, held, parts, ways_out
from stripfold.plots.planned_paths import limits
from stripfold.plots.style import (
    BLACK,
    CM,
    HANGING,
    HELD,
    STATES_GREY,
    TOUCHING,
    Limits,
    equal_panels,
    floor,
    note,
    styled,
)

BEFORE, FALLS, AFTER, WHOLE = 14, 6, 7, 22
"""Largest numbers of states drawn before the critical point, in a fall, after it, and with friction."""
MOVING = 0.1
"""What moves at least this part of the largest displacement in the falls is enlarged."""


@styled
def draw(r_path: xr.Dataset, ways: xr.Dataset, friction: xr.Dataset) -> Figure:
    """Draw (a) the R-path without friction, (b) the ways out of the planned state behind the critical point, (c) with.

    Red is the way that touches, blue the other, with thin static states behind them.  In (c) states that without
    friction would be unstable are orange.

    Parameters
    ----------
    r_path
        From :func:`stripfold.analysis.assess_data.run`.
    ways
        From :func:`stripfold.analysis.friction_data.two_ways`.
    friction
        From :func:`stripfold.analysis.friction_data.run`; the paper's pull is drawn.
    """
    before, out, (whole, eigenvalues) = parts(r_path)[0], ways_out(ways), held(friction)
    view = limits([before, whole])
    fig, axes = equal_panels([view, _near(out), view] if out else [view, view], above=0.57)
    evolution(axes[0], before, BEFORE, float(r_path.attrs["critical_points"]) > 0.0)
    for way in out:
        _way(axes[0], way, 1, AFTER, 0.7)
        _way(axes[1], way, FALLS, 0, 1.0)
    for ax in axes[:-1] if out else ():
        ax.plot(*(CM * out[0].fall.states[0]).T, "--", color=BLACK, lw=1.2, zorder=4, label="_unstable")
    if out:
        note(axes[1], r"(b) the two ways, enlarged; touch ($\blacktriangle$)")
    _held(axes[-1], whole.states, whole.evenly(WHOLE), eigenvalues)
    note(axes[0], "(a) without friction" + ("" if out else ":\n      no unstable planned state"))
    note(axes[-1], f"({'c' if out else 'b'}) with friction")
    for ax in axes:
        ax.set(xlabel="$x$ [cm]", ylabel="$z$ [cm]")
        ax.grid(visible=False)
        floor(ax)
    fig.legend(handles=_handles(fig), loc="upper center", borderaxespad=0.3, ncols=2, columnspacing=1.2)
    return fig


def _near(out: list[Way]) -> Limits:
    """What moves in the falls, cm, down to the floor."""
    falls = [CM * way.fall.states for way in out]
    moved = [np.linalg.norm(fall - fall[0], axis=2).max(axis=0) for fall in falls]
    least = MOVING * max(float(m.max()) for m in moved)
    x, z = (np.concatenate([f[:, m >= least, i].ravel() for f, m in zip(falls, moved, strict=True)]) for i in range(2))
    margin = 0.06 * float(np.ptp(x))
    return (float(x.min()) - margin, float(x.max()) + margin), (-margin, min(float(z.max()), 0.6 * float(np.ptp(x))))


def _way(ax: Axes, way: Way, falls: int, after: int, width: float) -> None:
    colour = TOUCHING if way.touches else HANGING
    name = "touching" if way.touches else "hanging"
    for part, count in ((way.fall, falls), (way.after, after)):
        for i in part.evenly(count + 1)[1:] if count else []:
            ax.plot(*(CM * part.states[i]).T, color=colour, lw=width, zorder=3, label=f"_{name}-{part.phase}")
    if way.touches:
        ax.plot(CM * way.touch_x, 0.0, marker=CARETUP, color=colour, ms=5, mew=0, zorder=6, label="_touch")


def _held(ax: Axes, states: Array, chosen: list[int], eigenvalues: Array) -> None:
    only = np.flatnonzero(eigenvalues < 0.0)
    for i in sorted({*chosen, *only[[0, -1]].tolist()} if len(only) else chosen):
        alone = eigenvalues[i] < 0.0
        colour, width, order, name = (HELD, 1.2, 3, "held") if alone else (STATES_GREY, 0.8, 2, "static")
        ax.plot(*(CM * states[i]).T, color=colour, lw=width, zorder=order, label=f"_{name}")


def _handles(fig: Figure) -> list[Line2D]:
    """What is drawn, by name."""
    looks = {
        "static": (STATES_GREY, 0.8, "-", "static, stable"),
        "critical": (BLACK, 1.4, "-", "last before the critical point"),
        "unstable": (BLACK, 1.2, "--", "planned, unstable"),
        "touching-fall": (TOUCHING, 1.0, "-", "falls and touches"),
        "hanging-fall": (HANGING, 1.0, "-", "rests without touching"),
        "held": (HELD, 1.2, "-", "held by friction alone"),
    }
    shown = {line.get_label() for ax in fig.axes for line in ax.lines}
    return [
        Line2D([], [], color=colour, lw=width, ls=line, label=text)
        for name, (colour, width, line, text) in looks.items()
        if f"_{name}" in shown
    ]

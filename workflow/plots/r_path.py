"""The R-path without internal friction, where the strip can leave the plan in two directions, and with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from plots.on_paths import draw_evolution, draw_path, limits
from plots.path_readers import Part, PostCriticalBranch, parts, planned, post_critical, with_friction
from plots.pieces import arrow, draw_states, entry, note
from stripfold.base.arrays import Array
from stripfold.base.progress import FALL
from stripfold.draw.colours import CRITICAL, FRICTION, GRIPPER, HANGING, SETTLED, SHADE, STATIC, TOUCHING
from stripfold.draw.style import CM, MILLI, Limits, around, equal_panels, figure, legend_above, styled, text_at

BEFORE, FALLS, AFTER, WHOLE = 14, 6, 7, 22
"""Largest numbers of states drawn before the critical point, in a fall, after it, and with friction."""
MOVING = 0.1
"""The part of the strip that moves at least this share of the largest displacement in the falls is enlarged."""
LEGEND = {
    "static": (STATIC, 0.8, "-", "static, stable"),
    "critical": (CRITICAL, 1.4, "-", "last before the critical point"),
    "touching-fall": (TOUCHING, 1.0, "-", "falls and touches"),
    "hanging-fall": (HANGING, 1.0, "-", "rests without touching"),
    "held": (FRICTION, 1.2, "-", "stable by friction alone"),
    "planned": (CRITICAL, 0.8, ":", "planned; unstable in (a), (b)"),
}
"""Colour, width, kind of line and text of what may be drawn."""


@styled
def draw_rpath_friction(r_path: xr.Dataset, ways: xr.Dataset, friction: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw (a) the R-path without friction, (b) the post-critical branches from the planned state, (c) with friction.

    Red is the branch that touches, blue the other, with thin static states after the falls.  In (c) states that
    without friction would be unstable are orange; dotted over them the planned ones.

    ``r_path``: from :func:`tasks.assess_data.run`.  ``ways``: from :func:`tasks.post_critical.two_ways`.  ``friction``:
    from :func:`tasks.friction.run`; the paper's pull is drawn.  ``plans``: from :func:`tasks.folding.plans`, for the
    same strip.
    """
    before, branches, (whole, eigenvalues) = parts(r_path)[0], post_critical(ways), with_friction(friction)
    plan = planned(plans, "r-path")
    view = limits([before, whole, plan])
    fig, axes = equal_panels([view, _near(branches), view] if branches else [view, view], above=0.56)
    draw_evolution(axes[0], before, BEFORE, float(r_path.attrs["critical_points"]) > 0.0)
    for branch in branches:
        _branch(axes[0], branch, 1, AFTER, 0.7)
        _branch(axes[1], branch, FALLS, 0, 1.0)
    if branches:
        for ax in axes[:2]:
            draw_states(ax, branches[0].fall.states[:1], "planned", color=CRITICAL, ls=":", lw=1.2, zorder=4)
        note(axes[1], "(b) the two branches, enlarged")
    _held(axes[-1], whole, eigenvalues, plan)
    for ax in (axes[0], axes[-1]):
        draw_path(ax, plan)
    note(axes[0], "(a) without friction" + ("" if branches else ":\n      no unstable planned state"))
    pull = float(friction["suffices"].sel(law="pull")) * friction.attrs["step"] / friction.attrs["gravity_length"]
    letter = "c" if branches else "b"
    note(axes[-1], f"({letter}) with friction: pull,\n$k_f\\,\\Delta s$ = {pull:.2g} $g$")
    text_at(axes[0], CM * plan.states[-3 * len(plan.states) // 20, 0], "gripper", ha="left", color=GRIPPER, fontsize=8)
    legend_above(fig, _handles(fig))
    return fig


def _near(branches: list[PostCriticalBranch]) -> Limits:
    """Limits of the part of the strip that moves in the falls, cm; of its high part only the lower end."""
    falls = [CM * branch.fall.states for branch in branches]
    moved = [np.linalg.norm(fall - fall[0], axis=2).max(axis=0) for fall in falls]
    least = MOVING * max(float(m.max()) for m in moved)
    points = np.concatenate([fall[:, m >= least].reshape(-1, 2) for fall, m in zip(falls, moved, strict=True)])
    points[:, 1] = np.minimum(points[:, 1], 0.6 * np.ptp(points[:, 0]))
    return around(points, 0.06, 0.0)


def _branch(ax: Axes, branch: PostCriticalBranch, falls: int, after: int, width: float) -> None:
    name, colour = ("touching", TOUCHING) if branch.touches else ("hanging", HANGING)
    for part, count in ((branch.fall, falls), (branch.after, after)):
        shown = part.evenly(count + 1)[1:]
        draw_states(ax, part.states[shown], f"{name}-{part.phase}", color=colour, lw=width, zorder=3)
    if branch.touches:
        ax.plot(CM * branch.touch_x, 0.0, marker=CARETUP, color=colour, ms=5, mew=0, zorder=6, label="_touch")


def _held(ax: Axes, whole: Part, eigenvalues: Array, plan: Part) -> None:
    """States with friction, those that friction alone holds include the first and the last; the planned ones."""
    only = np.flatnonzero(eigenvalues < 0.0)
    shown = sorted({*whole.evenly(WHOLE), *only[:1].tolist(), *only[-1:].tolist()})
    for i in shown:
        name, order = ("held", 3) if eigenvalues[i] < 0.0 else ("static", 2)
        draw_states(ax, whole.states[[i]], name, color=LEGEND[name][0], lw=LEGEND[name][1], zorder=order)
    draw_states(ax, plan.at(whole.pseudo_time[shown]), "planned", color=CRITICAL, ls=":", lw=0.8, zorder=4)


def _handles(fig: Figure) -> list[Line2D]:
    """Entries of the legend for all that is drawn."""
    shown = {line.get_label() for ax in fig.axes for line in ax.lines}
    touch = {"marker": CARETUP, "ms": 5, "mew": 0}
    return [
        entry(text, colour, line, lw=width, **(touch if name == "touching-fall" else {}))
        for name, (colour, width, line, text) in LEGEND.items()
        if f"_{name}" in shown
    ]


AROUND = 0.04
"""Pseudo time shown in (b) before the critical point and after the falls of the post-critical branches."""
PLANNED, WITHOUT, HELD = "planned", "without friction", "with friction"
SETTLES, TOUCHES, HANGS = (
    "after the fall at the critical point",
    "after a fall that touches",
    "after a fall without a touch",
)


class Curve(NamedTuple):
    """Parts to draw_rpath_curve, with the name in the legend, colour, and kind and width of the line."""

    name: str
    parts: list[Part]
    color: str
    ls: str = "-"
    lw: float = 1.0


@styled
def draw_rpath_curve(r_path: xr.Dataset, ways: xr.Dataset, friction: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw pseudo time over (a) the displacement from the flat strip, (b) the mean height over the planned state.

    Falls are dashed.  Black to the critical point; red the fall from there, green static states after it.  Past that
    point the planned state, unstable, has two post-critical branches, red and blue.  Orange: with the paper's friction.
    Dotted: the plan.  (b) enlarges the critical point.  Curves that coincide have different widths.

    ``r_path``: from :func:`tasks.assess_data.run`.  ``ways``: from :func:`tasks.post_critical.two_ways`.  ``friction``:
    from :func:`tasks.friction.run`; the paper's pull is drawn.  ``plans``: from :func:`tasks.folding.plans`, for the
    same strip.
    """
    plan, (before, *behind), branches = planned(plans, "r-path"), parts(r_path), post_critical(ways)
    critical = before if float(r_path.attrs["critical_points"]) > 0.0 else None
    curves = [
        Curve(HELD, [with_friction(friction)[0]], FRICTION, lw=2.8),
        Curve(WITHOUT, [before], CRITICAL, lw=1.4),
    ]
    if behind:
        falls, settled = ([part for part in behind if (part.phase == FALL) == fell] for fell in (True, False))
        curves += [Curve("_fall", falls, TOUCHING, "--"), Curve(SETTLES, settled, SETTLED, lw=2.2)]
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

"""A strip through its collapse: its states, the curve of lambda over the deflection, and the energies of the fall."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import draw_states, entry, note
from plots.readers import evenly, travel
from plots.x_axis import draw_gripper
from stripfold.base.progress import AFTER, FALL
from stripfold.draw.collapse_curve import Collapse, collapse, require
from stripfold.draw.colours import (
    BLACK,
    BLUE,
    CRITICAL,
    FALLING,
    GREEN,
    GREY,
    ORANGE,
    PINK,
    SETTLED,
    SKY,
    STATIC,
    VERMILLION,
)
from stripfold.draw.style import (
    CM,
    MILLI,
    Limits,
    around,
    draw_held_end,
    equal_panels,
    figure,
    legend_above,
    styled,
    text_at,
)

STATES, TO_TOUCH, TO_REST = 12, 5, 3
"""Largest numbers of states drawn in each static part, in the fall up to the touch, and from there to rest."""
MOVING = 0.25
"""The part of the strip that moves at least this share of the largest displacement in the fall is enlarged."""


@styled
def draw_collapse(data: xr.Dataset) -> Figure:
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


STACKED = {
    "kinetic": ("kinetic", GREEN),
    "air": ("dissipated: air", SKY),
    "viscous": ("dissipated: fabric", ORANGE),
    "contact": ("dissipated: impacts", PINK),
    "numerical": ("dissipated: scheme", GREY),
}
TITLES = ("(a) elastic and gravity energy since the start", "(b) the energy released", "(c) error of the balance")


@styled
def draw_energy(data: xr.Dataset) -> Figure:
    """Draw over the time of the fall: (a) elastic and gravity energy, (b) what became of them, (c) the closing error.

    All per width and relative to the start of the fall.  Dissipation is stacked on the kinetic energy: together they
    reach the line of what elasticity and gravity released and the gripper gave.

    ``data`` is from :func:`stripfold.ask.collapse.run`.
    """
    found = collapse(data)
    names = ("elastic", "gravity", "work", "closing", *STACKED)
    require(data, names, "a collapse with its energies")
    fall = data.isel(state=found.part(FALL))
    time, e = fall["time"].values, {name: MILLI * fall[name].values for name in names}
    gained = {name: e[name] - e[name][0] for name in ("elastic", "gravity")}
    released = e["work"] - gained["elastic"] - gained["gravity"] + e["kinetic"][0]
    error = np.abs(e["closing"]) / max(float(np.abs(values).max()) for values in gained.values())

    fig = figure(5.0)
    top, middle, bottom = axes = fig.subplots(3, 1, sharex=True, height_ratios=(1.0, 1.25, 0.6))
    top.plot(time, gained["elastic"], color=VERMILLION, label="elastic")
    top.plot(time, gained["gravity"], color=BLUE, label="gravity")
    labels, colours = zip(*STACKED.values(), strict=True)
    middle.stackplot(time, *(e[name] for name in STACKED), colors=colours, labels=labels, lw=0.0)
    middle.plot(time, released, color=BLACK, lw=0.9, label="released")
    bottom.semilogy(time, np.where(error > 0.0, error, np.nan), color=BLACK, lw=0.8, label="_closing")
    bottom.set(xlabel="time since the start of the fall [s]", ylabel="relative to (a)", xlim=(0.0, 1.03 * time[-1]))
    top.legend(loc="upper left")
    middle.legend(loc="upper left", reverse=True, fontsize=7, labelspacing=0.3)
    for ax, title in zip(axes, TITLES, strict=True):
        ax.set_title(title)
    for ax in (top, middle):
        ax.set_ylabel("energy [mJ m$^{-1}$]")
    fig.align_ylabels()
    _events(axes, found)
    return fig


def _events(axes: tuple[Axes, ...], found: Collapse) -> None:
    """Lines at the touch and at rest, named in the first panel."""
    for name, text, time in (("touch", "touch", found.touch_time), ("settle", "at rest", found.settle_time)):
        if np.isnan(time):
            continue
        for ax in axes:
            ax.axvline(time, color=BLACK, lw=0.7, ls="--", zorder=4, label=f"_{name}")
        middle = 0.5 * sum(axes[0].get_ylim())
        text_at(axes[0], (time, middle), f"{text}\n{time:.2f} s", (-3, 0), ha="right", va="center")

"""The paper's folding paths as planned and as followed, without internal friction and with it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.markers import CARETUP

from plots.path_readers import Part, parts, planned
from plots.pieces import arrow, draw_states, drawings, entry, note
from stripfold.base.arrays import Array
from stripfold.base.progress import FALL
from stripfold.draw.colours import BLACK, CRITICAL, FALLING, FIXED, GRIPPER, LYING, STATIC
from stripfold.draw.style import CM, Limits, around, equal_panels, legend_above, styled, text_at

WIDTH = 0.2
"""Width of the strip as drawn, over its length."""
SLANT = np.array([0.5, 0.4])
"""Direction of a unit of depth in the picture: the strip is seen from its front, from above and from the right."""
LAYER = 0.006
"""Distance between lying layers as drawn, over the length."""
FACE, REVERSE = 0.93, 0.76
"""Greys of the upper face of the flat strip and of the lower one."""
BORDER = 0.025
"""Width of the back edge's line, over the strip's."""
ARROWS = (0.14, 0.42, 0.58, 0.86)
"""Places of the arrowheads on the path, in parts of its states."""


@styled
def draw_folding(data: xr.Dataset) -> Figure:
    """Draw (a) the flat strip with the gripper's path and (b) the folded strip; the fold line is blue.

    Both are states of the R-path, its first and its last; the width is made up.

    ``data`` is from :func:`tasks.folding.plans`.
    """
    plan = planned(data, "r-path")
    length = float(plan.arc[-1])
    deep = WIDTH * length * SLANT
    low = -0.08 * length
    tops = [plan.states[:, 0, 1].max() + 0.5 * deep[1] + 0.09 * length, deep[1] + 0.12 * length]
    spans = [(low, float(top)) for top in tops]
    fig, axes = drawings((-0.55 * length, 0.55 * length + deep[0]), spans, ("(a) initial state", "(b) folded state"))
    for ax, state, ls in zip(axes, plan.states[[0, -1]], ("-", "--"), strict=True):
        drawn = layered(state, LAYER * length)
        _strip(ax, drawn, deep)
        # On the lower layer: dashed where the upper one hides it.
        ax.plot([0.0, deep[0]], [0.0, deep[1]], color=FIXED, ls=ls, lw=1.8, zorder=5, label="_fold-line")
        edge = np.stack([drawn[0], drawn[0] + deep], axis=1)
        ax.plot(*edge, color=GRIPPER, lw=2.5, solid_capstyle="round", zorder=7, label="_gripper")
    _path_and_names(axes[0], plan, deep)
    return fig


def layered(state: Array, apart: float) -> Array:
    """A state, shape (n, 2), with what lies on the lower layer lifted by ``apart``; along the loop it rises evenly."""
    up = np.flatnonzero(state[:, 1] > 1e-3 * apart)
    if not len(up):
        return state
    lift = apart * np.interp(np.arange(len(state)), up[[0, -1]], [1.0, 0.0])
    return np.asarray(state + np.stack([np.zeros_like(lift), lift], axis=1))


def _strip(ax: Axes, state: Array, deep: Array) -> None:
    """The strip as a ribbon, ``deep`` from its front to its back edge: what is farther away is drawn first."""
    nodes = state[::2]  # an odd number: both ends are among them
    begin, end = nodes[:-1], nodes[1:]
    along = end - begin
    # The upper face of the flat strip is seen where its normal (-z', x') has a part towards the eye.
    face = np.where(SLANT[1] * along[:, 0] - SLANT[0] * along[:, 1] > 0.0, FACE, REVERSE)
    quads, greys = [], []
    for i in np.argsort(0.5 * (begin + end) @ SLANT, kind="stable"):
        for near, far, grey in ((0.0, 1.0 - BORDER, face[i]), (1.0 - BORDER, 1.0, 0.0)):
            a, b = near * deep, far * deep
            quads.append([begin[i] + a, end[i] + a, end[i] + b, begin[i] + b])
            greys.append(str(grey))
    ax.add_collection(PolyCollection(quads, facecolors=greys, edgecolors=greys, linewidths=0.2, zorder=3))
    ax.plot(*state.T, color=BLACK, lw=0.9, zorder=4, label="_front")
    # The two ends, and the outline of the fold: what is farthest to the upper left.
    for place in state[[0, -1, int(np.argmax(state @ np.array([-SLANT[1], SLANT[0]])))]]:
        ax.plot(*np.stack([place, place + deep], axis=1), color=BLACK, lw=0.9, zorder=4)


def _path_and_names(ax: Axes, plan: Part, deep: Array) -> None:
    path = plan.states[:, 0] + 0.5 * deep
    ax.plot(*path.T, color=GRIPPER, lw=0.9, zorder=5, label="_path")
    for part in ARROWS:
        i = int(part * (len(path) - 1))
        arrow(ax, path[i - 1], path[i + 1], color=GRIPPER)
    top = path[int(np.argmax(path[:, 1]))]
    for at, text, colour, offset, ha in (
        (np.zeros(2), "fold line", FIXED, (0, -7), "center"),
        (plan.states[0, 0], "grasped", GRIPPER, (-2, -7), "left"),
        (plan.states[0, -1], "held", FIXED, (2, -7), "right"),
        (top, "folding path", GRIPPER, (0, 7), "center"),
    ):
        text_at(ax, at, text, offset, ha=ha, va="center", color=colour, fontsize=8)


TITLES = {"triangular": "(a) triangular path", "circular": "(b) circular path", "r-path": "(c) R-path"}
STATES = 9
"""Number of states drawn on each path, the flat strip among them."""


@styled
def draw_planned_paths(data: xr.Dataset) -> Figure:
    """Draw each path dashed, the states assumed on it solid, from light to dark, and a blue mark at the fold line.

    ``data`` is from :func:`tasks.folding.plans`.
    """
    plans = [planned(data, name) for name in TITLES]
    fig, axes = equal_panels([limits([plan]) for plan in plans], above=0.25, one_x=True)
    for ax, plan, title in zip(axes, plans, TITLES.values(), strict=True):
        shown = plan.evenly(STATES)
        for shade, i in zip(np.linspace(0.78, 0.0, len(shown)), shown, strict=True):
            draw_states(ax, plan.states[[i]], "state", color=str(shade), lw=1.0, zorder=3, clip_on=False)
        path = draw_path(ax, plan)
        ax.plot(0.0, 0.0, marker=CARETUP, color=FIXED, ms=7, mew=0, zorder=6, label="_fold-line")
        note(ax, title)
    fold = entry("fold line", FIXED, "none", marker="^", ms=5, mew=0)
    legend_above(fig, [path, entry("assumed states", "0.4", lw=1.0), fold], ncols=3)
    return fig


def draw_path(ax: Axes, plan: Part) -> Line2D:
    """Draw the gripper's path; returns its entry of a legend."""
    draw_states(ax, [plan.states[:, 0]], "path", color=GRIPPER, ls="--", zorder=1.5)
    return entry("gripper path", GRIPPER, "--", lw=0.8)


def limits(shown: list[Part]) -> Limits:
    """Limits of x and z, cm, that show all states, with room for a note above them."""
    return around(CM * np.concatenate([part.states.reshape(-1, 2) for part in shown]), 0.04, 0.024)


FOLLOWED_TITLES = {"r-path": "(a) R-path", "triangular": "(b) triangular path", "circular": "(c) circular path"}
SHOWN = 16
"""Largest number of states drawn on each path."""
FALLING_STATES = 4
"""Largest number of states drawn in each fall."""


@styled
def draw_evolutions(r_path: xr.Dataset, triangular: xr.Dataset, circular: xr.Dataset, plans: xr.Dataset) -> Figure:
    """Draw static states in grey, the last before the first critical point in black, the fall red, the path dashed.

    Marks on the floor tell where the strip first touches, where it should, by the plan of the R-path, and where the
    folded strip begins to lie.

    ``r_path``, ``triangular``, ``circular``: from :func:`tasks.assess_data.run`; ``plans``: from
    :func:`tasks.folding.plans`, for the same strip.
    """
    found = (r_path, triangular, circular)
    each = [parts(data) for data in found]
    plan, first = [planned(plans, name) for name in FOLLOWED_TITLES], [own[0] for own in each]
    lying = float(plans.attrs["length"]) / 2.0 - float(plans.attrs["lying_length"])
    intended = float(plans.attrs["planned_touch_x"])
    fig, axes = equal_panels([limits([*pair]) for pair in zip(plan, first, strict=True)], above=0.75, one_x=True)
    for i, (ax, title) in enumerate(zip(axes, FOLLOWED_TITLES.values(), strict=True)):
        path = draw_path(ax, plan[i])
        critical = float(found[i].attrs["critical_points"]) > 0.0
        static, last = draw_evolution(ax, first[i], SHOWN, critical)
        for part in [own for own in each[i][1:] if own.phase == FALL][:1]:
            fallen = part.states[part.evenly(FALLING_STATES + 1)[1:]]
            draw_states(ax, fallen, "fall", color=FALLING, ls="--", lw=0.8, zorder=3)
        if np.isfinite(touch := float(found[i].attrs["touch_x"])):
            ax.plot(CM * touch, 0.0, marker=CARETUP, color=FALLING, ms=5, mew=0, zorder=6, label="_touch")
        ax.plot(CM * intended, 0.0, marker=CARETUP, color=BLACK, ms=5, mew=0, zorder=5, label="_planned-touch")
        ax.plot(CM * lying, 0.0, "o", color=LYING, mec="white", mew=0.4, ms=5, zorder=6, label="_lying")
        note(ax, title + ("" if critical else ",\n      no critical point"))
    mark = entry("folded strip lies from here on", LYING, "none", marker="o", ms=4)
    fall = entry("fall", FALLING, "--", lw=0.8)
    touched = entry("first touch", FALLING, "none", marker=CARETUP, ms=5, mew=0)
    intention = entry("planned first touch", BLACK, "none", marker=CARETUP, ms=5, mew=0)
    legend_above(fig, [static, last, path, fall, touched, intention, mark])
    return fig


def draw_evolution(ax: Axes, part: Part, count: int, critical: bool) -> list[Line2D]:
    """Draw a static part in grey, its last state black where it is ``critical``; returns entries of a legend."""
    chosen = part.evenly(count)
    draw_states(ax, part.states[chosen[:-1] if critical else chosen], "static", color=STATIC, zorder=2)
    if critical:
        draw_states(ax, part.states[[-1]], "critical", color=CRITICAL, lw=1.4, zorder=4)
    return [entry("static states", STATIC, lw=0.8), entry("last before the critical point", CRITICAL, lw=1.4)]

"""Folding: the strip before and after, its fold line and the gripper's path."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from plots.path_readers import Part, planned
from plots.pieces import arrow, drawings
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, FIXED, GRIPPER
from stripfold.draw.style import styled, text_at

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
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the flat strip with the gripper's path and (b) the folded strip; the fold line is blue.

    Both are states of the R-path, its first and its last; the width is made up.

    ``data`` is from :func:`tasks.plans.dataset`.
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

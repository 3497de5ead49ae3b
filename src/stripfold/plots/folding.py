"""What folding is: the strip before and after, its fold line and the gripper's path."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from stripfold.arrays import Array
from stripfold.plots import style
from stripfold.plots.followed import Part, planned
from stripfold.plots.style import BLACK, BLUE, GRASPING, HOLDING, styled

WIDTH = 0.2
"""Width of the strip as drawn, over its length."""
SLANT = np.array([0.5, 0.4])
"""Where a unit of depth points in the picture: the strip is seen from its front, from above and from the right."""
LAYER = 0.006
"""How far apart lying layers are drawn, over the length."""
FACE, REVERSE = 0.93, 0.76
"""Greys of the upper face of the flat strip and of the lower one."""
BORDER = 0.025
"""Width of the back edge's line, over the strip's."""
ARROWS = (0.14, 0.42, 0.58, 0.86)
"""Where the path has arrows, in parts of its states."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the flat strip with the gripper's path and (b) the folded strip; the fold line is blue.

    Both are states of the R-path, its first and its last; the width is made up.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.plans.dataset`.
    """
    plan = planned(data, "r-path")
    length = float(plan.arc[-1])
    deep = WIDTH * length * SLANT
    across = (-0.55 * length, 0.55 * length + deep[0])
    low = -0.08 * length
    tops = [plan.states[:, 0, 1].max() + 0.5 * deep[1] + 0.09 * length, deep[1] + 0.12 * length]
    ups = [top - low for top in tops]
    fig = style.figure(style.WIDTH * sum(ups) / (across[1] - across[0]))
    fig.set_layout_engine("none")  # nothing to arrange: the panels fill the figure
    fill = {"left": 0, "right": 1, "bottom": 0, "top": 1, "hspace": 0}
    axes = fig.subplots(2, 1, height_ratios=ups, gridspec_kw=fill)
    titles = ("(a) initial state", "(b) folded state")
    for ax, state, top, title in zip(axes, plan.states[[0, -1]], tops, titles, strict=True):
        ax.set(aspect="equal", xlim=across, ylim=(low, top))
        ax.axis("off")
        _strip(ax, layered(state, LAYER * length), deep)
        ax.text(across[0] + 0.02 * length, top - 0.02 * length, title, va="top")
    _initial(axes[0], plan, deep)
    _folded(axes[1], plan.states[-1], deep)
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


def _fold_line(ax: Axes, deep: Array, order: float) -> None:
    ax.plot([0.0, deep[0]], [0.0, deep[1]], color=BLUE, lw=1.8, zorder=order, label="_fold-line")


def _name(ax: Axes, at: Array, text: str, colour: str, offset: tuple[float, float], ha: str) -> None:
    ax.annotate(text, (at[0], at[1]), offset, textcoords="offset points", ha=ha, va="center", color=colour, fontsize=8)


def _initial(ax: Axes, plan: Part, deep: Array) -> None:
    path = plan.states[:, 0] + 0.5 * deep
    ax.plot(*path.T, color=BLACK, lw=0.9, zorder=5, label="_path")
    arrow = {"arrowstyle": "-|>", "lw": 0.9, "color": BLACK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8}
    for part in ARROWS:
        i = int(part * (len(path) - 1))
        ax.annotate("", xy=tuple(path[i + 1]), xytext=tuple(path[i - 1]), arrowprops=arrow, zorder=6)
    _fold_line(ax, deep, 5.0)
    ax.plot(*path[0], "o", color=GRASPING, ms=4, zorder=7, label="_gripper")
    _name(ax, np.zeros(2), "fold line", BLUE, (0, -7), "center")
    _name(ax, plan.states[0, 0], "grasped", GRASPING, (-2, -7), "left")
    _name(ax, plan.states[0, -1], "held", HOLDING, (2, -7), "right")
    top = path[int(np.argmax(path[:, 1]))]
    _name(ax, top, "folding path", BLACK, (0, 7), "center")


def _folded(ax: Axes, state: Array, deep: Array) -> None:
    _fold_line(ax, deep, 2.0)
    ax.plot(*(state[0] + 0.5 * deep), "o", color=GRASPING, ms=4, zorder=7, label="_gripper")

"""Figures of single results and the stability map, for their ``plot()``: arrays in, a figure out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.base.arrays import Array, Mask
from stripfold.draw.colours import (
    BLACK,
    CRITICAL,
    FRICTION,
    GREY,
    GRIPPER,
    HANGING,
    LYING,
    PINK,
    SETTLED,
    SHADE,
    SKY,
    STATIC,
    TOUCHING,
)
from stripfold.draw.style import CM, around, equal_panels, figure, legend_above, styled

ETA_B_STYLES = ((SKY, "--"), (BLACK, "-"), (PINK, ":"))
"""Colours and kinds of line of the least, the given and the largest eta_b."""


@styled
def draw_strip(
    states: Sequence[Array], path: Array | None = None, marks: Array | None = None, fallen: Sequence[Array] = ()
) -> Figure:
    """Draw states of a strip, grey and the last one black, those after a fall green, with the path of the gripper.

    ``states``, ``fallen``: mid-surfaces, shape (n, 2) each, m; may be none.  ``path``: places of the gripper, shape
    (k, 2), m.  ``marks``: critical places on the path, shape (j, 2), m.
    """
    drawn = [*states, *fallen, *([path] if path is not None else [])]
    fig, (ax,) = equal_panels([around(CM * np.vstack(drawn))], above=0.42 if path is not None else 0.0)
    for group, colour, last, name in (
        (states, STATIC, CRITICAL, "before a fall" if len(fallen) else ""),
        (fallen, SETTLED, SETTLED, "after it"),
    ):
        for i, state in enumerate(group):
            is_last = i == len(group) - 1
            label = f"last state {name}".rstrip() if is_last else "_state"
            ax.plot(*(CM * state.T), color=last if is_last else colour, lw=1.4 if is_last else 0.7, label=label)
    if path is None:
        return fig
    ax.plot(*(CM * path.T), color=GRIPPER, ls="--", lw=1.0, label="gripper")
    if marks is not None and len(marks):
        ax.plot(*(CM * np.asarray(marks).T), "x", color=GRIPPER, mew=1.4, zorder=4, label="critical point")
    legend_above(fig, ax.get_legend_handles_labels()[0], fontsize=7)
    return fig


@styled
def draw_along(waypoints: Array, distances: Array, names: Sequence[str], asked: float | None) -> Figure:
    """Draw the distance from snap boundaries, the height and the rotation of the gripper over time.

    ``waypoints``: time, x, z and rotation, shape (n, 4), s, m and degrees.  ``distances``: from the boundaries of the
    strips of :data:`ETA_B_STYLES`, shape (3, n), m, and their ``names``.  ``asked``: the margin asked for, if any, m.
    """
    t, _, z, angle = waypoints.T
    fig = figure(4.2)
    margin, height, rotation = fig.subplots(3, 1, sharex=True)
    for name, distance, (colour, line) in zip(names, distances, ETA_B_STYLES, strict=True):
        margin.plot(t, CM * distance, line, color=colour, label=name)
    if asked is not None:
        margin.axhline(CM * asked, color=GREY, lw=0.8, ls="--", label="asked")
    margin.axhline(0.0, color=TOUCHING, lw=0.8)
    margin.set_ylabel("from the snap [cm]")
    margin.legend(title=r"$\eta_b$ [m$^{-4}$ s$^2$]", fontsize=7, title_fontsize=7)
    height.plot(t, CM * z, color=GRIPPER)
    height.set_ylabel("$z$ [cm]")
    rotation.plot(t, angle, color=GRIPPER)
    rotation.set(ylabel="angle [degree]", xlabel="time [s]")
    return fig


LEVELS = (0.1, 0.2, 0.3)
"""Margins that are drawn, over the length of the strip."""
CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    "snap": ("snap", {"color": TOUCHING, "lw": 1.8}),
    "sag_touch": ("sag touches or comes off", {"color": LYING, "lw": 1.0, "ls": "--"}),
    "lifted": ("hanging, all lifted", {"color": GREY, "lw": 1.0}),
    "lifted_landed": ("landed, all lifted", {"color": GREY, "lw": 1.0, "ls": ":"}),
}


@styled
def draw_stability(
    curves: Mapping[str, Array],
    grid: tuple[Array, Array],
    margin: Array,
    length: float,
    friction: tuple[Array, Mask, str] | None = None,
    path: Array | None = None,
) -> Figure:
    """Draw the boundaries and lines of equal margin, all in m.

    ``curves``: those of :data:`CURVES`, shape (n, 2) each.  ``grid``, ``margin``: places x and z, and margins, shape
    (z, x).  ``length``: of the strip.  ``friction``: ends of the advance with friction, whether the strip snaps there,
    and for which history they are.  ``path``: places of the gripper on a path, shape (k, 2).
    """
    curves = {name: CM * curves[name] for name in CURVES}
    shown = list(curves.values())
    if path is not None:
        # No path of a plan goes where a landed strip is lifted.
        shown = [*(curve for name, curve in curves.items() if name != "lifted_landed"), CM * path]
    fig, (ax,) = equal_panels([around(np.vstack(shown))], above=0.56)
    ax.set(xlabel="gripper $x$ [cm]", ylabel="gripper $z$ [cm]")
    levels = [CM * length * share for share in LEVELS]
    draw_map(ax, curves, CM * grid[0], CM * grid[1], CM * margin, levels, "cm")
    if friction is not None:
        places, snaps, history = friction
        places = CM * places
        ax.plot(*places.T, "-o", color=FRICTION, lw=1.2, ms=3.0, zorder=4, label="with friction (open: sag touches)")
        ax.plot(*places[~snaps].T, "o", color=FRICTION, mfc="white", ms=3.0, zorder=4)
        ax.text(0.6, 0.07, fill(history, 30), transform=ax.transAxes, ha="center", fontsize=6.5)
    if path is not None:
        ax.plot(*(CM * path).T, color=GRIPPER, lw=1.6, label="gripper", zorder=5)
    legend_above(fig, ax.get_legend_handles_labels()[0], fontsize=7)
    return fig


def draw_map(
    ax: Axes, curves: Mapping[str, Array], x: Array, z: Array, margin: Array, levels: list[float], unit: str
) -> None:
    """Draw the curves of :data:`CURVES`, shape (n, 2) each, and lines of equal margin, shape (z, x), labelled."""
    low = curves["sag_touch"][:, 1] <= curves["snap"][0, 1]
    region = np.vstack([curves["lifted"], curves["snap"][::-1], curves["sag_touch"][low][::-1]])
    ax.fill(*region.T, color=SHADE, lw=0.0, zorder=0)
    for name, (label, style) in CURVES.items():
        ax.plot(*curves[name].T, label=label, zorder=3, **style)
    lines = ax.contour(x, z, margin, levels, colors=HANGING, linewidths=0.6)
    ax.clabel(lines, fmt="%.2g", fontsize=6)
    ax.plot([], [], color=HANGING, lw=0.6, label=f"distance from the snap [{unit}]")

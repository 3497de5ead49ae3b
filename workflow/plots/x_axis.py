"""Motion along x: the model's geometry, the states of one branch, and lambda over the deflection."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from plots.pieces import arrow, draw_states, drawings, entry
from plots.readers import Branch, branch, evenly
from stripfold.base.arrays import Array
from stripfold.draw.collapse_curve import deflection_axes, enlarged, level, smooth
from stripfold.draw.colours import BLACK, CRITICAL, FIXED, GREY, GRIPPER, LEVEL, MID_SURFACE, STRIP, UNSTABLE
from stripfold.draw.style import CM, equal_panels, figure, legend_above, styled, text_at

ADVANCE = 0.85
"""Part of the way from lambda_0 to lambda_c: later the exaggerated outline would cut into the lower layer."""
SLENDERNESS = 35.0
"""Length over thickness as drawn."""

# Triangles that point at the left, right and upper end of the strip; their tip is at the origin.
_LEFT, _RIGHT = [(0.0, 0.0), (-1.0, 0.6), (-1.0, -0.6)], [(0.0, 0.0), (1.0, 0.6), (1.0, -0.6)]
_ABOVE = [(0.0, 0.0), (0.6, 1.0), (-0.6, 1.0)]


@styled
def draw_geometry(data: xr.Dataset) -> Figure:
    """Draw the strip (a) flat and (b) in a state on the way to the critical point, at a gripper height of about 3 L*.

    The floor is drawn under the outer face; the thickness is exaggerated, and the figure says by how much.
    ``data`` is from :func:`tasks.x_axis.run`.
    """
    unit, length = float(data.attrs["gravity_length"]), float(data.attrs["length"])
    chosen = branch(data, 3.0)
    wanted = chosen.lambda_0 + ADVANCE * (chosen.lambda_c - chosen.lambda_0)
    state = chosen.states[int(np.abs(chosen.advance[: chosen.critical] - wanted).argmin())] / length
    # Thinner than the bends are wide, else the outline would cross itself.
    thickness = min(1.0 / SLENDERNESS, 0.7 * unit / length)
    flat = np.array([[-0.5, 0.0], [0.5, 0.0]])
    spans = [(-0.06, 0.17), (-0.06, float(state[:, 1].max()) + 0.13)]
    # In lengths of the strip.
    fig, axes = drawings((-0.57, 0.57), spans, ("(a) reference configuration", "(b) deformed configuration"))
    for ax, middle, grasped in zip(axes, (flat, state), (_LEFT, _ABOVE), strict=True):
        _floor(ax, -0.5 * thickness)
        ax.add_patch(Polygon(outline(middle, thickness), facecolor=STRIP, edgecolor=BLACK, lw=0.6, zorder=2))
        ax.plot(*middle.T, color=MID_SURFACE, lw=1.3, zorder=3, label="_mid-surface")
        for point, marker, colour, name in ((-1, _RIGHT, FIXED, "holding"), (0, grasped, GRIPPER, "grasping")):
            (mark,) = ax.plot(*middle[point], ls="none", marker=marker, ms=16, mew=0, color=colour, zorder=4)
            mark.set_label(f"_{name}-point")
    _label_reference(axes[0], thickness)
    _label_deformed(axes[1], thickness * length / float(data.attrs["thickness"]))
    return fig


def outline(middle: Array, thickness: float) -> Array:
    """Closed outline of a strip: its mid-surface, shape (n, 2), moved by half the thickness both ways."""
    tangent = np.gradient(middle, axis=0)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1)[:, None]
    half = 0.5 * thickness * normal
    return np.concatenate([middle + half, (middle - half)[::-1]])


def _floor(ax: Axes, level: float) -> None:
    ground = Rectangle((-0.555, level - 0.03), 1.11, 0.03, hatch="////////", fc="none", ec=GREY, lw=0.0)
    ax.add_patch(ground).set_label("_floor")
    ax.plot([-0.555, 0.555], [level, level], color=BLACK, lw=0.8, zorder=1)


def _label_reference(ax: Axes, thickness: float) -> None:
    """Sizes of the flat strip and names of its ends."""
    top, above, at = 0.5 * thickness, 0.052, 0.25
    small = {"lw": 0.7, "mutation_scale": 6}
    arrow(ax, (-0.5, above), (0.5, above), arrowstyle="<|-|>", **small)
    for x in (-0.5, 0.5):
        ax.plot([x, x], [top, above + 0.01], color=BLACK, lw=0.4)
    arrow(ax, (at, -top - 0.03), (at, -top), **small)
    arrow(ax, (at, top + 0.025), (at, top), **small)
    ax.text(0.0, above + 0.01, "$l$", ha="center", va="bottom")
    ax.text(at + 0.008, top + 0.002, "$h$", va="bottom", fontsize=8)
    ax.text(-0.5, above + 0.015, "grasping point", color=GRIPPER, va="bottom")
    ax.text(0.5, above + 0.015, "holding point", color=FIXED, va="bottom", ha="right")


def _label_deformed(ax: Axes, exaggeration: float) -> None:
    """Axes of coordinates, and by how much the thickness is exaggerated."""
    for head in ((0.1, 0.0), (0.0, 0.1)):
        arrow(ax, (0.0, 0.0), head, lw=0.7, mutation_scale=6)
    ax.plot(0.0, 0.0, "o", ms=2.5, color=BLACK, zorder=6)
    ax.text(0.1, 0.018, "$x$", va="bottom", ha="center")
    ax.text(0.012, 0.1, "$z$", va="top")
    ax.text(0.5, 0.025, "mid-surface", color=MID_SURFACE, ha="right", va="bottom", fontsize=8)
    ax.text(0.5, 0.085, f"thickness drawn\n{exaggeration:.0f} times too large", ha="right", va="bottom", fontsize=8)


STATES, UNSTABLE_STATES = 9, 2
"""Largest numbers of states drawn between lambda_0 and lambda_c, and past it."""


@styled
def draw_motion(data: xr.Dataset) -> Figure:
    """Draw mid-surfaces along one branch: stable ones solid, unstable ones dashed.

    ``data`` is from :func:`tasks.x_axis.run`; the gripper height nearest 10 L* is drawn.
    """
    chosen = branch(data, 10.0)
    states, last = chosen.states, chosen.critical
    start, end = states[0][0], states[last][0]
    # As wide as the states need: most of the flat part is left out.
    left = min(float(state[:, 0].min()) for state in states)
    right = min(0.5 * float(data.attrs["length"]), float(end[0]) + 0.4 * float(end[0] - left))
    margin = CM * 0.04 * (right - left)
    xlim, ylim = (CM * left - margin, CM * right + margin), (-margin, 1.12 * CM * chosen.height + 2.0 * margin)
    fig, (ax,) = equal_panels([(xlim, ylim)], above=0.25)
    between = evenly(chosen.deflection, 0, last, STATES + 2)[1:-1]
    # From light to dark as the gripper advances.
    for shade, i in zip(np.linspace(0.82, 0.5, len(between)), between, strict=True):
        draw_states(ax, [states[i]], "stable", color=str(shade), lw=0.9, zorder=2)
    for i, name in ((0, "lambda_0"), (last, "lambda_c")):
        draw_states(ax, [states[i]], name, color=CRITICAL, lw=1.5, zorder=4)
    past = evenly(chosen.deflection, last, len(states) - 1, UNSTABLE_STATES + 1)[1:]
    draw_states(ax, [states[i] for i in past], "unstable", color=UNSTABLE, lw=0.9, ls="--", zorder=3)
    draw_gripper(ax, start, end)
    text_at(ax, CM * start, r"$\lambda_0$")
    text_at(ax, CM * end, r"$\lambda_c$")
    legend_above(fig, [entry("stable", "0.55", lw=0.9), entry("unstable", UNSTABLE, "--", lw=0.9)])
    return fig


def draw_gripper(ax: Axes, start: Array, end: Array, label: Array | None = None) -> None:
    """The gripper's way between two points, m, as an arrow with its height, halfway or over ``label``."""
    arrow(ax, CM * start, CM * end, color=GRIPPER, lw=1.2)
    at = CM * (0.5 * (start + end) if label is None else label)
    text_at(ax, at, f"gripper, $z$ = {CM * start[1]:.1f} cm", color=GRIPPER)
    ax.plot(*(CM * start), "o", ms=3, color=GRIPPER, zorder=6, label="_gripper")


@styled
def draw_deflection(data: xr.Dataset) -> Figure:
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

"""The model's geometry: reference and deformed configuration, with the boundary conditions."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from plots.pieces import arrow, drawings
from plots.readers import branch
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, FIXED, GREY, GRIPPER, MID_SURFACE, STRIP
from stripfold.draw.style import styled

ADVANCE = 0.85
"""Part of the way from lambda_0 to lambda_c: later the exaggerated outline would cut into the lower layer."""
SLENDERNESS = 35.0
"""Length over thickness as drawn."""

# Triangles that point at the left, right and upper end of the strip; their tip is at the origin.
_LEFT, _RIGHT = [(0.0, 0.0), (-1.0, 0.6), (-1.0, -0.6)], [(0.0, 0.0), (1.0, 0.6), (1.0, -0.6)]
_ABOVE = [(0.0, 0.0), (0.6, 1.0), (-0.6, 1.0)]


@styled
def draw(data: xr.Dataset) -> Figure:
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

"""The model's geometry: reference and deformed configuration, with the boundary conditions."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from stripfold.arrays import Array
from stripfold.plots.states import branch
from stripfold.plots.style import BLACK, GRASPING, GREY, HOLDING, MID_SURFACE, STRIP, WIDTH, figure, styled

ADVANCE = 0.85
"""Part of the way from lambda_0 to lambda_c: later the exaggerated outline would cut into the lower layer."""
SLENDERNESS = 35.0
"""Length over thickness as drawn."""
HALF_WIDTH = 0.57
"""Half of the width of the picture over the strip's length."""

# Triangles whose tip is at the point that they mark.
_LEFT = [(0.0, 0.0), (-1.0, 0.6), (-1.0, -0.6)]
_RIGHT = [(0.0, 0.0), (1.0, 0.6), (1.0, -0.6)]
_ABOVE = [(0.0, 0.0), (0.6, 1.0), (-0.6, 1.0)]


@styled
def draw(data: xr.Dataset, height: float | None = None) -> Figure:
    """Draw the strip (a) flat and (b) in a state on the way to the critical point.

    The floor is drawn under the outer face; the thickness is exaggerated, and the figure says by how much.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.x_axis.run`.
    height
        Gripper height, m; the nearest one with a snap is drawn, by default the one nearest 3 L*.
    """
    chosen = branch(data, 3.0 * float(data.attrs["gravity_length"]) if height is None else height)
    wanted = chosen.lambda_0 + ADVANCE * (chosen.lambda_c - chosen.lambda_0)
    state = chosen.states[int(np.abs(chosen.advance[: chosen.critical] - wanted).argmin())]
    length = float(data.attrs["length"])
    # Thinner than the bends are wide, else the outline would cross itself.
    thickness = min(length / SLENDERNESS, 0.7 * float(data.attrs["gravity_length"]))
    flat = np.array([[-length / 2.0, 0.0], [length / 2.0, 0.0]])
    spans = [(-0.06 * length, 0.17 * length), (-0.06 * length, state[:, 1].max() + 0.13 * length)]
    sizes = [high - low for low, high in spans]

    fig = figure(WIDTH * sum(sizes) / (2.0 * HALF_WIDTH * length))
    fig.set_layout_engine("none")  # nothing to arrange: the panels fill the figure
    axes = fig.subplots(
        2, 1, height_ratios=sizes, gridspec_kw={"left": 0, "right": 1, "bottom": 0, "top": 1, "hspace": 0}
    )
    for ax, middle, span in zip(axes, (flat, state), spans, strict=True):
        ax.set(aspect="equal", xlim=(-HALF_WIDTH * length, HALF_WIDTH * length), ylim=span)
        ax.axis("off")
        _floor(ax, length, thickness)
        ax.add_patch(Polygon(outline(middle, thickness), facecolor=STRIP, edgecolor=BLACK, lw=0.6, zorder=2))
        ax.plot(*middle.T, color=MID_SURFACE, lw=1.3, zorder=3, label="_mid-surface")
        _mark(ax, middle[-1], _RIGHT, HOLDING, "holding-point")
    _mark(axes[0], flat[0], _LEFT, GRASPING, "grasping-point")
    _mark(axes[1], state[0], _ABOVE, GRASPING, "grasping-point")
    _label_reference(axes[0], length, thickness)
    _label_deformed(axes[1], length, thickness / float(data.attrs["thickness"]))
    return fig


def outline(middle: Array, thickness: float) -> Array:
    """Closed outline of a strip: its mid-surface, shape (n, 2), moved by half the thickness both ways."""
    tangent = np.gradient(middle, axis=0)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1)[:, None]
    half = 0.5 * thickness * normal
    return np.concatenate([middle + half, (middle - half)[::-1]])


def _floor(ax: Axes, length: float, thickness: float) -> None:
    depth, left = 0.03 * length, -0.555 * length
    low = -thickness / 2.0
    ground = Rectangle((left, low - depth), -2.0 * left, depth, hatch="////////", fc="none", ec=GREY, lw=0.0)
    ground.set_label("_floor")
    ax.add_patch(ground)
    ax.plot([left, -left], [low, low], color=BLACK, lw=0.8, zorder=1)


def _mark(ax: Axes, point: Array, marker: list[tuple[float, float]], colour: str, name: str) -> None:
    ax.plot(*point, ls="none", marker=marker, ms=16, mew=0, color=colour, zorder=4, label=f"_{name}")


def _arrow(ax: Axes, tail: tuple[float, float], head: tuple[float, float], style: str = "-|>") -> None:
    properties = {
        "arrowstyle": style,
        "lw": 0.7,
        "color": BLACK,
        "shrinkA": 0,
        "shrinkB": 0,
        "mutation_scale": 6,
    }
    ax.annotate("", xy=head, xytext=tail, arrowprops=properties, zorder=5)


def _label_reference(ax: Axes, length: float, thickness: float) -> None:
    """Sizes of the flat strip and names of its parts."""
    half, top, above = length / 2.0, thickness / 2.0, 0.052 * length
    _arrow(ax, (-half, above), (half, above), "<|-|>")
    for x in (-half, half):
        ax.plot([x, x], [top, above + 0.01 * length], color=BLACK, lw=0.4)
    ax.text(0.0, above + 0.01 * length, "$l$", ha="center", va="bottom")
    at = 0.25 * length
    _arrow(ax, (at, -top - 0.03 * length), (at, -top))
    _arrow(ax, (at, top + 0.025 * length), (at, top))
    ax.text(at + 0.008 * length, 0.002 * length + top, "$h$", va="bottom", fontsize=8)
    ax.text(-half, above + 0.015 * length, "grasping point", color=GRASPING, va="bottom")
    ax.text(half, above + 0.015 * length, "holding point", color=HOLDING, va="bottom", ha="right")
    ax.text(-0.55 * length, 0.165 * length, "(a) reference configuration", va="top")


def _label_deformed(ax: Axes, length: float, exaggeration: float) -> None:
    """Axes of coordinates, and by how much the thickness is exaggerated."""
    reach = 0.1 * length
    _arrow(ax, (0.0, 0.0), (reach, 0.0))
    _arrow(ax, (0.0, 0.0), (0.0, reach))
    ax.plot(0.0, 0.0, "o", ms=2.5, color=BLACK, zorder=6)
    ax.text(reach, 0.018 * length, "$x$", va="bottom", ha="center")
    ax.text(0.012 * length, reach, "$z$", va="top")
    high = ax.get_ylim()[1]
    ax.text(-0.55 * length, high, "(b) deformed configuration", va="top")
    for y, colour, text in (
        (0.025, MID_SURFACE, "mid-surface"),
        (0.085, BLACK, f"thickness drawn\n{exaggeration:.0f} times too large"),
    ):
        ax.text(0.5 * length, y * length, text, color=colour, ha="right", va="bottom", fontsize=8)

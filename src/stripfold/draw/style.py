"""Sizes and pieces that figures share; the settings are in ``stripfold.mplstyle``, the colours in ``colours``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETLEFT

from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, FIXED, GREY

P = ParamSpec("P")
R = TypeVar("R")
Span = tuple[float, float]
Limits = tuple[Span, Span]
Point = Array | Span

WIDTH = 3.5
"""Width of a figure, inches: one column of the journal."""
CM, MILLI = 100.0, 1000.0
"""Centimetres in a metre; millimetres in a metre, millijoules in a joule."""


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with the style sheet, whatever the user's settings are; nothing global stays changed."""

    @wraps(function)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with style.context(["default", "stripfold.draw.stripfold"]):
            return function(*args, **kwargs)

    return inner


def figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure, sizes in inches, that arranges its axes itself."""
    return Figure(figsize=(width, height), layout="constrained")


def equal_panels(limits: Sequence[Limits], above: float = 0.0, one_x: bool = False) -> tuple[Figure, list[Axes]]:
    """Views of the strip below each other: x and z in cm to equal scales, the hatched floor, no grid.

    Each panel has its own limits of x and z; ``above`` is room for a legend, inches.  With ``one_x`` only the lowest
    panel has numbers and a name at its x axis.
    """
    left, right, below, top = 0.5, 0.1, 0.42, 0.05 + above  # inches
    across = WIDTH - left - right
    heights = [across * (z[1] - z[0]) / (x[1] - x[0]) for x, z in limits]
    gap = 0.1 if one_x else below + 0.08
    total = below + sum(heights) + gap * (len(heights) - 1) + top
    # Placed by hand: constrained layout misjudges axes of a fixed shape.
    fig = Figure(figsize=(WIDTH, total))
    under = total - top
    for height, (xlim, ylim) in zip(heights, limits, strict=True):
        under -= height
        ax = fig.add_axes((left / WIDTH, under / total, across / WIDTH, height / total))
        strip_axes(ax, xlim, ylim)
        under -= gap
    if one_x:
        for ax in fig.axes[:-1]:
            ax.tick_params(labelbottom=False)
            ax.set_xlabel("")
    return fig, fig.axes


def strip_axes(ax: Axes, xlim: Span, ylim: Span) -> None:
    """Make ``ax`` a view of the strip: x and z in cm to equal scales, with the floor."""
    ax.set(aspect="equal", xlim=xlim, ylim=ylim, xlabel="$x$ [cm]", ylabel="$z$ [cm]")
    ax.locator_params(nbins=8, steps=[1, 2, 5, 10])
    ax.grid(visible=False)
    ax.axhspan(ylim[0], 0.0, fc="none", ec=GREY, hatch="////////", lw=0.0, zorder=0).set_label("_floor")
    ax.axhline(0.0, color=BLACK, lw=0.6, zorder=1)


def around(points: Array, sides: float = 0.03, above: float = 0.1) -> Limits:
    """Limits of x and z that show ``points``, shape (..., 2), and the floor; room in parts of their width."""
    x, z = points[..., 0], points[..., 1]
    width = float(x.max() - x.min())
    side = sides * width
    return (float(x.min()) - side, float(x.max()) + side), (-side, float(z.max()) + above * width)


def legend_above(fig: Figure, handles: Iterable[Any] | None = None, ncols: int = 2, **options: Any) -> None:
    """A legend over the axes of ``fig``: of ``handles``, or of all that has a label."""
    arranged = fig.get_layout_engine() is not None
    options |= {"loc": "outside upper center"} if arranged else {"loc": "upper center", "borderaxespad": 0.3}
    if handles is not None:
        options["handles"] = list(handles)
    fig.legend(ncols=ncols, **options)


def text_at(ax: Axes, at: Point, text: str, offset: Span = (0, 4), **options: Any) -> None:
    """Text beside the point ``at``, ``offset`` points away from it; above it by default."""
    options = {"ha": "center", "va": "bottom"} | options
    ax.annotate(text, (at[0], at[1]), offset, textcoords="offset points", **options)


def draw_held_end(ax: Axes, end: Point) -> None:
    """A mark at the end that stays in place, m."""
    x, z = CM * end[0], CM * end[1]
    ax.plot(x, z, marker=CARETLEFT, color=FIXED, ms=6, mew=0, clip_on=False, zorder=7, label="_held-end")

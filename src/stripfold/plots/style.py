"""Sizes and pieces that figures share; the settings are in ``stripfold.mplstyle``, the colours in ``colours``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.offsetbox import AnchoredText

from stripfold.arrays import Array
from stripfold.plots.colours import BLACK, GREY

P = ParamSpec("P")
R = TypeVar("R")
Span = tuple[float, float]
Limits = tuple[Span, Span]
Point = Array | Span

WIDTH = 3.5
"""Width of a figure, inches: one column of the journal."""
CM, MILLI = 100.0, 1000.0
"""Centimetres in a metre; millimetres in a metre, millijoules in a joule."""

ETA_TITLE = r"$\eta_b$ [m$^{-4}$ s$^2$]"
"""Name and unit of the weight-to-bending-stiffness ratio."""


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with the style sheet, whatever the user's settings are; nothing global stays changed."""

    @wraps(function)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with style.context(["default", "stripfold.plots.stripfold"]):
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


def drawings(xlim: Span, ylims: Sequence[Span], titles: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """Panels below each other without axes that fill the figure; equal scales, a title at the upper left."""
    heights = [high - low for low, high in ylims]
    fig = Figure(figsize=(WIDTH, WIDTH * sum(heights) / (xlim[1] - xlim[0])))
    fill = {"left": 0, "right": 1, "bottom": 0, "top": 1, "hspace": 0}
    axes = fig.subplots(len(ylims), 1, height_ratios=heights, gridspec_kw=fill)
    for ax, ylim, title in zip(axes, ylims, titles, strict=True):
        ax.set(aspect="equal", xlim=xlim, ylim=ylim)
        ax.axis("off")
        ax.annotate(title, (0, 1), (4, -3), xycoords="axes fraction", textcoords="offset points", va="top")
    return fig, list(axes)


def around(points: Array, sides: float = 0.03, above: float = 0.1) -> Limits:
    """Limits of x and z that show ``points``, shape (..., 2), and the floor; room in parts of their width."""
    x, z = points[..., 0], points[..., 1]
    width = float(x.max() - x.min())
    side = sides * width
    return (float(x.min()) - side, float(x.max()) + side), (-side, float(z.max()) + above * width)


def draw_states(ax: Axes, states: Iterable[Array], name: str, **options: Any) -> None:
    """Draw mid-surfaces, shape (n, 2) each, m; ``name`` is a label that no legend shows."""
    for state in states:
        ax.plot(*(CM * state).T, **{"lw": 0.8} | options, label=f"_{name}")


def entry(label: str, color: str, ls: str = "-", **options: Any) -> Line2D:
    """An entry of a legend."""
    return Line2D([], [], color=color, ls=ls, label=label, **options)


def legend_above(fig: Figure, handles: Iterable[Any] | None = None, ncols: int = 2, **options: Any) -> None:
    """A legend over the axes of ``fig``: of ``handles``, or of all that has a label."""
    arranged = fig.get_layout_engine() is not None
    options |= {"loc": "outside upper center"} if arranged else {"loc": "upper center", "borderaxespad": 0.3}
    if handles is not None:
        options["handles"] = list(handles)
    fig.legend(ncols=ncols, **options)


def arrow(ax: Axes, tail: Point, head: Point, **options: Any) -> None:
    """An arrow from ``tail`` to ``head``, data coordinates."""
    look = {"arrowstyle": "-|>", "lw": 0.8, "color": BLACK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 8} | options
    ax.annotate("", xy=(head[0], head[1]), xytext=(tail[0], tail[1]), arrowprops=look, zorder=5)


def text_at(ax: Axes, at: Point, text: str, offset: Span = (0, 4), **options: Any) -> None:
    """Text beside the point ``at``, ``offset`` points away from it; above it by default."""
    options = {"ha": "center", "va": "bottom"} | options
    ax.annotate(text, (at[0], at[1]), offset, textcoords="offset points", **options)


def note(ax: Axes, text: str, loc: str = "upper left") -> None:
    """Small text in a corner of ``ax``."""
    box = AnchoredText(text, loc=loc, frameon=False, pad=0.2, borderpad=0.2, prop={"size": 8.0})
    box.set_zorder(5)
    ax.add_artist(box)

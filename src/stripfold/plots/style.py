"""One look for all figures: a journal column wide, readable at 800 pixels, safe for colour-blind readers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import NamedTuple, ParamSpec, TypeVar

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.offsetbox import AnchoredText

P = ParamSpec("P")
R = TypeVar("R")

WIDTH = 3.5
"""Width of a figure, inches: one column of the journal."""
CM = 100.0
"""Centimetres in a metre."""

# The palette of Okabe and Ito, and the paper's red.
BLUE, VERMILLION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#000000", "#8C8C8C"
RED = "#D40000"
# What colours stand for.  Two meanings in one figure has only the green of control-parameter/deflection curves, as in
# the paper: lines at a value are thinner than states.
MID_SURFACE = RED
HOLDING, GRASPING = BLUE, "#882288"
UNSTABLE, REFERENCE = VERMILLION, GREEN
FALLING, SETTLED = RED, GREEN
# The two ways out of an R-path; held by friction; where the folded strip lies.
TOUCHING, HANGING, HELD, LYING = RED, BLUE, ORANGE, "#C800A1"
STATES_GREY = "0.62"
STRIP, SHADE = "#DDDDDD", "#EEEEEE"

RC = {
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.grid": True,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.titlesize": 9.0,
    "figure.dpi": 300.0,
    "font.family": "STIXGeneral",
    "font.size": 9.0,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.5,
    "hatch.linewidth": 0.5,
    "legend.fontsize": 8.0,
    "legend.framealpha": 0.9,
    "legend.handlelength": 1.8,
    "legend.title_fontsize": 8.0,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "mathtext.fontset": "stix",
    "savefig.dpi": 300.0,
    # Letters as outlines and names from a fixed salt: the file looks the same everywhere and in every run.
    "svg.fonttype": "path",
    "svg.hashsalt": "stripfold",
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
}


class Look(NamedTuple):
    """Colour and marker of a material."""

    colour: str
    marker: str


_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "p")


def look(index: int) -> Look:
    """Look of the material at ``index`` of its dataset; a colour that comes back has another marker."""
    return Look(_COLOURS[index % len(_COLOURS)], _MARKERS[index % len(_MARKERS)])


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Run ``function`` with this module's settings, whatever the user's are; nothing global stays changed."""

    @wraps(function)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with style.context(["default", RC]):
            return function(*args, **kwargs)

    return inner


def figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure, sizes in inches, that arranges its axes itself."""
    return Figure(figsize=(width, height), layout="constrained")


Limits = tuple[tuple[float, float], tuple[float, float]]


def equal(xlim: tuple[float, float], ylim: tuple[float, float], above: float = 0.0) -> tuple[Figure, Axes]:
    """A figure as high as its one pair of axes needs for equal scales, plus ``above`` inches for a legend."""
    fig, (ax,) = equal_panels([(xlim, ylim)], above)
    return fig, ax


def equal_panels(limits: Sequence[Limits], above: float = 0.0, one_x: bool = False) -> tuple[Figure, list[Axes]]:
    """Axes below each other, each with equal scales for its x and y limits, plus ``above`` inches for a legend.

    With ``one_x`` only the lowest has numbers at its x axis.
    """
    left, right, below, top = 0.5, 0.1, 0.42, 0.05 + above  # inches
    across = WIDTH - left - right
    ups = [across * (ylim[1] - ylim[0]) / (xlim[1] - xlim[0]) for xlim, ylim in limits]
    gap = 0.1 if one_x else below + 0.08
    height = below + sum(ups) + gap * (len(ups) - 1) + top
    # Placed by hand: constrained layout misjudges axes of a fixed shape.
    fig = Figure(figsize=(WIDTH, height))
    axes: list[Axes] = []
    under = height - top
    for up, (xlim, ylim) in zip(ups, limits, strict=True):
        under -= up
        ax = fig.add_axes((left / WIDTH, under / height, across / WIDTH, up / height))
        ax.set(aspect="equal", xlim=xlim, ylim=ylim)
        ax.locator_params(nbins=8, steps=[1, 2, 5, 10])
        ax.tick_params(labelbottom=not one_x or len(axes) == len(limits) - 1)
        axes.append(ax)
        under -= gap
    return fig, axes


def floor(ax: Axes, level: float = 0.0) -> None:
    """Hatched ground from ``level`` to the lower limit of ``ax``, as wide as the axes."""
    low = ax.get_ylim()[0]
    ground = ax.axhspan(low, level, fc="none", ec=GREY, hatch="////////", lw=0.0, zorder=0)
    ground.set_label("_floor")
    ax.axhline(level, color=BLACK, lw=0.6, zorder=1)


def note(ax: Axes, text: str, loc: str = "upper left") -> None:
    """Small text in a corner of ``ax``."""
    box = AnchoredText(text, loc=loc, frameon=False, pad=0.2, borderpad=0.2, prop={"size": 8.0})
    box.set_zorder(5)
    ax.add_artist(box)

"""A picture that eta_b was measured in: the strip found, the fitted shape, and the residual between them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.base.arrays import Array, Picture
from stripfold.draw.colours import BLUE, GREY, MID_SURFACE, ORANGE
from stripfold.draw.style import MILLI, WIDTH, figure, styled
from stripfold.film.cantilever import Cantilever
from stripfold.film.eta import EtaB
from stripfold.film.fold import Fold
from stripfold.film.hanging_loop import FittedLoop

MAX_SIDE = 700
"""Longest side of the picture in the figure, pixels."""


@styled
def draw(found: EtaB) -> Figure:
    """Draw the fit over the picture, and the residual below it, both in mm."""
    image, fit, unit = found.image, found.fit, found.scale * MILLI
    assert isinstance(fit, Fold | Cantilever | FittedLoop)
    shown = fit.line.points if isinstance(fit, Cantilever) and fit.line is not None else fit.curve
    rows, columns = _window(shown, image.shape)
    aspect = (rows.stop - rows.start) / (columns.stop - columns.start)
    height = min(max(0.85 * WIDTH * aspect, 0.9), 3.6)
    fig = figure(height + 1.75)
    above, below = fig.subplots(2, 1, height_ratios=(height, 1.0))
    draw_picture(above, image, unit, rows, columns)
    if isinstance(fit, Cantilever):
        _cantilever(above, below, fit, unit)
    else:
        _loop(above, below, fit, unit)
    below.axhline(0.0, color=GREY, lw=0.6)
    below.set_ylabel("residual [mm]")
    low, high = found.interval
    fig.suptitle(rf"$\eta_b$ = {found.eta_b:.4g} ({low:.4g} to {high:.4g}) m$^{{-4}}$ s$^2$", fontsize=9.0)
    fig.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return fig


def draw_picture(
    ax: Axes, image: Picture, unit: float, rows: slice = slice(None), columns: slice = slice(None)
) -> None:
    """Draw a part of a grey picture in mm, pale; ``unit`` is the size of a pixel, mm, y points down."""
    part = image[rows, columns]
    step = max(1, -(-max(part.shape) // MAX_SIDE))
    top, left = (chosen.indices(n)[0] - 0.5 for chosen, n in zip((rows, columns), image.shape, strict=True))
    extent = (left * unit, (left + part.shape[1]) * unit, (top + part.shape[0]) * unit, top * unit)
    ax.imshow(part[::step, ::step], cmap="gray", extent=extent, alpha=0.75)
    ax.grid(False)
    ax.set(xlabel="mm", ylabel="mm", xlim=extent[:2], ylim=extent[2:])


def _cantilever(above: Axes, below: Axes, shape: Cantilever, unit: float) -> None:
    line, power = shape.line, shape.power
    assert line is not None
    assert power is not None
    above.plot(*(line.points * unit).T, color=MID_SURFACE, label="centreline")
    above.plot(*(shape.curve * unit).T, color=BLUE, lw=1.0, ls="--", label="linear strip")
    s, residual = line.arc * unit, shape.residual * unit
    for centre, half, colour, alpha in ((0.0, line.sd, GREY, 0.4), (residual, shape.sd, BLUE, 0.2)):
        band = 1.96 * half * unit
        below.fill_between(s, centre - band, centre + band, color=colour, alpha=alpha, lw=0.0)
    below.plot(s, residual, color=BLUE, label="_linear")
    if not shape.linear:
        above.plot(*(power.curve * unit).T, color=ORANGE, lw=1.0, ls=":", label=r"$M \sim \kappa^n$")
        below.plot(s, power.residual * unit, color=ORANGE, ls="-", lw=0.9, label="_power")
    below.set(xlabel="arc length from the clamp [mm]", xlim=(s[0], s[-1]))


def _loop(above: Axes, below: Axes, fit: Fold | FittedLoop, unit: float) -> None:
    above.plot(*(fit.points * unit).T, ".", color=MID_SURFACE, ms=2.0, label="strip's middle")
    above.plot(*(fit.curve * unit).T, color=BLUE, lw=1.0, ls="--", label="loop of a linear strip")
    ends = np.array([fit.foot, fit.top]) * unit
    above.plot(*ends.T, color=GREY, lw=1.0, marker="_", label=f"height {fit.height * unit:.4g} mm")
    below.plot(fit.arc * unit, fit.residual * unit, ".", color=MID_SURFACE, ms=2.0)
    below.set(xlabel=f"arc length from the {'lift-off point' if isinstance(fit, Fold) else 'clamp'} [mm]")


def _window(points: Array, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns around ``points``, with some room."""
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    room = 0.08 * max(right - left, bottom - top) + 10.0
    rows = slice(max(int(top - room), 0), min(int(bottom + room), shape[0]))
    columns = slice(max(int(left - room), 0), min(int(right + room), shape[1]))
    return rows, columns

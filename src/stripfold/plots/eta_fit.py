"""A picture that eta_b was measured in: what was found, what was fitted, and what is left between them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.plots.style import BLUE, GREY, ORANGE, RED, WIDTH, styled
from stripfold.vision.eta import EtaB

MM = 1000.0
"""Millimetres in a metre."""
MAX_SIDE = 700
"""Longest side of the picture in the figure, pixels."""


@styled
def draw(image: NDArray[np.uint8], found: EtaB) -> Figure:
    """Draw the fit over the picture, and the residual below it, both in mm.

    Parameters
    ----------
    image
        Grey values, shape (h, w).
    found
        From :func:`stripfold.vision.eta.from_image`.
    """
    unit = found.scale * MM
    places = found.line.points if found.line is not None else np.concatenate([found.fold.upper, found.fold.lower])  # type: ignore[union-attr]
    rows, columns = _window(places, image.shape)
    aspect = (rows.stop - rows.start) / (columns.stop - columns.start)
    height = min(max(0.85 * WIDTH * aspect, 0.9), 3.6)
    fig = Figure(figsize=(WIDTH, height + 1.75), layout="constrained")
    above, below = fig.subplots(2, 1, height_ratios=(height, 1.0))
    step = max(1, int(np.ceil(max(image[rows, columns].shape) / MAX_SIDE)))
    left, right, top, bottom = columns.start - 0.5, columns.stop - 0.5, rows.start - 0.5, rows.stop - 0.5
    extent = (left * unit, right * unit, bottom * unit, top * unit)
    above.imshow(image[rows, columns][::step, ::step], cmap="gray", extent=extent, alpha=0.75)
    above.grid(False)
    above.set(xlabel="mm", ylabel="mm")
    if found.fold is not None:
        _fold(above, below, found, unit)
    else:
        _cantilever(above, below, found, unit)
    below.axhline(0.0, color=GREY, lw=0.6)
    below.set_ylabel("residual / mm")
    low, high = found.interval
    fig.suptitle(
        rf"$\eta_b$ = {found.eta_b:.4g} ({low:.4g} to {high:.4g}) m$^{{-4}}$ s$^2$", fontsize=9.0, x=0.5, ha="center"
    )
    handles, labels = above.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=2)
    return fig


def _cantilever(above: Axes, below: Axes, found: EtaB, unit: float) -> None:
    line, shape, power = found.line, found.shape, found.power
    assert line is not None
    assert shape is not None
    assert power is not None
    above.plot(*(line.points * unit).T, color=RED, lw=1.2, label="centreline")
    above.plot(*(shape.points * unit).T, color=BLUE, lw=1.0, ls="--", label="linear strip")
    s = line.arc * unit
    below.fill_between(s, -1.96 * line.sd * unit, 1.96 * line.sd * unit, color=GREY, alpha=0.4, lw=0.0)
    below.plot(s, shape.residual * unit, color=BLUE, label="_linear")
    band = 1.96 * shape.sd * unit
    below.fill_between(s, shape.residual * unit - band, shape.residual * unit + band, color=BLUE, alpha=0.2, lw=0.0)
    if not found.linear:
        above.plot(*(power.points * unit).T, color=ORANGE, lw=1.0, ls=":", label=r"$M \sim \kappa^n$")
        below.plot(s, power.residual * unit, color=ORANGE, ls="-", lw=0.9, label="_power")
    below.set(xlabel="arc length from the clamp / mm", xlim=(s[0], s[-1]))


def _fold(above: Axes, below: Axes, found: EtaB, unit: float) -> None:
    fold = found.fold
    assert fold is not None
    for name, layer in (("layers' middles", fold.upper), ("_lower", fold.lower)):
        above.plot(*(layer * unit).T, color=RED, lw=1.2, label=name)
    ends = np.array([fold.foot, fold.top]) * unit
    text = f"height {fold.height * unit:.4g} mm"
    above.plot(*ends.T, color=BLUE, lw=1.0, marker="_", label=text)
    below.plot(fold.upper[:, 0] * unit, fold.residual * unit, ".", color=RED, ms=2.0)
    limit = 1.96 * fold.sd * unit
    below.axhspan(-limit, limit, color=GREY, alpha=0.3, lw=0.0)
    below.set(xlabel="along the picture / mm")


def _window(points: Array, shape: tuple[int, ...]) -> tuple[slice, slice]:
    """Rows and columns around ``points``, with some room."""
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    room = 0.08 * max(right - left, bottom - top) + 10.0
    rows = slice(max(int(top - room), 0), min(int(bottom + room), shape[0]))
    columns = slice(max(int(left - room), 0), min(int(right + room), shape[1]))
    return rows, columns

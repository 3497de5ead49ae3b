"""The control-parameter/deflection curve through a collapse."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from stripfold.analysis.phases import AFTER, BEFORE, FALL
from stripfold.arrays import Array
from stripfold.plots.colours import CRITICAL, FALLING, GREY, LEVEL, SETTLED
from stripfold.plots.readers import Collapse, collapse
from stripfold.plots.style import CM, figure, legend_above, styled, text_at

LABELS = {BEFORE: "static, before", FALL: "fall", AFTER: "static, after"}
SMOOTH = 20
"""Points of a curve that are drawn for each state."""
COLOURS = {BEFORE: CRITICAL, FALL: FALLING, AFTER: SETTLED}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda over the deflection: black to lambda_c, red in the fall, green after it.

    ``data`` is from :func:`stripfold.analysis.collapse.run`.
    """
    found = collapse(data)
    right, low, high = CM * float(found.deflection.max()), CM * found.lambda_0, CM * float(found.advance.max())
    fig = figure(3.1)
    ax = deflection_axes(fig, right, low, high)
    _curve(ax, found)
    # Label and inset go where the curve leaves room.
    y = CM * found.lambda_c
    fall_is_high = y > low + 0.6 * (high - low)
    level(ax, "lambda_0", found.lambda_0, 0.12 * right)
    level(ax, "lambda_c", found.lambda_c, 0.0 if fall_is_high else 0.65 * right)
    legend_above(fig, ncols=3, title=f"gripper height $z$ = {CM * found.height:.1f} cm")
    # Enlarged: the fall, in which only a part of the strip moves; the gripper is held a little past lambda_c.
    x = CM * found.deflection[found.part(FALL)]
    wide = float(np.ptp(x))
    inset = enlarged(ax, (0.57, 0.2, 0.4, 0.3) if fall_is_high else (0.15, 0.66, 0.36, 0.3))
    _curve(inset, found)
    inset.axhline(y, color=LEVEL, lw=1.0, zorder=1)
    inset.set_xlim(x.min() - 0.7 * wide, x.max() + 0.7 * wide)
    inset.set_ylim(y - 0.7 * wide, y + 0.7 * wide)
    ax.indicate_inset_zoom(inset, edgecolor=GREY)
    return fig


def deflection_axes(fig: Figure, right: float, low: float, high: float) -> Axes:
    """Axes of lambda, from about ``low`` to ``high``, over a deflection up to about ``right``, all in cm."""
    ax = fig.subplots()
    ax.grid(visible=False)  # it would run behind the inset's numbers
    ax.set_xlabel(r"deflection: rms displacement of the mid-surface from $\lambda_0$ [cm]")
    ax.set_ylabel(r"gripper position $\lambda$ [cm]")
    ax.set_xlim(-0.02 * right, 1.05 * right)
    ax.set_ylim(low - 0.07 * (high - low), high + 0.08 * (high - low))
    return ax


def level(ax: Axes, name: str, value: float, at: float = 0.0) -> None:
    """A line at a gripper position, m, with its name and value from the deflection ``at`` on, cm."""
    ax.axhline(CM * value, color=LEVEL, lw=1.0, zorder=1, label=f"_{name}")
    text = rf"$\{name}$ = {CM * value:.2f} cm"
    text_at(ax, (at, CM * value), text, (0, 0), color=LEVEL, ha="left")


def enlarged(ax: Axes, where: tuple[float, float, float, float]) -> Axes:
    """An inset for a part of ``ax``, at ``where`` in parts of it."""
    inset = ax.inset_axes(where)
    inset.locator_params(nbins=4)
    inset.tick_params(labelsize=7)
    return inset


def smooth(x: Array, y: Array) -> tuple[Array, Array]:
    """A smooth curve through the states of a branch: continuation takes long steps."""
    chord = np.hypot(np.diff(x) / np.ptp(x), np.diff(y) / np.ptp(y))
    # The two states of a bracket are one.
    kept = np.concatenate([[True], chord > 1e-3 * chord.sum()])
    at = np.concatenate([[0.0], np.cumsum(chord)])[kept]
    curve = CubicSpline(at, np.stack([x, y], axis=1)[kept])(np.linspace(0.0, at[-1], SMOOTH * len(x)))
    return curve[:, 0], curve[:, 1]


def _curve(ax: Axes, found: Collapse) -> None:
    x, y = CM * found.deflection, CM * found.advance
    for phase, colour in COLOURS.items():
        if len(part := found.part(phase)):
            line = smooth(x[part], y[part]) if phase is BEFORE else (x[part], y[part])
            ax.plot(*line, color=colour, lw=1.5, zorder=3, label=LABELS[phase])
    ax.plot(x[found.critical], y[found.critical], "o", color=CRITICAL, ms=3.0, zorder=4, label="_critical")

"""lambda over the deflection and over the height of the sag, through a collapse."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from stripfold.base.arrays import Array
from stripfold.base.phases import AFTER, BEFORE, FALL
from stripfold.draw.colours import CRITICAL, FALLING, LEVEL, SETTLED
from stripfold.draw.readers import Collapse, collapse
from stripfold.draw.style import CM, figure, legend_above, styled, text_at

LABELS = {BEFORE: "static, before", FALL: "fall", AFTER: "static, after"}
SMOOTH = 50
"""Points of a curve that are drawn for each state."""
COLOURS = {BEFORE: CRITICAL, FALL: FALLING, AFTER: SETTLED}
STYLES = {BEFORE: "-", FALL: "--", AFTER: "-."}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda over (a) the deflection, (b) the sag's height: black to lambda_c, red in the fall, green after it.

    ``data`` is from :func:`stripfold.ask.collapse.run`.
    """
    found = collapse(data)
    right, low, high = CM * float(found.deflection.max()), CM * found.lambda_0, CM * float(found.advance.max())
    fig = figure(4.6)
    above, below = fig.subplots(2, 1)
    deflection_axes(above, right, low, high)
    _curve(above, CM * found.deflection, found)
    level(above, "lambda_0", found.lambda_0, 0.12 * right)
    level(above, "lambda_c", found.lambda_c, 0.65 * right)
    sag = CM * sag_heights(found.states)
    _curve(below, sag, found)
    highest = float(np.nanmax(sag, initial=0.1))
    level(below, "lambda_c", found.lambda_c, highest)
    below.set_xlim(1.03 * highest, -0.05 * highest)  # falling to the right
    below.set(xlabel="height of the sag [cm]", ylabel=above.get_ylabel())
    # From where there is a sag; as much again past lambda_c, where it lies.
    first = CM * float(found.advance[np.isfinite(sag)].min(initial=found.lambda_c))
    room = max(CM * found.lambda_c - first, 0.02 * (high - low))
    below.set_ylim(CM * found.lambda_c - 1.05 * room, CM * found.lambda_c + 0.5 * room)
    for ax, name in ((above, "(a)"), (below, "(b)")):
        ax.annotate(name, (0, 1), (4, -4), xycoords="axes fraction", textcoords="offset points", va="top")
    legend_above(fig, above.get_legend_handles_labels()[0], ncols=3, title=f"$z$ = {CM * found.gripper_height:.1f} cm")
    return fig


def sag_heights(states: Array) -> Array:
    """Height of the lowest point between gripper and loop, shape (m,), of states, shape (m, n, 2), from the gripper on.

    nan where the strip only falls from the gripper to the floor.
    """
    z = states[..., 1]
    rises = np.diff(z, axis=1) > 1e-6 * z.max()
    heights = np.take_along_axis(z, rises.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where(rises.any(axis=1), heights, np.nan)


def deflection_axes(ax: Axes, right: float, low: float, high: float) -> None:
    """Make ``ax`` one of lambda, from about ``low`` to ``high``, over a deflection up to about ``right``, all in cm."""
    ax.grid(visible=False)  # it would run behind the inset's numbers
    ax.set_xlabel(r"deflection: rms displacement from $\lambda_0$ [cm]")
    ax.set_ylabel(r"gripper position $\lambda$ [cm]")
    ax.set_xlim(-0.02 * right, 1.05 * right)
    ax.set_ylim(low - 0.07 * (high - low), high + 0.08 * (high - low))


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


def _curve(ax: Axes, x: Array, found: Collapse) -> None:
    """lambda over ``x``, which may be nan in the first states, cm."""
    y = CM * found.advance
    for phase, colour in COLOURS.items():
        part = found.part(phase)
        if len(part := part[np.isfinite(x[part])]) > 1:
            line = smooth(x[part], y[part]) if phase is BEFORE and np.ptp(x[part]) > 0.0 else (x[part], y[part])
            ax.plot(*line, color=colour, ls=STYLES[phase], lw=1.5, zorder=3, label=LABELS[phase])
    ax.plot(x[found.critical], y[found.critical], "o", color=CRITICAL, ms=3.0, zorder=4, label="_critical")

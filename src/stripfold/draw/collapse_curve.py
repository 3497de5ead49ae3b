"""A stored collapse, checked, and its figure: lambda over deflection and over the height of the sag; lengths in m."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.base.progress import AFTER, BEFORE, FALL, PHASES
from stripfold.draw.colours import CRITICAL, FALLING, LEVEL, SETTLED
from stripfold.draw.style import CM, figure, legend_above, styled, text_at

_SCALARS = ("gripper_height", "lambda_0", "lambda_c", "touch_time", "touch_x", "settle_time")
_LAYOUT: dict[str, tuple[str, ...]] = {
    "phase": ("state",),
    **dict.fromkeys(("time", "advance", "deflection"), ("state",)),
    **dict.fromkeys(("x", "z"), ("state", "node")),
    **dict.fromkeys(_SCALARS, ()),
}


@dataclass(frozen=True, eq=False)
class Followed:
    """A strip followed, state by state: m states of shape (n, 2), x and z.

    ``advance`` is the way of the gripper.  Times count from the start of a fall; they are nan in statics.
    """

    phase: NDArray[np.str_]
    time: Array
    advance: Array
    states: Array

    def part(self, phase: str) -> Index:
        """Indices of the states of a phase."""
        return np.flatnonzero(self.phase == phase)

    @property
    def critical(self) -> int:
        """Index of the last state before the first fall; the last of all without one."""
        fall = self.part(FALL)
        return int(fall[0] if len(fall) else len(self.phase)) - 1


@dataclass(frozen=True, eq=False)
class Collapse(Followed):
    """Statics before lambda_c, the fall and statics after it at one gripper height.

    Times are nan where nothing touches or comes to rest.
    """

    gripper_height: float
    lambda_0: float
    lambda_c: float
    touch_time: float
    settle_time: float
    touch_x: float
    deflection: Array

    @property
    def touch(self) -> int:
        """Index of the first state that touches; the last of the fall where none does."""
        fall = self.part(FALL)
        return int(fall[-1] if np.isnan(self.touch_time) else fall[np.abs(self.time[fall] - self.touch_time).argmin()])


def collapse(data: xr.Dataset) -> Collapse:
    """The collapse that a dataset from :func:`stripfold.ask.collapse.run` holds.

    Raises InvalidInputError: it holds something else.
    """
    allowed = f"one collapse: finite states of the phases {', '.join(PHASES)} in this order, the last may be missing"
    advice = "use a result of `stripfold simulate`"
    require(data, (*_LAYOUT, "arc"), allowed, advice)
    for name, dims in _LAYOUT.items():
        kind = data[name].dtype.kind
        if data[name].dims != dims or (kind not in "fiu" and name != "phase"):
            found = f"{name} over {', '.join(map(str, data[name].dims)) or 'nothing'}, of kind {kind}"
            raise InvalidInputError("data", found, allowed, advice)
    phase, time, states = data["phase"].values.astype(str), data["time"].values, states_of(data)
    runs = [str(phase[i]) for i in range(len(phase)) if i == 0 or phase[i] != phase[i - 1]]
    if runs not in (list(PHASES), list(PHASES[:2])):
        raise InvalidInputError("data", f"phases {', '.join(runs) or 'none'}", allowed, advice)
    for name, fine in {
        "x or z": np.isfinite(states).all(),
        "advance or deflection": np.isfinite(data[["advance", "deflection"]].to_array()).all(),
        "times of the fall": np.all(np.diff(time[phase == FALL], prepend=0.0) >= 0.0),
    }.items():
        if not fine:
            raise InvalidInputError("data", f"unusable {name}", allowed, advice)
    return Collapse(
        **{name: float(data[name]) for name in _SCALARS},
        phase=phase,
        time=time,
        advance=data["advance"].values,
        deflection=data["deflection"].values,
        states=states,
    )


def states_of(data: xr.Dataset) -> Array:
    """Mid-surfaces, shape (m, n, 2): x and z, m."""
    return np.stack([data["x"].values, data["z"].values], axis=2)


def require(data: xr.Dataset, names: Iterable[str], allowed: str, advice: str = "") -> None:
    """Raise where the dataset lacks one of the variables ``names``."""
    if missing := [name for name in names if name not in data.variables]:
        raise InvalidInputError("data", f"a dataset without {', '.join(missing)}", allowed, advice)


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

"""The first touch of a strip on a disturbed R-path: eta_b wrong, gripper too high or too low, gripper vibrating.

With bending friction the strip is followed in statics; where it is lost it falls in time.  Under vibration it moves in
time from before the stability boundary on.  Lengths in L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import look
from stripfold.base.arrays import Array
from stripfold.draw.colours import LYING
from stripfold.draw.style import figure, legend_above, styled
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.rpath import plan_r_path
from verification.common import Progress, dataset, grid
from verification.friction_touch import SPEED, USUAL, first_touch, in_time, statics
from verification.numbers import Facts, Number

RAMP = 1.0
"""Length travelled over which the gripper departs from its height, L*."""
BEFORE = 0.5
"""Length travelled before the stability boundary at which a vibrating motion begins, L*."""


class Vibrating(NamedTuple):
    """A gripper at constant speed up to ``end``, and an oscillation along its way."""

    start: float
    end: float
    amplitude: float
    frequency: float

    def lam(self, t: float) -> float:
        return min(self.start + SPEED * t, self.end) + self.amplitude * sin(self.frequency * t)

    def rate(self, t: float) -> float:
        steady = SPEED if self.start + SPEED * t < self.end else 0.0
        return steady + self.amplitude * self.frequency * cos(self.frequency * t)


@dataclass(frozen=True)
class Risen(Piece):
    """The piece ``of`` a path, higher by ``rise`` after :data:`RAMP`."""

    of: Piece
    rise: float

    def position(self, s: float) -> Array:
        return self.of.position(s) + np.array([0.0, self.rise * min(s / RAMP, 1.0)])

    def rate(self, s: float) -> Array:
        return self.of.rate(s) + np.array([0.0, self.rise / RAMP if s < RAMP else 0.0])


class Disturbance(NamedTuple):
    """True eta_b over that of the plan, rise of the gripper, amplitude and angular frequency of its vibration."""

    eta_b: float = 1.0
    rise: float = 0.0
    vibration: Sequence[float] = ()


def run(
    length: float = 20.0,
    moments: Sequence[float] = (0.01, 0.37),
    eta_b: Sequence[float] = (0.8, 1.2),
    rises: Sequence[float] = (0.1,),
    vibrations: Sequence[Sequence[float]] = ((0.05, 6.0),),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """First touches less the planned one over ``disturbance`` and ``moment``, 0 among them.

    ``eta_b``: true eta_b over that of the plan.  ``rises``: heights by which the gripper is too high, L*.
    ``vibrations``: amplitudes along the path, L*, and angular frequencies, sqrt(g/L*).
    """
    asked = {
        "none": Disturbance(),
        **{f"eta_b {ratio - 1.0:+.0%}": Disturbance(eta_b=ratio) for ratio in eta_b},
        **{f"height {rise:+g} L*": Disturbance(rise=rise) for rise in rises},
        **{f"vibration {a:g} L*, {w:g}": Disturbance(vibration=(a, w)) for a, w in vibrations},
    }
    case = replace(USUAL, length=length)
    # Where a strip without friction is lost.
    lost = statics(case, plan_r_path(length).path, 0.0).lam
    axes: dict[str, Sequence[Any]] = {"disturbance": list(asked), "moment": [0.0, *moments]}
    return dataset(grid(partial(_error, asked, length, lost), ("touch_error",), axes, threads, progress))


def _error(
    asked: Mapping[str, Disturbance], length: float, lost: float, disturbance: str, moment: float
) -> dict[str, float]:
    one, plan = asked[disturbance], plan_r_path(length)
    # In units of the true L*, which is smaller where eta_b is larger.
    scale = one.eta_b ** (1.0 / 3.0)
    case = replace(USUAL, length=scale * length)
    if one.vibration:
        found = statics(case, plan.path, moment, lost - BEFORE)
        drive = Vibrating(found.lam, plan.path.length - one.vibration[0], *one.vibration)
        x = in_time(case, plan.path, found, drive)
    else:
        path = plan.path.scaled(scale)
        pieces = tuple(Risen(of.start, of.end, of.name, of, one.rise) for of in path.pieces)
        x = first_touch(case, GripperPath(path.name, pieces), moment)["touch_x"]
    return {"touch_error": x / scale - plan.first_touch}


def facts(d: xr.Dataset) -> Facts:
    """The largest error of the first touch for each M_0, the last being that of fabrics."""
    largest = np.abs(d.touch_error).max("disturbance")
    return {
        "fabric": largest[-1],
        "moment": d.moment[-1],
        "free": largest[0],
        "others": ", ".join(f"{float(e):.2f} with {float(e.moment):g}" for e in largest[1:-1]),
        "disturbances": ", ".join(str(name) for name in d.disturbance.values if name != "none"),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("disturbed_rpath_error", "fabric", "L*", "< 0.3",
            "largest error of the first touch on a disturbed R-path with the friction of a fabric, M_0 of {moment:g}; "
            "without friction {free:.2f}, {others} ({disturbances})", lambda f: f.free > f.fabric),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the first touch less the planned one of each disturbance, a mark for each M_0."""
    names = data["disturbance"].values
    rows = -np.arange(len(names), dtype=float)
    fig = figure(1.2 + 0.24 * len(names))
    ax = fig.subplots()
    ax.axvline(0.0, color=LYING, lw=0.8, zorder=1)
    for i, moment in enumerate(data["moment"].values):
        color, marker = look(i)
        error = data["touch_error"].sel(moment=moment).values
        ax.plot(error, rows, marker, color=color, ms=5, mfc="none", label=f"$M_0 = {moment:g}$")
    ax.set_yticks(rows, [_label(name) for name in names])
    ax.tick_params(axis="y", length=0)
    ax.set(xlabel="first touch less planned [$L^*$]")
    legend_above(fig, ncols=2, fontsize=7)
    return fig


def _label(name: str) -> str:
    """A disturbance with its symbols: eta_b, L* and, of a vibration, the angular frequency."""
    for plain, symbol in (
        ("eta_b", r"$\eta_b$"),
        ("L*, ", r"L*, $\omega = $"),
        ("L*", "$L^*$"),
        ("-", "\N{MINUS SIGN}"),
    ):
        name = name.replace(plain, symbol)
    return name

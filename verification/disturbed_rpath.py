"""The first touch of a strip on a disturbed R-path: eta_b wrong, gripper too high or too low, gripper vibrating.

With bending friction the strip is followed in statics; where it is lost it falls in time.  Under vibration it moves in
time from before the stability boundary on.  Lengths in L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 9.
"""

from __future__ import annotations

from collections import deque
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
from stripfold.base.errors import LostStabilityError, SolveError
from stripfold.draw.colours import LYING
from stripfold.draw.style import figure, legend_above, styled
from stripfold.follow.contact_branch import BranchPoint
from stripfold.paths.curve import GripperPath, Piece
from stripfold.paths.rpath import plan_r_path
from verification.common import Progress, dataset, grid
from verification.friction_touch import STIFFEST, first_touch, in_time, statics
from verification.motion_with_friction import Case
from verification.numbers import Facts, Number

RAMP = 1.0
"""Length travelled over which the gripper departs from its height, L*."""
BEFORE = 0.5
"""Length travelled before the stability boundary at which a vibrating motion begins, L*."""


@dataclass(frozen=True)
class Vibrating:
    """A gripper at constant speed up to ``end``, and an oscillation along its way."""

    start: float
    speed: float
    end: float
    amplitude: float
    frequency: float

    def lam(self, t: float) -> float:
        return min(self.start + self.speed * t, self.end) + self.amplitude * sin(self.frequency * t)

    def rate(self, t: float) -> float:
        steady = self.speed if self.start + self.speed * t < self.end else 0.0
        return steady + self.amplitude * self.frequency * cos(self.frequency * t)


class Disturbance(NamedTuple):
    """True eta_b over that of the plan, rise of the gripper, amplitude and angular frequency of its vibration."""

    kind: str
    eta_b: float = 1.0
    rise: float = 0.0
    vibration: tuple[float, float] | None = None


@dataclass(frozen=True)
class Risen(Piece):
    """The piece ``of`` a path, higher by ``rise`` after :data:`RAMP`."""

    of: Piece
    rise: float

    def position(self, s: float) -> Array:
        return self.of.position(s) + np.array([0.0, self.rise * min(s / RAMP, 1.0)])

    def rate(self, s: float) -> Array:
        return self.of.rate(s) + np.array([0.0, self.rise / RAMP if s < RAMP else 0.0])


def _risen(path: GripperPath, rise: float) -> GripperPath:
    """A path that is higher by ``rise`` after :data:`RAMP`."""
    return GripperPath(path.name, tuple(Risen(of.start, of.end, of.name, of, rise) for of in path.pieces))


def vibrated(case: Case, path: GripperPath, moment: float, vibration: Sequence[float], start: float) -> float:
    """x of the first touch under a gripper that vibrates from ``start`` on; with amplitude and angular frequency.

    Raises SolveError: the strip is lost before ``start``, or does not touch.
    """
    steps: list[BranchPoint] = []
    for step in statics(case, path, moment):
        steps = [*steps[-1:], step]
        if step.lam >= start:
            break
    before, last = steps
    drive = Vibrating(last.lam, case.speed, path.length - vibration[0], *vibration)
    return in_time(case, path, before, last, drive)


MOTION = {"yield_curvature": 0.05, "step": 0.2, "speed": 0.05, "air": 0.11, "stiffness": 0.05}


def run(
    length: float = 20.0,
    thickness: float = 0.01,
    moments: Sequence[float] = (0.01, 0.37),
    eta_b: Sequence[float] = (0.8, 1.2),
    rises: Sequence[float] = (0.1,),
    vibrations: Sequence[Sequence[float]] = ((0.05, 6.0),),
    motion: Mapping[str, Any] = MOTION,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """First touches less the planned one over ``disturbance`` and ``moment``, 0 among them.

    ``length``, ``thickness``, ``moments``: the strip that the path is planned for; M_0, without 0.  ``eta_b``: true
    eta_b over that of the plan.  ``rises``: heights by which the gripper is too high, L*.  ``vibrations``: amplitudes
    along the path, L*, and angular frequencies, sqrt(g/L*).  ``motion``: as in :func:`verification.friction_touch.run`.
    """
    case = Case(length, thickness, stiffest=STIFFEST, **motion)
    asked = {
        "none": Disturbance("height"),
        **{f"eta_b {ratio - 1.0:+.0%}": Disturbance("eta_b", eta_b=ratio) for ratio in eta_b},
        **{f"height {rise:+g} L*": Disturbance("height", rise=rise) for rise in rises},
        **{f"vibration {a:g} L*, {w:g}": Disturbance("vibration", vibration=(a, w)) for a, w in vibrations},
    }
    call = partial(_error, case, asked, _lost(case))
    axes: dict[str, Sequence[Any]] = {"disturbance": list(asked), "moment": [0.0, *moments]}
    found = grid(call, ("touch_error",), axes, threads, progress)
    kinds = ("disturbance", [one.kind for one in asked.values()])
    return dataset({**found, "kind": kinds}, {"length": length, "thickness": thickness})


def _lost(case: Case) -> float:
    """Length travelled at which a strip without friction is lost."""
    try:
        deque(statics(case, plan_r_path(case.length).path, 0.0), maxlen=0)
    except LostStabilityError as error:
        return float(error.parameter or np.nan)
    raise SolveError("the strip is stable without friction")


def _error(
    case: Case, asked: Mapping[str, Disturbance], lost: float, disturbance: str, moment: float
) -> dict[str, float]:
    one, plan = asked[disturbance], plan_r_path(case.length)
    # In units of the true L*, which is smaller where eta_b is larger.
    scale = one.eta_b ** (1.0 / 3.0)
    if one.vibration:
        x = vibrated(case, plan.path, moment, one.vibration, lost - BEFORE)
    else:
        disturbed = replace(case, length=scale * case.length)
        x, _ = first_touch(disturbed, _risen(plan.path.scaled(scale), one.rise), moment)
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

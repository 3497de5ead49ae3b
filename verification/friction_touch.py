"""Where a strip with bending friction first touches itself on the triangular and the circular path.

The strip is followed in statics; where it is lost it falls in time with its friction, the gripper moving on.  Lengths
in L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.optimize import brentq

from plots.all_materials import MOMENT
from plots.pieces import PATH_LOOKS, entry, look, note
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.draw.colours import BLACK, LYING, SHADE
from stripfold.draw.style import figure, styled
from stripfold.follow.contact import touch_position, touches
from stripfold.follow.contact_branch import clearance, from_elastica, solved
from stripfold.follow.fall import TIME_OPTIONS
from stripfold.follow.memory import load, with_effects
from stripfold.follow.statics import StripModel
from stripfold.follow.time import model_in_time, set_in_motion
from stripfold.follow.track import End, Track, on_mesh
from stripfold.paths import geometric
from stripfold.paths.curve import GripperPath
from stripfold.paths.rpath import plan_r_path
from stripfold.solve import dynamics
from stripfold.solve.dynamics import Drive, Moving, TimeEvent
from stripfold.solve.schemes import Damping
from stripfold.strip.contact_mesh import LYING as ON_FLOOR
from stripfold.strip.contact_mesh import ContactMesh
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongPath, AlongX, Motion
from verification.common import Progress, dataset, grid
from verification.friction_delay import SIZES, Case, Kept
from verification.numbers import Facts, Number

PATHS = {"triangular": geometric.triangular, "circular": geometric.circular}
FIRST_HEIGHT = 1.5
"""Height of the gripper at the first state, where friction begins, L*: the elastica gives it."""
LONGEST_FREE = 0.6
"""Share of the strip for which the elements are planned."""
NEAR, FINE = 0.3, 0.25
"""Height of the sag, L*, below which steps are shorter, and their share of the others."""
TOUCH_TOLERANCE, LONGEST_FALL = 1e-3, 300.0
"""sqrt(L*/g)."""
SPEED, DAMPING = 0.05, Damping(air=0.11, stiffness=0.05)
"""Of what is followed in time: speed of the gripper, sqrt(g L*)."""
USUAL = Case(20.0, 0.01, yield_curvature=0.05, step=0.2, stiffest=5.0)
"""What touches is found on new elements: springs are less stiff than along x."""
FABRICS = 0.2
"""M_0 / rho_a g L*^2 from which on a strip counts as a fabric here: fabrics.csv begins at 0.22."""


def run(
    lengths: Sequence[float] = (12.0, 20.0),
    moments: Sequence[float] = (0.3, 1.0),
    checked: float = 20.0,
    uncertainty: float = 0.2,
    step: float = USUAL.step,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """First touches over ``path``, ``length`` and ``moment``, 0 among them.

    ``lengths``: ascending.  ``moments``: M_0, ascending, without 0.  ``checked``: length of the strips that are
    computed with halved elements and steps as well.  ``uncertainty``: relative uncertainty of eta_b of the band.
    ``step``: along the path, L*.
    """
    axes: dict[str, Sequence[Any]] = {"path": list(PATHS), "length": lengths, "moment": [0.0, *moments]}
    usual = replace(USUAL, step=step)
    found = grid(partial(_touch, usual), ("touch_x", "fell"), axes, threads, progress)
    finer = replace(usual, refinement=0.5, step=0.5 * step)
    again = grid(partial(_touch, finer), ("touch_x",), axes | {"length": [checked]}, threads, progress)
    # A larger eta_b is a smaller L*.
    units = [(1.0 + sign * uncertainty) ** (-1.0 / 3.0) for sign in (-1.0, 1.0)]
    band = [_with_unit(np.log(lengths), found["touch_x"][1], unit) for unit in units]
    return dataset(
        {
            **found,
            "touch_stiffer": (tuple(axes), band[0]),
            "touch_softer": (tuple(axes), band[1]),
            "planned_x": ("length", [plan_r_path(length).first_touch for length in lengths]),
            "checked_length": ((), checked),
            "checked_x": (("path", "moment"), again["touch_x"][1][:, 0]),
        },
    )


def _touch(case: Case, path: str, length: float, moment: float) -> dict[str, float]:
    return first_touch(replace(case, length=length), PATHS[path](length), moment)


def first_touch(case: Case, path: GripperPath, moment: float) -> dict[str, float]:
    """x of the first touch, origin mid-strip, and whether the strip fell.

    Raises SolveError: a state could not be computed, or the strip does not touch; TimeStepError: the fall could not be
    followed.
    """
    found = statics(case, path, moment)
    if found.end is End.TOUCH:
        problem, point = on_mesh(found.points[-1])
        return {"touch_x": touch_position(problem.model, point), "fell": 0.0}
    if found.end is not End.SNAP:
        raise SolveError("the strip is followed to the path's end without a touch")
    return {"touch_x": in_time(case, path, found, Moving(found.points[-1].lam, SPEED, path.length)), "fell": 1.0}


def statics(case: Case, path: GripperPath, moment: float, end: float = np.inf) -> Track:
    """The strip along a path from :data:`FIRST_HEIGHT` on to ``end``, in steps that are shorter where the sag is low.

    The first state is the elastica's nearest one at this height.  Raises SolveError: a state could not be computed.
    """
    piece = path.pieces[0]
    travelled = brentq(lambda s: piece.position(s)[1] - FIRST_HEIGHT, piece.start, 0.5 * piece.end)
    lam = float(piece.position(travelled)[0]) + case.length / 2.0
    start = elastica.state_no_horizontal_force(FIRST_HEIGHT)
    if lam > start.advance:
        branch = elastica.x_axis_branch(FIRST_HEIGHT, past=0.01, max_step=0.05)
        start = min(branch, key=lambda state: abs(state.advance - lam))
    strip, longest = StripModel(case.length, case.thickness, kind="rod"), np.array([LONGEST_FREE * case.length])
    mesh = Kept.of(case.length, ON_FLOOR, longest, SIZES.scaled(case.refinement), strip.model)

    def kept(contact: Array) -> ContactMesh:
        return replace(mesh, planned=contact, model=mesh.at(contact))

    at = from_elastica(kept, AlongX(FIRST_HEIGHT), start.advance, start)
    for advance in np.linspace(start.advance, lam, 8)[1:]:
        at = solved(at.problem, at.point.q, float(advance))
    at = solved(MovingContact(at.problem.mesh, AlongPath(piece, case.length)), at.point.q, travelled)
    if moment:
        at = with_effects(at, lambda model, q: (case.friction(model, moment, q),))
    now = [at]

    def places() -> Iterator[tuple[Motion, float]]:
        lam = at.lam
        for piece in path.pieces:
            while lam < min(piece.end - 1e-9, end):
                low = len(now) > 1 and clearance(now[-1].problem, now[-1].point.q)[0] < NEAR
                lam = min(lam + case.step * (FINE if low else 1.0), piece.end)
                yield AlongPath(piece, case.length), lam

    return load(at, places(), "touch", progress=now.append)


def in_time(case: Case, path: GripperPath, found: Track, drive: Drive) -> float:
    """x of the first touch of a strip in motion, from its last two static states; ``drive`` begins at the last.

    Raises SolveError: the strip does not touch; TimeStepError: the motion could not be followed.
    """
    before, last = found.branch[-2:]
    problem, first = set_in_motion(before, last, SPEED, model_in_time(last, case.refinement))
    problem = replace(problem, motion=AlongPath(path, case.length))
    touch = TimeEvent(lambda state: touches(problem.model, state), TOUCH_TOLERANCE)
    for state in dynamics.march(problem, first, drive, DAMPING, options=TIME_OPTIONS, until=[touch]):
        if touches(problem.model, state):
            return touch_position(problem.model, state)
        if state.t > LONGEST_FALL:
            break
    raise SolveError("the strip does not come down", parameter=last.lam)


def _with_unit(log_length: Array, x: Array, unit: float) -> Array:
    """First touches, in L*, of strips whose true L* is ``unit`` times that: x interpolated over log(length).

    Outside the lengths that were computed the last two give the slope.
    """
    wanted = log_length - np.log(unit)
    at = np.clip(np.searchsorted(log_length, wanted) - 1, 0, len(log_length) - 2)
    share = (wanted - log_length[at]) / (log_length[at + 1] - log_length[at])
    return np.asarray(unit * (x[:, at] + share[:, None] * (x[:, at + 1] - x[:, at])))


def facts(d: xr.Dataset) -> list[Facts]:
    """First touch less the planned one with the friction of fabrics; one for each path."""
    out = []
    for path in d.path.values:
        one = d.sel(path=path)
        error = one.touch_x - d.planned_x
        real = error.sel(moment=d.moment >= FABRICS)
        band = 0.5 * (one.touch_stiffer - one.touch_softer)
        finer = np.abs(one.touch_x.sel(length=float(d.checked_length)) - one.checked_x)
        out.append(
            {
                "path": str(path),
                "least": error.min(),
                "most": error.max(),
                "without": ", ".join(f"{float(x):+.2f}" for x in error.sel(moment=0.0)),
                "change": np.abs(real - error.sel(moment=0.0)).max(),
                "band": band.max(),
                "error": finer.max(),
                "lengths": ", ".join(f"{length:g}" for length in d.length.values),
                "fell": int((one.fell.sel(moment=d.moment >= FABRICS) == 1.0).sum()),
            }
        )
    return out


def _right(error: xr.DataArray) -> float:
    """The smallest M_0 with which the touch is where planned, linearly in M_0; nan without one."""
    m, e = error.moment.values, error.values
    for i in np.flatnonzero((e[:-1] < 0.0) & (e[1:] >= 0.0)):
        return float(m[i] - e[i] * (m[i + 1] - m[i]) / (e[i + 1] - e[i]))
    return float("nan")


def right_on_triangular(d: xr.Dataset) -> Facts:
    """The friction with which the triangular path first touches where planned."""
    error = d.touch_x.sel(path="triangular") - d.planned_x
    right = {float(length): _right(error.sel(length=length)) for length in d.length.values}
    found = {length: m for length, m in right.items() if np.isfinite(m)}
    return {
        "right": min(found.values(), default=np.nan),
        "each": ", ".join(f"{m:.2f} at {length:g}" for length, m in found.items()) or "none",
        "none": ", ".join(f"{length:g}" for length in right if length not in found) or "no length",
        "largest": d.moment.max(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("friction_touch_{path}", "change", "L*", "no criterion",
            "largest change of the first touch on the {path} path by a fabric's friction (M_0 of 0.3 and more); less "
            "the planned place without friction {without} L* for strips of {lengths} L*, over all M_0 {least:+.2f} to "
            "{most:+.2f} L*; an eta_b known to 20 % moves it by up to +-{band:.2f}, halved elements and steps by "
            "{error:.2f}; with fabrics' friction {fell} strips fall, the others are laid down"),
    ),
    right_on_triangular: (
        Number("friction_right_triangular", "right", "1", "> 0",
            "smallest M_0 / rho_a g L*^2, up to {largest:g}, with which the triangular path first touches where "
            "planned: {each} L*; with none at {none} L*"),
    ),
}
# fmt: on


NONE = 3e-3
"""Where no friction is drawn."""
LINES = ("-", "--", "-.", ":")


@styled
def draw(data: xr.Dataset, fabrics: xr.Dataset) -> Figure:
    """Draw x of the first touch less the planned one over M_0, with the band of an uncertain eta_b, for each path."""
    moment = np.maximum(data["moment"].values, NONE)
    planned, real = data["planned_x"], fabrics["friction"].values
    fig = figure(5.0)
    axes = fig.subplots(2, 1, sharex=True)
    for ax, path, mark in zip(axes, data["path"].values, ("(a)", "(b)"), strict=True):
        of_path = data.sel(path=path)
        for i, length in enumerate(data["length"].values):
            one, at = of_path.sel(length=length), float(planned.sel(length=length))
            color = look(i)[0]
            ax.plot(moment, one["touch_x"] - at, ls=LINES[i % len(LINES)], color=color, label=f"$L = {length:g}\\,L^*$")
            fell = one["fell"].values == 1.0
            for chosen, fill in ((fell, color), (~fell, "white")):
                ax.plot(moment[chosen], (one["touch_x"] - at)[chosen], "o", ms=4, color=color, mfc=fill, label="_marks")
            # Beside each other, in the order of the lengths.
            beside = moment * 1.06 ** (i + 1)
            ax.vlines(beside, one["touch_softer"] - at, one["touch_stiffer"] - at, color=color, lw=0.8, label="_band")
        ax.axhline(0.0, color=LYING, lw=0.8, zorder=1)
        ax.axvspan(real.min(), real.max(), color=SHADE, lw=0.0, zorder=0)
        ax.set(xscale="log", ylabel="first touch less planned [$L^*$]")
        note(ax, f"{mark} {PATH_LOOKS[str(path)][0]}")
    ticks = [NONE, 1e-2, 1e-1, 1.0]
    axes[-1].set_xticks(ticks, ["0", "$10^{-2}$", "$10^{-1}$", "$10^{0}$"])
    axes[-1].set_xlabel(MOMENT.split(": ")[1])
    handles, _ = axes[0].get_legend_handles_labels()
    marks = [entry("fell", BLACK, "", marker="o", ms=4), entry("laid down", BLACK, "", marker="o", ms=4, mfc="white")]
    fig.legend(handles=[*handles, *marks], fontsize=7, loc="outside upper center", ncols=3)
    return fig

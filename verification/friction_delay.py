"""How far bending friction carries the snap of a motion along x, and where it turns the snap into a gradual touch.

Lengths in L*, M_0 in rho_a g L*^2.  Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.friction_needed import MOMENT
from plots.pieces import entry, look, note
from stripfold import elastica
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, FRICTION, GREY, SHADE
from stripfold.draw.style import figure, styled
from stripfold.follow.memory import load_path
from stripfold.follow.statics import StripModel
from stripfold.paths.rpath import plan_r_path
from verification.common import Progress, dataset, grid
from verification.motion_with_friction import SNAP, TOUCH, Case, limit
from verification.numbers import Facts, Number

NARROW = 1.3
"""Ratio of the bracket of the friction from which on the sag touches first."""
LARGEST = 0.4
"""Step without friction, L*."""
FOLDED_LENGTH, FOLD_STEP, FOLD_YIELD = 16.0, 0.2, 0.1
"""Length of the strip that follows the R-path and its steps, L*; kappa_y, with which it is followed to its end."""


def vanishing(case: Case, height: float, snaps: float, touches: float) -> tuple[float, float]:
    """Bracket of the M_0 from which on the sag touches before lambda has a maximum, from a wider one."""
    while touches > NARROW * snaps:
        between = sqrt(snaps * touches)
        snaps, touches = (between, touches) if limit(case, height, between)[0] == SNAP else (snaps, between)
    return snaps, touches


def fold_height(case: Case, moment: float) -> float:
    """Height of the loop at the end of an R-path followed with friction."""
    strip = StripModel(FOLDED_LENGTH, case.thickness, kind="rod")
    mesh, path = strip.contact_mesh(memory=True), plan_r_path(strip.length).path
    case = replace(case, yield_curvature=FOLD_YIELD)
    last = load_path(mesh, path, lambda model, q: (case.friction(model, moment, q),), FOLD_STEP).last
    return float(last.mid_surface(last.model.s)[:, 1].max())


OF_MOTION = ("outcome", "lambda_end", "lambda_0", "sag_speed")
FINE = {"yield_curvature": 0.25, "step": 0.25}
"""Factors for the rise at the smallest M_0, which is compared with the law for small M_0 and kappa_y = 0."""
CHECKS: dict[str, dict[str, Any]] = {
    "as above": {},
    "half the step": {"step": 0.5},
    "half the elements": {"refinement": 0.5},
    "half kappa_y": {"yield_curvature": 0.5},
    "friction from lambda_0 on": {"history": "slack"},
    "lifted too high, lowered": {"history": "over"},
}
"""Ways to compute the rise at the first height: factors on the numbers of the case."""


def run(
    length: float = 24.0,
    thickness: float = 0.01,
    heights: Sequence[float] = (3.0, 5.0),
    moments: Sequence[float] = (0.005, 0.1, 0.3, 1.0),
    checked: float = 0.3,
    folded: Sequence[float] = (0.3,),
    yield_curvature: float = 0.05,
    step: float = 0.4,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The end of the motion over ``gripper_height`` and ``moment``, 0 among them.

    ``length``, ``thickness``: the strip.  ``heights``, ``moments``: of the gripper, the first also for the checks; M_0,
    without 0, the smallest first.  ``checked``: M_0 of the checks.  ``folded``: M_0 with which an R-path is followed to
    its end.  ``yield_curvature``, ``step``: kappa_y, 1/L*; largest step.
    """
    case = Case(length, thickness, yield_curvature, step)
    first, heights = heights[0], sorted(heights)
    m = [0.0, *moments]
    found = grid(partial(_motion, case), OF_MOTION, {"gripper_height": heights, "moment": m}, threads, progress)
    outcome = found["outcome"][1]
    brackets = [_bracket(case, z, m, row) for z, row in zip(heights, outcome, strict=True)]
    ends = found["lambda_end"][1]
    small = [
        _rise(_changed(case, FINE), z, moments[0]) if row[1] == SNAP else np.nan
        for z, row in zip(heights, outcome, strict=True)
    ]
    checks = grid(partial(_checked, case, first, checked), ("rise",), {"check": list(CHECKS)}, threads)
    folds = grid(partial(_folded, case), ("fold_height",), {"folded": folded}, threads)
    return dataset(
        {
            **found,
            "rise": (("gripper_height", "moment"), ends - ends[:, :1]),
            "coefficient": ("gripper_height", [elastica.friction_delay(z) for z in heights]),
            "small_rise": ("gripper_height", small),
            "vanishes_above": ("gripper_height", [b[0] for b in brackets]),
            "vanishes_below": ("gripper_height", [b[1] for b in brackets]),
            "check": checks["check"],
            "checked_rise": checks["rise"],
            "folded": folds["folded"],
            "fold_height": folds["fold_height"],
        },
        {
            "length": length,
            "thickness": thickness,
            "yield_curvature": yield_curvature,
            "step": step,
            "checked": checked,
            "checked_height": first,
        },
    )


def _motion(case: Case, height: float, moment: float) -> dict[str, float]:
    return dict(zip(OF_MOTION, limit(case, height, moment), strict=True))


def _bracket(case: Case, height: float, moments: Sequence[float], outcome: Array) -> tuple[float, float]:
    """Of the M_0 from which on there is no snap; nan where all moments snap, or none."""
    first = int(np.argmax(outcome != SNAP))
    if first < 2 or outcome[first] != TOUCH:
        return np.nan, np.nan
    return vanishing(case, height, moments[first - 1], moments[first])


def _changed(case: Case, factors: Mapping[str, Any]) -> Case:
    """A case with its numbers times factors, or with another history."""
    changed = {name: by if name == "history" else by * getattr(case, name) for name, by in factors.items()}
    if "yield_curvature" in factors:
        # Also where M_0 sets it.
        changed["stiffest"] = case.stiffest / factors["yield_curvature"]
    return replace(case, **changed)


@cache
def _without(case: Case, height: float) -> float:
    """lambda_c without friction."""
    return limit(case, height, 0.0)[1]


def _rise(case: Case, height: float, moment: float) -> float:
    # Without friction neither steps nor history have an influence.
    without = Case(case.length, case.thickness, case.yield_curvature, LARGEST, case.refinement)
    return limit(case, height, moment)[1] - _without(without, height)


def _checked(case: Case, height: float, moment: float, check: str) -> dict[str, float]:
    return {"rise": _rise(_changed(case, CHECKS[check]), height, moment)}


def _folded(case: Case, moment: float) -> dict[str, float]:
    return {"fold_height": fold_height(case, moment)}


def _interpolated(one: xr.Dataset, moment: float) -> float:
    """The rise at M_0, from rise over M_0 linearly in the logarithm of M_0."""
    m, rise = one.moment.values[1:], one.rise.values[1:]
    return float(np.interp(np.log(moment), np.log(m), rise / m)) * moment


def facts(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """At the height of the checks, with the fabrics' median M_0."""
    first, real = d.sel(gripper_height=d.attrs["checked_height"]), fabrics.friction
    median = float(real.median())
    rises = [_interpolated(first, float(m)) for m in (median, real.min(), real.max())]
    checks = d.checked_rise.values
    error = np.abs(checks / checks[0] - 1.0)
    law = d.small_rise / (d.coefficient * d.moment[1])
    unit = d.fold_height[-1] / elastica.folded_loop().height
    with_friction = d.sel(moment=d.moment >= float(real.min()))
    return {
        "height": d.attrs["checked_height"],
        "median": median,
        "rise": rises[0],
        "least": rises[1],
        "most": rises[2],
        "error": np.nanmax(error) * rises[0],
        "half_kappa_y": error[list(d.check.values).index("half kappa_y")],
        "law": np.nanmax(np.abs(law.values - 1.0)),
        "coefficients": ", ".join(
            f"{float(c):.2f} at {float(z):g}" for z, c in zip(d.gripper_height, d.coefficient, strict=True)
        ),
        "smallest": d.moment[1],
        "no_snap": d.vanishes_below.max(),
        "no_snap_each": ", ".join(
            f"{float(m):.2g} at {float(z):g}" for z, m in zip(d.gripper_height, d.vanishes_below, strict=True)
        ),
        "real_least": real.min(),
        "snapping": int((with_friction.outcome == SNAP).sum()),
        "speed": with_friction.sag_speed.max(),
        "speeds": ", ".join(
            f"{float(v):.1f} at M_0 = {float(m):g}"
            for m, v in zip(first.moment, first.sag_speed, strict=True)
            if np.isfinite(v)
        ),
        "fold": unit - 1.0,
        "folded": d.folded[-1],
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("delay_at_fabric_friction", "rise", "L*", "> 0",
            "rise of lambda with the fabrics' median M_0 of {median:.2f} rho_a g L*^2 at z = {height:g} L*, up to the "
            "touch of the sag where nothing snaps; +-{error:.2f} by halved step, elements and kappa_y and by the "
            "history of the lift; with the fabrics' least and most friction {least:.2f} and {most:.2f}; the paper's "
            "text gives no amount"),
        Number("delay_law", "law", "1", "< 0.05",
            "largest relative difference of the rise over M_0 = {smallest:g} from the perturbation of the elastica "
            "({coefficients} L*)"),
        Number("snap_vanishes", "no_snap", "1", "no criterion",
            "M_0 / rho_a g L*^2 from which on the sag is laid down without a snap, largest of all heights "
            "({no_snap_each} L*). No observer sees that boundary: the sag's largest speed over the gripper's, at z = "
            "{height:g} L*, has no jump there ({speeds}); from the fabrics' least of {real_least:.2f} on {snapping} "
            "snaps, and the sag falls at most {speed:.1f} times as fast as the gripper moves"),
        Number("fold_height_friction", "fold", "1", "< 0.1",
            "relative rise of the height of a fold with M_0 = {folded:g}: what friction changes of an L* measured by "
            "it"),
    ),
}
# fmt: on


LINES = ("-", "--", "-.", ":")


@styled
def draw(data: xr.Dataset, fabrics: xr.Dataset, friction: xr.Dataset) -> Figure:
    """Draw (a) the rise of lambda over M_0 at each height, (b) over the height the M_0 from which on nothing snaps.

    ``data`` is from :func:`verification.friction_delay.run`, ``fabrics`` from :func:`verification.fabrics.run`,
    ``friction`` from :func:`tasks.friction.table`.
    """
    fig = figure(5.4)
    top, bottom = fig.subplots(2, 1, height_ratios=(1.5, 1.0))
    needed = friction["suffices"].sel(law="hysteresis").values
    real = fabrics["friction"].values
    with_friction = data.isel(moment=slice(1, None)).sortby("gripper_height")
    moment = with_friction["moment"].values
    for i, height in enumerate(with_friction["gripper_height"].values):
        one, (color, _) = with_friction.sel(gripper_height=height), look(i)
        snaps, rise = one["outcome"].values == 1.0, one["rise"].values
        top.plot(moment, rise, ls=LINES[i % len(LINES)], color=color, label=f"$z = {height:g}\\,L^*$")
        top.plot(moment[snaps], rise[snaps], "o", color=color, ms=4, label="_snap")
        top.plot(moment[~snaps], rise[~snaps], "o", color=color, ms=4, mfc="white", label="_touch")
    law = float(with_friction["coefficient"].max())
    top.plot(moment, law * moment, color=GREY, lw=0.6, label="_law")
    top.set(xscale="log", yscale="log", ylabel=r"rise of $\lambda\,/\,L^*$", ylim=(0.01, 20.0))
    marks = [entry("snap", BLACK, "", marker="o", ms=4), entry("touch", BLACK, "", marker="o", ms=4, mfc="white")]
    handles, _ = top.get_legend_handles_labels()
    small = entry("small $M_0$, highest $z$", GREY, lw=0.6)
    fig.legend(handles=[*handles, *marks, small], fontsize=7, loc="outside upper center", ncols=3)
    order = data.sortby("gripper_height")
    limits = np.array([order["vanishes_above"].values, order["vanishes_below"].values])
    bottom.vlines(order["gripper_height"].values, *limits, color=BLACK, lw=2.0, label="_brackets")
    bottom.plot(order["gripper_height"].values, np.sqrt(limits.prod(axis=0)), color=BLACK, label="_vanishing")
    bottom.set(yscale="log", xlabel="$z\\,/\\,L^*$", ylabel=MOMENT.split(": ")[1], ylim=(0.003, 3.0))
    for ax, span in ((top, Axes.axvspan), (bottom, Axes.axhspan)):
        span(ax, real.min(), real.max(), color=SHADE, lw=0.0, zorder=0)
        span(ax, np.nanmin(needed), np.nanmax(needed), color=FRICTION, alpha=0.5, lw=0.0, zorder=0)
    top.set_xlabel(MOMENT.split(": ")[1])
    middle = float(order["gripper_height"].mean())
    bottom.text(middle, np.sqrt(real.min() * real.max()), "fabrics", ha="center", va="center")
    bottom.text(middle, 0.0045, "an R-path needs", ha="center", va="center", color=BLACK)
    bottom.text(float(order["gripper_height"].max()), 0.04, "snap", ha="right")
    bottom.text(float(order["gripper_height"].min()), 0.13, "touch without a snap", ha="left")
    note(top, "(a)")
    note(bottom, "(b)")
    return fig

"""How far bending friction carries the snap of a motion along x, and where it turns the snap into a gradual touch.

The strip is lifted with friction and without horizontal force, then its gripper moves along x in steps to the first of:
no equilibrium ahead (snap), touch of the sag, lift-off of the whole strip.  Lengths in L*, M_0 in rho_a g L*^2.
Source: docs/physics.md, section 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.all_materials import MOMENT
from plots.pieces import entry, look, note
from stripfold import elastica
from stripfold.ask.friction import LEAST_LYING
from stripfold.base.arrays import Array
from stripfold.base.errors import LostStabilityError
from stripfold.draw.colours import BLACK, FRICTION, GREY, SHADE
from stripfold.draw.style import figure, styled
from stripfold.follow.contact_branch import BranchPoint, clearance, from_flat, solved
from stripfold.follow.memory import load_incrementally_from, load_path
from stripfold.follow.statics import StripModel
from stripfold.paths.rpath import plan_r_path
from stripfold.strip.contact_mesh import LYING, ContactMesh, Sizes
from stripfold.strip.effects import Hysteresis
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX, Lift, Motion
from verification.common import Progress, blank, dataset, grid
from verification.numbers import Facts, Number

SIZES = Sizes(free=0.12, lying=0.15)
BEGIN = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1)
"""Heights at the first steps of the lift, L*."""
NEAR = 0.1
"""Smallest share of the step, taken where lambda hardly rises or the sag is that near the floor, L*."""
CLOSE, RISING = 0.05, 0.3
"""Height of the sag, L*, and lambda's component of the tangent, from which on the touch is extrapolated."""
SNAP, TOUCH, LIFTED = 1.0, 0.0, -1.0
"""Ends of the motion."""
NARROW = 1.3
"""Ratio of the bracket of the friction from which on the sag touches first."""
FOLDED_LENGTH, FOLD_STEP, FOLD_YIELD = 16.0, 0.2, 0.1
"""Length of the strip that follows the R-path and its steps, L*; kappa_y, with which it is followed to its end."""
CHECKS: dict[str, dict[str, Any]] = {
    "as above": {},
    "half the step": {"step": 0.5},
    "half the elements": {"refinement": 0.5},
    "half kappa_y": {"yield_curvature": 0.5},
    "friction from lambda_0 on": {"late": True},
}
"""Ways to compute the rise at the first height: factors on the numbers of the case."""


class Kept(ContactMesh):
    """Elements that are not planned anew.

    Between meshes a state is resampled, and the springs of friction, M_0 / kappa_y times stiffer than the strip, turn
    the differences into large forces.
    """

    def drifted(self, contact: Array) -> bool:
        return False


@dataclass(frozen=True)
class Case:
    """A strip with friction, and how it is computed.

    ``stiffest``: largest stiffness of the springs, M_0 / kappa_y.  ``late``: friction begins at lambda_0.
    """

    length: float
    thickness: float
    yield_curvature: float
    step: float
    refinement: float = 1.0
    stiffest: float = 10.0
    late: bool = False

    def friction(self, model: Model, moment: float, slack: Array | None) -> Hysteresis:
        """Friction that begins in the state ``slack``; kappa_y grows with M_0 so that Newton's method converges."""
        kappa_y = max(self.yield_curvature, moment / self.stiffest)
        return Hysteresis.of(model, moment, yield_curvature=kappa_y, slack=slack)

    def changed(self, factors: dict[str, Any]) -> Case:
        """With numbers times factors; half kappa_y also where M_0 sets it."""
        new = {name: by if name == "late" else by * getattr(self, name) for name, by in factors.items()}
        return replace(self, **new, stiffest=self.stiffest / factors.get("yield_curvature", 1.0))


def run(
    length: float = 24.0,
    thickness: float = 0.01,
    heights: Sequence[float] = (3.0, 5.0),
    moments: Sequence[float] = (0.005, 0.1, 0.3, 1.0),
    checked: float = 0.3,
    folded: Sequence[float] = (0.3,),
    checks: Sequence[str] = tuple(CHECKS),
    yield_curvature: float = 0.05,
    step: float = 0.4,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The end of the motion over ``gripper_height`` and ``moment``, 0 among them.

    ``heights``, ``moments``: of the gripper, the first also for the checks; M_0, without 0, the smallest first.
    ``checked``: M_0 of the ``checks``, keys of :data:`CHECKS`.  ``folded``: M_0 with which an R-path is followed to its
    end.  ``yield_curvature``, ``step``: kappa_y, 1/L*; largest step.
    """
    case = Case(length, thickness, yield_curvature, step)
    first, heights = heights[0], sorted(heights)
    axes: dict[str, Sequence[float]] = {"gripper_height": heights, "moment": [0.0, *moments]}
    found = grid(partial(limit, case), ("outcome", "lambda_end", "sag_speed"), axes, threads, progress)
    outcome, ends = found["outcome"][1], found["lambda_end"][1]
    vanishes, small = blank(2, len(heights)), blank(len(heights))
    # With a quarter of kappa_y, as the law is for small M_0 and kappa_y = 0.
    fine = case.changed({"yield_curvature": 0.25, "step": 0.25})
    for i, z in enumerate(heights):
        n = int(np.argmax(outcome[i] != SNAP))
        if n > 1 and outcome[i, n] == TOUCH:
            vanishes[:, i] = _vanishing(case, z, moments[n - 2], moments[n - 1])
        if outcome[i, 1] == SNAP:
            small[i] = limit(fine, z, moments[0])["lambda_end"] - ends[i, 0]
    rises = grid(partial(_checked, case, first, checked), ("rise",), {"check": checks}, threads)
    folds = grid(partial(_fold_height, case), ("fold_height",), {"folded": folded}, threads)
    return dataset(
        {
            **found,
            "rise": (("gripper_height", "moment"), ends - ends[:, :1]),
            "coefficient": ("gripper_height", [elastica.friction_delay(z) for z in heights]),
            "small_rise": ("gripper_height", small),
            "vanishes_above": ("gripper_height", vanishes[0]),
            "vanishes_below": ("gripper_height", vanishes[1]),
            "check": rises["check"],
            "checked_rise": ("check", rises["rise"][1] - ends[heights.index(first), 0]),
            "folded": folds["folded"],
            "fold_height": folds["fold_height"],
        },
        {"checked_height": first},
    )


def limit(case: Case, height: float, moment: float) -> dict[str, float]:
    """The end of the motion, lambda there, and the largest fall of the sag over the advance of the gripper in a step.

    Raises SolveError: a step could not be computed.
    """
    at = _at_start(case, height, moment)
    # lambda and the height of the sag, to extrapolate the touch.
    sags = [(at.point.lam, np.inf)]
    step: BranchPoint | None = None

    def places() -> Iterator[tuple[Motion, float]]:
        yield at.problem.motion, at.point.lam + NEAR * case.step
        while step is not None:
            share = min(1.0, step.point.tangent.lam, sags[-1][1])
            yield at.problem.motion, step.lam + max(share, NEAR) * case.step

    def end(outcome: float, lam: float) -> dict[str, float]:
        x, sag = np.array([at for at in sags if np.isfinite(at[1])]).T
        speed = np.inf if outcome == SNAP else (-np.diff(sag) / np.diff(x)).max()
        return {"outcome": outcome, "lambda_end": lam, "sag_speed": speed}

    try:
        for step in load_incrementally_from(at, places()):
            if step.touches:
                return end(TOUCH, _touch(sags, step.lam))
            if step.contact[-1] > case.length - LEAST_LYING:
                return end(LIFTED, step.lam)
            sags.append((step.lam, clearance(step.problem, step.point.q)[0]))
            if sags[-1][1] < CLOSE and step.point.tangent.lam > RISING:
                return end(TOUCH, _touch(sags, np.inf))
    except LostStabilityError as error:
        return end(SNAP, float(error.parameter or np.nan))
    raise AssertionError("the strip snaps, touches or is lifted")


def _touch(sags: list[tuple[float, float]], reached: float) -> float:
    """Where the height of the sag, extrapolated linearly, is zero; at most ``reached``."""
    (a, first), (b, second) = sags[-2:]
    return min(b + (b - a) * second / (first - second), reached) if first > second else reached


def _at_start(case: Case, height: float, moment: float) -> BranchPoint:
    """The state without horizontal force at this height, as one of a motion along x.

    The elements are planned for the critical state.
    """
    contact = np.array([elastica.critical(height).state.length])
    strip = StripModel(case.length, case.thickness, kind="rod")
    mesh = Kept.of(case.length, LYING, contact, SIZES.scaled(case.refinement), strip.model)
    at = from_flat(lambda _: mesh, Lift(), BEGIN[0])
    at = at if case.late else _with(case, at, moment, None)
    heights = [*BEGIN[1:], *np.linspace(BEGIN[-1], height, int(np.ceil(2.0 * height / case.step)) + 1)[1:]]
    for step in load_incrementally_from(at, ((Lift(), float(z)) for z in heights)):
        at = step
    at = _with(case, at, moment, at.u) if case.late else at
    motion = AlongX(height)
    return solved(at.problem.accepted(at.point.q, motion), at.point.q, float(at.point.q[at.model.middle[0, 0]]))


def _with(case: Case, at: BranchPoint, moment: float, slack: Array | None) -> BranchPoint:
    effects = (case.friction(at.model, moment, slack),) if moment else ()
    return solved(MovingContact(at.problem.mesh, at.problem.motion, effects, at.contact), at.point.q, at.point.lam)


def _vanishing(case: Case, height: float, snaps: float, touches: float) -> tuple[float, float]:
    """Bracket of the M_0 from which on the sag touches before lambda has a maximum, from a wider one."""
    while touches > NARROW * snaps:
        between = sqrt(snaps * touches)
        snaps, touches = (between, touches) if limit(case, height, between)["outcome"] == SNAP else (snaps, between)
    return snaps, touches


def _checked(case: Case, height: float, moment: float, check: str) -> dict[str, float]:
    changed, without = case.changed(CHECKS[check]), 0.0
    if changed.refinement != case.refinement:
        # Without friction neither steps nor history have an influence.
        without = limit(changed, height, 0.0)["lambda_end"] - limit(case, height, 0.0)["lambda_end"]
    return {"rise": limit(changed, height, moment)["lambda_end"] - without}


def _fold_height(case: Case, moment: float) -> dict[str, float]:
    """Height of the loop at the end of an R-path followed with friction."""
    strip = StripModel(FOLDED_LENGTH, case.thickness, kind="rod")
    mesh, path = strip.contact_mesh(memory=True), plan_r_path(strip.length).path
    case = replace(case, yield_curvature=FOLD_YIELD)
    last = load_path(mesh, path, lambda model, q: (case.friction(model, moment, q),), FOLD_STEP).last
    return {"fold_height": float(last.mid_surface(last.model.s)[:, 1].max())}


def facts(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """At the height of the checks, with the fabrics' median M_0."""
    first, real = d.sel(gripper_height=d.attrs["checked_height"]), fabrics.friction
    m, rise = first.moment.values[1:], first.rise.values[1:]
    wanted = np.array([real.median(), real.min(), real.max()])
    # Rise over M_0, linearly in the logarithm of M_0.
    rises = np.interp(np.log(wanted), np.log(m), rise / m) * wanted
    error = np.abs(d.checked_rise.values / d.checked_rise.values[0] - 1.0)
    law = d.small_rise / (d.coefficient * d.moment[1])
    with_friction = d.sel(moment=d.moment >= float(real.min()))

    def each(of: xr.DataArray, text: Callable[[float], str]) -> str:
        return ", ".join(f"{text(float(x))} at {float(z):g}" for z, x in zip(d.gripper_height, of, strict=True))

    speeds = zip(first.moment.values, first.sag_speed.values, strict=True)
    return {
        "height": d.attrs["checked_height"],
        "median": wanted[0],
        "rise": rises[0],
        "least": rises[1],
        "most": rises[2],
        "error": np.nanmax(error) * rises[0],
        "law": np.nanmax(np.abs(law.values - 1.0)),
        "coefficients": each(d.coefficient, "{:.2f}".format),
        "smallest": d.moment[1],
        "no_snap": d.vanishes_below.max(),
        "no_snap_each": each(d.vanishes_below, "{:.2g}".format),
        "real_least": wanted[1],
        "snapping": int((with_friction.outcome == SNAP).sum()),
        "speed": with_friction.sag_speed.max(),
        "speeds": ", ".join(f"{v:.1f} at M_0 = {moment:g}" for moment, v in speeds if np.isfinite(v)),
        "fold": d.fold_height[-1] / elastica.folded_loop().height - 1.0,
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
    """Draw (a) the rise of lambda over M_0 at each height, (b) over the height the M_0 from which on nothing snaps."""
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

"""When a push makes the wrinkles of a flat strip grow to rucks: the bump in unstable equilibrium, and ridges.

A bump with a push is computed by shooting on the heavy elastica; the displacement of a strip's end below which there is
none, the fold of the bump's branch, by the rod and the solid, too.  Then a straight path pushes strips that lie on a
random ridge of the table, in time by the rod and by a chain of point masses that shares no code with it; and planned
paths are followed in time with a ridge as high as they allow for.
Lengths in L*, forces in rho_a g L*.  Source: docs/low-path.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

from stripfold.ask.plan import choose
from stripfold.ask.planned_motion import InTime, in_time
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import NoPathError
from stripfold.draw.colours import BLUE, GREY, VERMILLION
from stripfold.draw.style import figure, styled
from stripfold.follow.contact import RUCK
from stripfold.follow.contact_branch import BranchPoint, transferred
from stripfold.follow.statics import StripModel, follow
from stripfold.follow.time import BUMP_WIDTH, Ridge, follow_in_time
from stripfold.follow.track import BUMP, StripState, forces_of, grip_and_hold, peak_push
from stripfold.paths.curve import GripperPath, pieces_through
from stripfold.paths.motion import TimedPath
from stripfold.solve import continuation, newton
from stripfold.solve.newton import Constraint, NewtonOptions
from stripfold.solve.problem import Tangent
from stripfold.solve.schemes import Damping
from stripfold.strip.model import Model
from stripfold.strip.moving_contact import MovingContact
from stripfold.strip.problem import AlongX
from verification import folding_plans
from verification.chain import Chain
from verification.common import Progress, attempted, dataset, pooled
from verification.numbers import Facts, Number

PUSHES = (2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
HALF = 6.0
"""Half the length of the strip whose bump is in its middle."""
NARROW = 4.493409
"""Half length of a bump of small slopes times the root of the push: the least root of tan(a) = a."""
LENGTH, THICKNESS, SLOPE, PLACE = (9.0, 14.0), (0.035, 0.1), (0.7, 1.3), (3.5, 7.0)
"""Drawn evenly, the thickness by its logarithm: of the strip, slope of the path, distance of the ridge's crest from the
grasped end."""
WIDTH, HEIGHT = (0.5, 1.5), (0.3, 4.0)
"""Width of the ridge over that of the bump at the largest push, evenly; height over the bump's, by its logarithm."""
UP = 1.0
"""Length of the straight path."""
MOTION = TimedPath(np.array([0.0, 20.0, 40.0]), np.array([0.0, 0.5 * UP, UP]), np.array([0.0, 0.05, 0.0]))
"""Of the gripper, from rest to rest, so that no wave runs along the strip, and so slow that the push counts."""
DAMPING, REFINEMENT = Damping(air=0.1, stiffness=0.06), 0.25
"""Elements are a quarter as long as usual: on those
of 0.1 L* what is free at a push of 54 may jump by one of them, and on those of 0.05 two of 40 strips did otherwise."""
TICKS = (0.3, 0.5, 1.0, 2.0, 4.0)


class Bump(NamedTuple):
    """Half of a bump with a push; ``shorter``: by how much its ends are nearer; ``barrier``: energy of all of it."""

    push: float
    length: float
    height: float
    shorter: float
    barrier: float
    at: Callable[[Array], Array]


def bump(push: float) -> Bump:
    """The elastica's bump, which lifts off without a moment and has neither slope nor shear in its middle."""

    def rates(s: float, y: Array, length: float) -> Array:
        angle, curvature, _, z, _ = y
        bending = (length - s) * np.cos(angle) - push * np.sin(angle)
        return np.array([curvature, bending, np.cos(angle), np.sin(angle), 0.5 * curvature**2 + z])

    def shot(length: float) -> Any:
        how: dict[str, Any] = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-13, "dense_output": True}
        return solve_ivp(rates, (0.0, length), np.zeros(5), args=(length,), **how)

    guess = NARROW / sqrt(push)
    length = brentq(lambda length: shot(length).y[0, -1], 0.8 * guess, 1.3 * guess, xtol=1e-12)
    found = shot(length)
    _, _, x, z, energy = found.y[:, -1]
    return Bump(push, length, z, length - x, 2.0 * (energy - push * (length - x)), found.sol)


@cache
def shortest(thickness: float) -> tuple[float, float]:
    """The least displacement of the end of half a strip with a bump, and its push there: the fold of its branch."""

    def displacement(push: float) -> float:
        return bump(push).shorter + push * HALF * thickness**2 / 12.0

    found = minimize_scalar(displacement, bounds=(3.0, 60.0), method="bounded", options={"xatol": 1e-7})
    return float(found.fun), float(found.x)


@dataclass(frozen=True)
class Middle(AlongX):
    """The middle of a bump moves along x: it is upright, and free to rise."""

    height: float = 0.0
    angle: float = 0.0

    def grasped(self, model: Model) -> Index:
        return np.asarray(model.middle[0, :1])

    def values(self, lam: float) -> Array:
        return np.array([lam])

    def rates(self, lam: float) -> Array:
        return np.array([1.0])


def shortest_of_model(kind: str, thickness: float) -> tuple[float, float]:
    """The same of half a rod or a solid, from the elastica's bump on."""
    at = _bump_of_model(StripModel(HALF, thickness, kind=kind), bump(shortest(thickness)[1]))

    def found(length: float) -> BranchPoint:
        return transferred(at, np.array([length]), constraint=(np.array([1.0]), 0.0))

    length = float(at.contact[0])
    best = minimize_scalar(
        lambda length: found(length).lam,
        bounds=(0.93 * length, 1.07 * length),
        method="bounded",
        options={"xatol": 1e-6},
    )
    problem, point = found(best.x).problem.on_mesh(found(best.x).point)
    return float(best.fun), float(grip_and_hold(*StripState(problem, point))[0][0])


def _bump_of_model(strip: StripModel, of: Bump) -> BranchPoint:
    """Half a bump as long as the elastica's."""
    mesh = strip.contact_mesh()(np.array([of.length]))
    model, problem = mesh.model, MovingContact(mesh, Middle())
    lies = model.s >= of.length
    angle, _, x, z, _ = of.at(np.clip(of.length - model.s, 0.0, None))
    x = np.where(lies, model.s, of.length - x) - model.length / 2.0
    x += of.push * strip.thickness**2 / 12.0 * (model.length - np.maximum(model.s, of.length))
    flat = np.where(lies, 0.0, 1.0)
    q = np.append(model.unknowns_of(np.stack([x, flat * z], axis=1), -flat * angle), of.length)
    row = np.zeros(len(q))
    row[-1] = 1.0
    here = Constraint(row, 0.0, q, of.shorter)
    state = newton.solve(problem, q, of.shorter, problem.bounded, here, NewtonOptions(max_iterations=60))
    return BranchPoint(problem, continuation.evaluate(problem, state, Tangent(row, 0.0)))


class Case(NamedTuple):
    """A strip, its straight path and a ridge, as high as ``ratio`` times the bump at the largest push; its ``width``
    over the bump's."""

    length: float
    thickness: float
    slope: float
    ridge: Ridge
    ratio: float
    width: float = 1.0

    @property
    def path(self) -> GripperPath:
        start = np.array([-0.5 * self.length, 0.0])
        end = start + UP * np.array([1.0, self.slope]) / sqrt(1.0 + self.slope**2)
        return GripperPath("straight", pieces_through([("up", np.array([start, end]))]))


def case(number: int, seed: int) -> Case:
    """A random case, the same for the same numbers."""
    random = np.random.default_rng([seed, number])
    length, slope, place, width = (random.uniform(*of) for of in (LENGTH, SLOPE, PLACE, WIDTH))
    thickness, ratio = (float(np.exp(random.uniform(*np.log(of)))) for of in (THICKNESS, HEIGHT))
    flat = Case(length, thickness, slope, Ridge(0.0, 1.0, place), ratio)
    found = follow(StripModel(length, thickness, kind="rod").contact_mesh(), flat.path, length, until="touch")
    push, _ = peak_push(found.states, forces_of(found.states))
    return flat._replace(ridge=Ridge(ratio * BUMP / push**2, width * BUMP_WIDTH / sqrt(push), place), width=width)


def by_rod(of: Case) -> float:
    """Largest height of what lies over the ridge, by the rod in time."""
    strip = StripModel(of.length, of.thickness, kind="rod")
    moved = follow_in_time(strip, of.path, 0.0, damping=DAMPING, speed=MOTION, refinement=REFINEMENT, ridge=of.ridge)
    model = moved.states[0].problem.model
    lies = model.s >= PLACE[0] - 0.5
    z = np.array([state.q[model.middle[lies, 1]] for _, state in moved.states])
    return float((z - of.ridge.at(model.s[lies])).max())


def by_chain(of: Case, spacing: float = 0.05) -> float:
    """The same by a chain of point masses in steps of its own."""
    chain = Chain.of(of.length, of.thickness, spacing)
    table = of.ridge.at(chain.arc)
    state = chain.flat(table)
    still = np.tile([state[0, 0], 0.0], (ceil(5.0 / chain.step), 1))
    slope = of.path.rate(0.0)
    travelled = [MOTION.lam(t) for t in np.arange(0.0, MOTION.t[-1], chain.step)]
    way = still[0] + np.outer(travelled, slope)
    chain.follow(state, still, 2.0, table)
    top = chain.follow(state, way, DAMPING.air, table)
    return float(top[chain.arc >= PLACE[0] - 0.5].max())


def run(
    cases: int = 2,
    plans: int = 1,
    seed: int = 1,
    thickness: float = 0.01,
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Bumps over ``push``; their folds over ``kind``; random ridges over ``case``, and plans with one over ``plan``.

    ``thickness``: of the strip whose fold is found.
    """
    bumps = [bump(push) for push in PUSHES]
    folds = {"elastica": shortest(thickness)}
    folds |= {kind: shortest_of_model(kind, thickness) for kind in ("rod", "solid")}
    ridges = pooled(partial(_compared, seed), range(cases), threads, progress)
    planned = pooled(partial(_planned, seed), range(plans), threads, progress)
    values: dict[str, Any] = {name: ("case", [row[name] for row in ridges]) for name in ridges[0]}
    return dataset(
        values
        | {
            "push": ("push", PUSHES),
            "height": ("push", [one.height for one in bumps]),
            "barrier": ("push", [one.barrier for one in bumps]),
            "kind": ("kind", list(folds)),
            "fold_displacement": ("kind", [displacement for displacement, _ in folds.values()]),
            "fold_push": ("kind", [push for _, push in folds.values()]),
            "plan": ("plan", [path for path, _ in planned]),
            "moved": ("plan", [what for _, what in planned]),
        },
        {"seed": seed, "thickness": thickness},
    )


def _compared(seed: int, number: int) -> dict[str, float]:
    of = case(number, seed)
    ours, theirs = by_rod(of), by_chain(of)
    return {"ratio": of.ratio, "width": of.width, "rod_top": ours, "chain_top": theirs}


def _planned(seed: int, number: int) -> tuple[str, str]:
    """The path planned for a random strip, and what its motion in time over a ridge does that it should not."""
    asked = folding_plans.case(number, seed).model_copy(update={"max_snap": 0.0})
    try:
        best = choose(asked.model_copy(update={"speed": None}))[0][0]
    except NoPathError:
        return "none", ""
    if best.candidate.gripper != "hinge":
        return "none", ""
    random = np.random.default_rng([seed, number, 1])
    static, moment = [verdict.states for verdict in best.verdicts], best.sufficient_moment or 0.0
    width, place = random.uniform(0.02, 0.1), random.uniform(0.2, 0.8) * asked.length
    found, message = attempted(
        lambda: in_time(asked, best.path, static, moment, lambda line: None, Ridge(asked.flatness, width, place))
    )
    return best.name, "" if isinstance(found, InTime) else str(found or message)


def facts(d: xr.Dataset) -> Facts:
    """Where the two codes agree, and how high ridges are that do not grow."""
    rucks, chain = d.rod_top.values > RUCK, d.chain_top.values > RUCK
    error = {
        name: abs(d.fold_push.sel(kind=name) / d.fold_push.sel(kind="elastica") - 1.0) for name in ("rod", "solid")
    }
    followed = d.plan.values != "none"
    return {
        "cases": len(rucks),
        "agree": (rucks == chain).sum(),
        "rucks": rucks.sum(),
        "lowest": d.ratio.values[rucks].min(initial=np.inf),
        "highest": d.ratio.values[~rucks].max(initial=0.0),
        "rod_error": error["rod"],
        "solid_error": error["solid"],
        "push": d.fold_push.sel(kind="elastica"),
        "thickness": d.attrs["thickness"],
        "seed": d.attrs["seed"],
        "plans": followed.sum(),
        "drawn": len(followed),
        "wrong": (followed & (d.moved.values != "")).sum(),
    }


# fmt: off
NUMBERS = {
    facts: (
        Number("bump_error", "solid_error", "1", "<= 1e-3",
            "relative error of the push at the fold of the bump's branch, {push:.1f} rho_a g L\\*, of the solid "
            "against the elastica's, h = {thickness:g} L\\*; of the rod {rod_error:.1g}", lambda f: f.rod_error <= 1e-3,
            spread=0.5),
        Number("ruck_verdicts", "agree", "count", "all",
            "of {cases} strips pushed on a random ridge (seed {seed}), those for which the rod in time and an explicit "
            "chain of masses say the same; {rucks} form a ruck, the lowest of their ridges {lowest:.2g} times as high "
            "as the bump; of the others the highest {highest:.2g} times", lambda f: f.agree == f.cases, spread=10.0),
        Number("ruck_plans", "wrong", "count", "= 0",
            "of {plans} planned paths for {drawn} random strips (seed {seed}), those that in time, at the speed drawn, "
            "with the least, the given or the largest eta_b, do not stay with their static states or not end folded "
            "when the strip lies on a random ridge as high as its flatness, 0.5 mm"),
    ),
}
# fmt: on


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the height of the bump over the push, and (b) which ridges grow to rucks."""
    fig = figure(2.6)
    left, right = fig.subplots(1, 2)
    left.loglog(data.push, data.height, color=BLUE, label="elastica")
    left.loglog(data.push, BUMP / data.push**2, color=GREY, ls="--", label="small slopes")
    left.set(xlabel="push$\\,/\\,\\rho_a gL^*$", ylabel="height of the bump$\\,/\\,L^*$", title="(a)")
    left.legend()
    ruck = data.rod_top.values > RUCK
    for has, label in ((True, "ruck"), (False, "none")):
        of = data.isel(case=np.flatnonzero(ruck == has))
        right.plot(of.width, of.ratio, "o" if has else "x", ms=4, color=VERMILLION if has else BLUE, label=label)
    # Of waves as wide, the least is WAVE over BUMP; narrower ones are bridged, and hold up to the bump's height.
    width = np.linspace(0.765, WIDTH[1], 100)
    share = (pi / NARROW / width) ** 2
    right.plot(width, 2.0 / (share * (1.0 - share)) / BUMP, color=GREY, ls="--", label="waves that hold")
    right.set(yscale="log", ylim=(0.25, 16.0), xlabel="width / bump's", ylabel="height / bump's", title="(b)")
    right.set_yticks(TICKS, map(str, TICKS))
    right.minorticks_off()
    right.legend()
    return fig

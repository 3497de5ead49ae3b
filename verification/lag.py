"""Delayed bifurcation: how far past lambda_c the gripper is when the strip snaps, against its speed.

Near the saddle-node the deflection x along the critical mode obeys ``x'' + a x' = c x^2 + b (lambda - lambda_c)`` (unit
modal mass).  With the gripper at speed v the strip lags behind by ``C v^(4/5) / (b c)^(1/5)`` where inertia decides and
by ``C (a^2 / (b c))^(1/3) v^(2/3)`` where air drag does.

The snap event is the state when the deflection along the critical mode passes that of the static critical state,
x = 0.  At vanishing speed that happens at lambda_c exactly, and the normal form has no other length to compare with:
any threshold beyond adds the time of the fall, which is a lag of order v and spoils the exponent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile

import numpy as np
import xarray as xr
from scipy.interpolate import CubicHermiteSpline
from scipy.stats import linregress, t

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import ROBUST_NEWTON, on_nodes
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, solve_height
from stripfold.solve import continuation, critical, dynamics
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.dynamics import Moving, TimeEvent, TimeOptions
from stripfold.solve.problem import Point, Tangent
from stripfold.solve.schemes import Damping
from stripfold.strip.problem import StripProblem
from verification.common import Progress, dataset, pooled
from verification.numbers import Facts, Number

INERTIAL, OVERDAMPED = 4.0 / 5.0, 2.0 / 3.0
"""Exponents of the theory."""
INERTIAL_PASSAGE, OVERDAMPED_PASSAGE = 0.715391, 1.018793
"""C of the theory: when ``X'' = X^2 + T`` and ``X' = X^2 + T``, coming along their branch, pass zero.

The second is the first zero of Ai'(-T); the first is from an integration begun at T = -80.
"""
AHEAD = 10.0
"""The motion starts this many expected lags before lambda_c, on the branch."""
NEAR_FOLD = 0.1
"""Distance from lambda_c, L*, within which the branch is taken for a parabola."""
BRANCH = 1.0
"""Length of the branch before lambda_c from which a motion can start, L*."""
STATIC_STEPS = StepOptions(first=0.02, largest=0.05, target_iterations=10, max_attempts=1000, newton=ROBUST_NEWTON)


@dataclass(frozen=True)
class Fold:
    """The saddle-node in its normal form, of the strip on the fixed mesh of the motion.

    ``branch``: stable points before it, backwards.  ``row``: x is ``row . (q - q_c)``, shape (n,), the critical mode's,
    growing along the branch.  ``push``, ``curvature``: b and c.
    """

    problem: StripProblem
    branch: tuple[Point, ...]
    critical: CriticalPoint
    row: Array
    push: float
    curvature: float

    def lag(self, speed: float, air: float) -> float:
        """The theory's lag, L*."""
        product = self.push * self.curvature
        if air:
            return OVERDAMPED_PASSAGE * (air**2 / product) ** (1.0 / 3.0) * speed**OVERDAMPED
        return INERTIAL_PASSAGE * product ** (-1.0 / 5.0) * speed**INERTIAL


def fold_of(strip: StripModel, height: float, refinement: float) -> Fold:
    """Find b from the gripper's force on the mode, and b / c from the branch's parabola."""
    problem, first = on_nodes(solve_height(strip, height, refinement).last, refinement, stable=True)
    before, beyond = first, list[Point]()
    for point in continuation.follow(problem, first, STATIC_STEPS):
        if not critical.is_past(point) and point.lam >= before.lam:
            # A maximum before it was due to a change of the contact.
            before, beyond = point, []
            continue
        beyond.append(point)
        if touches(problem.model, point) or point.lam < before.lam - NEAR_FOLD:
            break
    found = critical.locate(problem, before, beyond[0], LAMBDA_TOLERANCE, STATIC_STEPS)
    backwards = replace(first, tangent=Tangent(-first.tangent.q, -first.tangent.lam))
    points = continuation.follow(problem, backwards, STATIC_STEPS)
    branch = tuple(takewhile(lambda p: p.lam > found.lam - BRANCH, points))
    at = found.before
    mode = found.mode * np.sign(found.mode @ (problem.mass @ at.tangent.q))
    row = problem.mass @ mode
    rate = np.zeros(problem.size)
    rate[problem.prescribed] = problem.prescribed_rates(at.lam)
    push = -float(mode @ (problem.linearise(at.q, at.lam)[1] @ rate))
    near = [p for p in (*branch, *beyond[:-1]) if found.lam - p.lam < NEAR_FOLD]
    # A parabola whose summit is fitted too: contact switching displaces the located one a little.
    parabola = np.polyfit([row @ (p.q - at.q) for p in near], [p.lam for p in near], 2)
    return Fold(problem, branch, found, row, push, -push * float(parabola[0]))


def passage(case: tuple[float, float], fold: Fold) -> float:
    """lambda when the strip snaps, L*, with the gripper at a speed, in air of a drag."""
    speed, air = case
    problem, at = fold.problem, fold.critical.before
    before = [p for p in fold.branch if p.lam < fold.critical.lam - AHEAD * fold.lag(speed, air)]
    if not before:
        raise SolveError(f"the branch is too short for the speed {speed:g}", parameter=fold.critical.lam)
    point = before[0]
    first = dynamics.start(problem, point.q, speed * point.tangent.q / point.tangent.lam, point.lam, point.active)
    touch = TimeEvent(lambda state: touches(problem.model, state))
    drive = Moving(point.lam, speed)
    last, x_last = first, -np.inf
    options = TimeOptions(largest=200.0)
    for state in dynamics.march(problem, first, drive, Damping(air=air), options=options, until=[touch]):
        x = float(fold.row @ (state.q - at.q))
        if x > 0.0:
            rates = [fold.row @ m.v / speed for m in (last, state)]
            passed = CubicHermiteSpline([last.lam, state.lam], [x_last, x], rates)
            return float(passed.roots(extrapolate=False)[0])
        last, x_last = state, x
    raise SolveError("the strip touches before it snaps", parameter=last.lam)


def run(
    length_star: float = 12.0,
    thickness: float = 0.0594,
    height: float = 5.0,
    refinement: float = 0.25,
    speeds: Sequence[float] = (4e-4, 1e-3, 2e-3, 4e-3, 1e-2),
    air: float = 1.0,
    damped_speeds: Sequence[float] = (5e-5, 1e-4, 2e-4, 5e-4, 1e-3),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Measure lags without damping, and in air.

    ``speeds``, ``damped_speeds``: of the gripper, sqrt(g L*).  ``air``: air drag per mass and velocity, sqrt(g/L*);
    much more than the rate of the passage, so that it decides.
    """
    fold = fold_of(StripModel(length_star, thickness), height, refinement)
    cases = [(v, 0.0) for v in speeds] + [(v, air) for v in damped_speeds]
    snaps = pooled(partial(passage, fold=fold), cases, threads, progress)
    values = {
        "speed": ("case", [v for v, _ in cases]),
        "air": ("case", [a for _, a in cases]),
        "snap": ("case", snaps),
        "expected": ("case", [fold.lag(v, a) for v, a in cases]),
        "lambda_c": ((), fold.critical.lam),
    }
    scene = {"length_star": length_star, "thickness": thickness, "height_star": height, "refinement": refinement}
    return dataset(values, scene)


def facts(d: xr.Dataset) -> list[Facts]:
    """Exponents and limits at zero speed, without damping and in air."""
    out: list[Facts] = []
    for suffix, theory, power in (("", "4/5", INERTIAL), ("_damped", "2/3", OVERDAMPED)):
        one = d.isel(case=np.flatnonzero((d.air.values > 0.0) == bool(suffix)))
        speed, snap, lag = one.speed.values, one.snap.values, (one.snap - d.lambda_c).values
        fit = linregress(np.log(speed), np.log(lag))
        half_width = t.ppf(0.975, speed.size - 2) * fit.stderr
        ratio, air = lag / one.expected.values, one.air.values[0]
        out.append(
            {
                "suffix": suffix,
                "theory": theory,
                "damping": f"air drag {air:g}" if suffix else "no damping",
                "count": speed.size,
                "speeds": f"{speed.min():g} to {speed.max():g}",
                "ratios": f"{ratio.min():.2f} to {ratio.max():.2f}",
                "slope": fit.slope,
                "half_width": half_width,
                "apart": abs(fit.slope - power),
                "limit": np.abs(np.polyfit(speed**power, snap, 1)[1] - d.lambda_c),
            }
        )
    return out


def limits(d: xr.Dataset) -> Facts:
    inertial, damped = (one["limit"] for one in facts(d))
    return {"error": inertial, "damped": damped}


# fmt: off
NUMBERS = {
    facts: (
        Number("lag_exponent{suffix}", "slope", "1", "{theory} within 0.05 or within the interval",
            "exponent of the snap's lag in the gripper's speed, {damping}, {count} speeds from {speeds} sqrt(g L*), 95 "
            "% interval +- {half_width:.3f}; the lags are {ratios} times those of the normal form",
            lambda f: f.apart < max(0.05, f.half_width), digits=4),
    ),
    limits: (
        Number("lag_limit_error", "error", "L*", "< 0.001 L*",
            "lambda at the snap, extrapolated to zero speed, less the static lambda_c (in air: {damped:.1e} L*)",
            spread=1.0),
    ),
}
# fmt: on

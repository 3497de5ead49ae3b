"""Delayed bifurcation: how far past lambda_c the gripper is when the strip snaps, against its speed.

Near the saddle-node the deflection x along the critical mode obeys ``x'' + a x' = c x^2 + b (lambda - lambda_c)`` (unit
modal mass).  With the gripper at speed v the strip lags behind by ``C v^(4/5) / (b c)^(1/5)`` where inertia decides and
by ``C (a^2 / (b c))^(1/3) v^(2/3)`` where air drag does.

The snap event is the state when the deflection along the critical mode passes that of the static critical state,
x = 0.  At vanishing speed that happens at lambda_c exactly, and the normal form has no other length to compare with:
any threshold beyond adds the time of the fall, which is a lag of order v and spoils the exponent (``touch`` shows it).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import takewhile
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicHermiteSpline
from scipy.stats import linregress, t

from stripfold.base.arrays import Array
from stripfold.base.errors import SolveError
from stripfold.follow.contact import touches
from stripfold.follow.contact_set import ROBUST_NEWTON, on_nodes
from stripfold.follow.statics import LAMBDA_TOLERANCE, StripModel, solve_height
from stripfold.follow.track import Track
from stripfold.solve import continuation, critical, dynamics
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.drive import Moving
from stripfold.solve.dynamics import TimeEvent, TimeOptions
from stripfold.solve.problem import Point, Tangent
from stripfold.solve.schemes import Damping
from stripfold.strip.problem import StripProblem
from verification.common import Progress, dataset, grid
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
STEPS = TimeOptions(largest=200.0)
MOST_STEPS = 20000


@dataclass(frozen=True)
class Fold:
    """The saddle-node in its normal form, of the strip on the fixed mesh of the motion.

    Attributes
    ----------
    branch
        Stable points before it, backwards.
    critical
        It.
    row
        x is ``row . (q - q_c)``, shape (n,): the critical mode's, growing along the branch.
    push, curvature
        b and c.
    """

    problem: StripProblem
    branch: tuple[Point, ...]
    critical: CriticalPoint
    row: Array
    push: float
    curvature: float

    @classmethod
    def of(cls, run: Track, refinement: float) -> Fold:
        """Both coefficients from statics: b from the gripper's force on the mode, b / c from the branch's parabola."""
        if run.critical is None:
            raise SolveError(f"no critical point to pass: {run.end.reason}")
        problem, first = on_nodes(run.last, refinement, stable=True)
        found, beyond = _limit_point(problem, first)
        backwards = replace(first, tangent=Tangent(-first.tangent.q, -first.tangent.lam))
        points = continuation.follow(problem, backwards, STATIC_STEPS)
        branch = tuple(takewhile(lambda p: p.lam > found.lam - BRANCH, points))
        at = found.before
        mode = found.mode * np.sign(found.mode @ (problem.mass @ at.tangent.q))
        row = problem.mass @ mode
        tangent = problem.linearise(at.q, at.lam)[1]
        rate = np.zeros(problem.size)
        rate[problem.prescribed] = problem.prescribed_rates(at.lam)
        push = -float(mode @ (tangent @ rate))
        near = [p for p in (*branch, *beyond) if found.lam - p.lam < NEAR_FOLD]
        x = np.array([row @ (p.q - at.q) for p in near])
        # A parabola whose summit is fitted too: contact switching displaces the located one a little.
        fall = -float(np.polyfit(x, [p.lam for p in near], 2)[0])
        return cls(problem, branch, found, row, push, push * fall)

    @property
    def lam(self) -> float:
        """lambda_c on this mesh, L*."""
        return self.critical.lam

    def expected(self, speed: float, air: float) -> float:
        """The theory's lag, L*."""
        product = self.push * self.curvature
        if air:
            return OVERDAMPED_PASSAGE * (air**2 / product) ** (1.0 / 3.0) * speed**OVERDAMPED
        return INERTIAL_PASSAGE * product ** (-1.0 / 5.0) * speed**INERTIAL


def _limit_point(problem: StripProblem, first: Point) -> tuple[CriticalPoint, list[Point]]:
    """The limit point behind a stable point, and the points past it up to the touch of the sag."""
    before, beyond = first, list[Point]()
    for point in continuation.follow(problem, first, STATIC_STEPS):
        if not critical.is_past(point) and point.lam >= before.lam:
            # A maximum before it was due to a change of the contact.
            before, beyond = point, []
            continue
        beyond.append(point)
        if touches(problem.model, point) or point.lam < before.lam - NEAR_FOLD:
            break
    return critical.locate(problem, before, beyond[0], LAMBDA_TOLERANCE, STATIC_STEPS), beyond[:-1]


def passage(fold: Fold, speed: float, air: float) -> tuple[float, float, int]:
    """lambda when the strip snaps and when its sag touches, L*, and the time steps taken; the gripper never stops."""
    problem, at = fold.problem, fold.critical.before
    before = [p for p in fold.branch if p.lam < fold.lam - AHEAD * fold.expected(speed, air)]
    if not before:
        raise SolveError(f"the branch is too short for the speed {speed:g}", parameter=fold.lam)
    point = before[0]
    first = dynamics.start(problem, point.q, speed * point.tangent.q / point.tangent.lam, point.lam, point.active)
    touch = TimeEvent(lambda state: touches(problem.model, state))
    drive = Moving(point.lam, speed)
    states = dynamics.march(problem, first, drive, Damping(air=air), options=STEPS, until=[touch])
    snap, last, x_last, steps = np.nan, first, -np.inf, -1
    for state in states:
        x = float(fold.row @ (state.q - at.q))
        if np.isnan(snap) and x > 0.0:
            rates = [fold.row @ m.v / speed for m in (last, state)]
            snap = float(CubicHermiteSpline([last.lam, state.lam], [x_last, x], rates).roots(extrapolate=False)[0])
        last, x_last, steps = state, x, steps + 1
        if steps > MOST_STEPS:
            raise SolveError("the strip does not come down", parameter=state.lam)
    return snap, last.lam, steps


def exponent(speed: Array, lag: Array) -> tuple[float, float]:
    """Slope of log(lag) over log(speed), and the half width of its 95 % interval (t distribution)."""
    fit = linregress(np.log(speed), np.log(lag))
    return float(fit.slope), float(t.ppf(0.975, len(speed) - 2) * fit.stderr)


def limit(speed: Array, lam: Array, power: float) -> float:
    """``lambda_0`` of ``lam = lambda_0 + A speed^power``, least squares; nan where a passage failed."""
    if not np.isfinite(lam).all():
        return float("nan")
    return float(np.polyfit(speed**power, lam, 1)[1])


_fold = cache(
    lambda length, thickness, height, refinement: Fold.of(
        solve_height(StripModel(length, thickness), height, refinement), refinement
    )
)


def _passage(asked: tuple[float, ...], air: float, speed: float) -> dict[str, float]:
    fold = _fold(*asked)
    snap, touch, steps = passage(fold, speed, air)
    found = snap, touch, snap - fold.lam, fold.expected(speed, air), steps
    return dict(zip(OF_PASSAGE, found, strict=True))


OF_PASSAGE = ("snap", "touch", "lag", "expected", "time_steps")


def run(
    length_star: float = 12.0,
    thickness: float = 0.0594,
    height: float = 5.0,
    refinement: float = 0.25,
    speeds: Sequence[float] = (0.0004, 0.001, 0.002, 0.004, 0.01),
    air: float = 1.0,
    damped_speeds: Sequence[float] = (5e-05, 0.0001, 0.0002, 0.0005, 0.001),
    threads: int = 1,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Lags without damping and in air.

    ``length_star``, ``thickness``, ``height``: L*.  ``refinement``: factor on the element lengths.  ``speeds``,
    ``damped_speeds``: of the gripper, sqrt(g L*): without damping and with it.  ``air``: air drag per mass and
    velocity, sqrt(g/L*); much more than the rate of the passage, so that it decides.
    """
    asked = length_star, thickness, height, refinement
    # The processes started below have it, too.
    fold = _fold(*asked)
    data: dict[str, tuple[Any, Any]] = {
        "lambda_c": ((), fold.lam),
        "push": ((), fold.push),
        "curvature": ((), fold.curvature),
    }
    for suffix, a, given, power in (("", 0.0, speeds, INERTIAL), ("_damped", air, damped_speeds, OVERDAMPED)):
        dim, v = f"speed{suffix}", np.asarray(given, dtype=float)
        found = grid(partial(_passage, asked, a), OF_PASSAGE, {dim: list(v)}, threads, progress)
        slope, half_width = exponent(v, found["lag"][1])
        data |= {
            dim: (dim, v),
            **{f"{name}{suffix}": found[name] for name in OF_PASSAGE},
            f"exponent{suffix}": ((), slope),
            f"exponent_half_width{suffix}": ((), half_width),
            f"theory{suffix}": ((), power),
            f"limit{suffix}": ((), limit(v, found["snap"][1], power)),
        }
    scene = {"length_star": length_star, "thickness": thickness, "height_star": height}
    return dataset(data, {**scene, "refinement": refinement, "air": air})


def facts(d: xr.Dataset) -> list[Facts]:
    """Without damping, and in air."""
    out = []
    for suffix, damping, theory in (("", "no damping", "4/5"), ("_damped", f"air drag {d.attrs['air']:g}", "2/3")):
        slope, half_width = d[f"exponent{suffix}"], d[f"exponent_half_width{suffix}"]
        speed, ratio = d[f"speed{suffix}"].values, (d[f"lag{suffix}"] / d[f"expected{suffix}"]).values
        apart = np.abs(slope - d[f"theory{suffix}"])
        ratios, speeds = f"{ratio.min():.2f} to {ratio.max():.2f}", f"{speed.min():g} to {speed.max():g}"
        words = {"suffix": suffix, "damping": damping, "theory": theory, "ratios": ratios, "speeds": speeds}
        out.append({**words, "count": speed.size, "slope": slope, "half_width": half_width, "apart": apart})
    return out


def lag_limit(d: xr.Dataset) -> Facts:
    return {"error": np.abs(d.limit - d.lambda_c), "damped": np.abs(d.limit_damped - d.lambda_c)}


# fmt: off
NUMBERS = {
    facts: (
        Number("lag_exponent{suffix}", "slope", "1", "{theory} within 0.05 or within the interval",
            "exponent of the snap's lag in the gripper's speed, {damping}, {count} speeds from {speeds} sqrt(g L*), 95 "
            "% interval +- {half_width:.3f}; the lags are {ratios} times those of the normal form",
            lambda f: f.apart < max(0.05, f.half_width), digits=4),
    ),
    lag_limit: (
        Number("lag_limit_error", "error", "L*", "< 0.001 L*",
            "lambda at the snap, extrapolated to zero speed, less the static lambda_c (in air: {damped:.1e} L*)"),
    ),
}
# fmt: on

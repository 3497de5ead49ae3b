"""A shallow arch and a column with critical points of every kind, all of them known in closed form.

A straight rod between two hinges that are moved together by ``r`` times its buckling shortening, and pressed down by a
load of the shape of a half sine.  With the mid-height w, thickness h and the load in units of Euler's force times the
squared wave number, one wave solves von Karman's equations exactly (Fung and Kaplan, 1952)::

    lambda = (1 - r) w + 3 w^3 / h^2          (lambda and w in the same direction)

* r < 1: no fold.  r = 1: a cusp, where two folds meet.  r > 1: folds at ``w^2 = (r - 1) h^2 / 9``.
* r > 5.5: before its fold the arch sways to a side, where the force in it is four times Euler's; at r = 5.5 both
  happen at once.

Terms of relative order (pi h / length)^2 are left out: :data:`REMAINDER`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import log, nan, pi

import numpy as np
from scipy.optimize import brentq

from stripfold.base.arrays import Array, Index
from stripfold.elastica._chebyshev import grid
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.linear import Band
from stripfold.solve.problem import Point, Tangent
from stripfold.strip.rod import Rod
from verification.dynamics import HeldStrip
from verification.hard_cases.case import Finding, refined

LENGTH, THICKNESS = 4.0, 0.02
REMAINDER = (pi * THICKNESS / LENGTH) ** 2
ELEMENTS = 16
NONE: Index = np.zeros(0, dtype=np.intp)
# All of it happens within a few thicknesses.
NEWTON = newton.NewtonOptions(force_tolerance=1e-11, largest_step=THICKNESS)
ROBUST = replace(NEWTON, max_iterations=100)
STEPS = StepOptions(
    first=0.02 * THICKNESS, smallest=1e-8 * THICKNESS, largest=0.2 * THICKNESS, kink=1e-6 * THICKNESS, newton=NEWTON
)
FARTHEST = 20.0 * THICKNESS
"""Arc length within which the critical point must lie."""


@dataclass(frozen=True, kw_only=True)
class Pushed(HeldStrip):
    """A held strip under a load, shape (size,), that grows with lambda."""

    load: Array

    def residual(self, q: Array, lam: float) -> Array:
        return super().residual(q, lam) - lam * self.load

    def linearise(self, q: Array, lam: float, predicted_stress: Array | None = None) -> tuple[Array, Band, Array]:
        force, tangent, _ = super().linearise(q, lam, predicted_stress)
        return force - lam * self.load, tangent, -self.load


@dataclass(frozen=True)
class Arch:
    """The arch, and its unknowns without load, shape (size,)."""

    problem: Pushed
    q: Array

    @classmethod
    def of(cls, r: float, refinement: float = 1.0) -> Arch:
        """An arch of ``r`` times Euler's shortening, on its upper side where it has two."""
        model = Rod.of(LENGTH, THICKNESS, elements=round(ELEMENTS / refinement))
        wave = np.pi / LENGTH
        sine = np.zeros(model.size)
        sine[model.middle[:, 1]], sine[3::4] = np.sin(wave * model.s), wave * np.cos(wave * model.s)
        shorter = r * (wave * THICKNESS) ** 2 / 12.0
        held = model.middle[[0, -1]].ravel()
        values = np.array([0.0, 0.0, -shorter * LENGTH, 0.0])
        load = -(wave**4) * (model.mass @ sine)
        problem = Pushed(model, held, values, np.zeros(4), 0.0, load=load)
        q = np.sqrt(max(r - 1.0, 0.0) / 3.0) * THICKNESS * sine
        q[model.middle[:, 0]] -= shorter * model.s
        q[2::4] -= shorter
        return cls(problem, newton.solve(problem, q, 0.0, NONE, options=ROBUST).q)

    def mirrored(self) -> Arch:
        """The same arch on its lower side, pushed up."""
        z = np.zeros(self.q.size, bool)
        z[1::4] = z[3::4] = True
        return Arch(replace(self.problem, load=-self.problem.load), np.where(z, -self.q, self.q))

    def points(self, start: float = 0.0, to: float = np.inf) -> list[Point]:
        """Its branch from one load to the first critical point passed, or to another load."""
        first = continuation.start(self.problem, self.q, start, NONE, 1.0, replace(STEPS, newton=ROBUST))
        out: list[Point] = []
        for point in continuation.follow(self.problem, first, STEPS):
            out.append(point)
            if len(out) > 1 and critical.is_past(point, out[-2]):
                return out
            if point.arc > FARTHEST or point.lam > to:
                break
        return out

    def critical(self) -> CriticalPoint:
        """Its first critical point; raises SolveError where there is none."""
        before, after = self.points()[-2:]
        return critical.locate(self.problem, before, after, 1e-7 * THICKNESS, STEPS)


def fold_load(r: float) -> float:
    """lambda / h of the fold."""
    return 2.0 / 9.0 * (r - 1.0) ** 1.5


def sway_load(r: float) -> float:
    """lambda / h at which it sways to a side."""
    return float(3.0 * np.sqrt((r - 4.0) / 3.0))


def _judged(value_at: Callable[[float], float], truth: float) -> Finding:
    return refined(value_at, 1.0, truth, REMAINDER * abs(truth))


def first_critical(r: float, truth: float) -> Finding:
    """lambda_c / h."""
    return _judged(lambda refinement: Arch.of(r, refinement).critical().lam / THICKNESS, truth)


def through_the_cusp(r: float) -> Finding:
    """w / h at lambda = h, followed from lambda = -h past the cusp: no fold may be found there."""

    def value_at(refinement: float) -> float:
        arch = Arch.of(r, refinement)
        point = arch.points(-THICKNESS, THICKNESS)[-1]
        if point.lam <= THICKNESS:
            return nan
        q = newton.solve(arch.problem, point.q, THICKNESS, NONE, options=NEWTON).q
        heights = q[arch.problem.model.middle[:, 1]]
        return -float(heights[heights.size // 2]) / THICKNESS

    return _judged(value_at, brentq(lambda w: (1.0 - r) * w + 3.0 * w**3 - 1.0, 0.0, 2.0, xtol=1e-14))


def folds_meet() -> Finding:
    """The exponent with which the fold's load vanishes towards the cusp."""

    def value_at(refinement: float) -> float:
        far, near = (Arch.of(r, refinement).critical().lam for r in (1.4, 1.1))
        return log(far / near) / log(4.0)

    return _judged(value_at, 1.5)


def both_sides() -> Finding:
    """Fold when pushed up over fold when pressed down."""
    arch = Arch.of(2.0)
    return Finding(arch.mirrored().critical().lam / arch.critical().lam, 1.0, 0.0, 1e-10)


def column() -> Finding:
    """A perfectly straight column stays straight beyond its buckling: only the eigenvalue shows it."""

    def value_at(refinement: float) -> float:
        model = Rod.of(1.0, 0.01, elements=round(12 / refinement))
        q = model.unknowns_of(np.stack([np.full_like(model.s, -0.5), model.s], axis=1), np.full(len(model.s), pi / 2))
        foot = np.arange(4)
        problem = Pushed(model, foot, q[foot], np.zeros(4), 0.0, load=-model.weight)
        steps = replace(STEPS, first=0.5, largest=0.5, kink=1e-6, newton=newton.NewtonOptions())
        before = continuation.start(problem, q, 0.0, NONE, 1.0, steps)
        for point in continuation.follow(problem, before, steps):
            if critical.is_past(point) or point.lam > 20.0:
                break
            before = point
        # Weight times length cubed over bending stiffness.
        return critical.locate(problem, before, point, 1e-6, steps).lam ** (1.0 / 3.0)

    return refined(value_at, 1.0, column_buckling_length(), 1e-4)


def column_buckling_length() -> float:
    """Height in L* at which a column, clamped below and free above, buckles under its own weight.

    Smallest l with a nonzero solution of theta'' + (l - s) theta = 0, theta(0) = theta'(l) = 0.

    Examples
    --------
    >>> round(column_buckling_length(), 6)
    1.986353
    """
    g = grid(32)
    # u = -l^3 (1 - sigma) G u: the eigenvalues of the operator are 1 / l^3.
    values = np.linalg.eigvals(-(1.0 - g.nodes)[:, None] * g.angle)
    return float(values.real.max() ** (-1.0 / 3.0))


def root_law() -> Finding:
    """Ratio of the smallest eigenvalues at two loads near the fold, which go with d lambda / d w of the closed form."""
    arch, r, shares = Arch.of(2.0), 2.0, (1e-2, 1e-4)
    found = arch.critical()
    eigenvalues, slopes = [], []
    for share in shares:
        state = newton.solve(arch.problem, found.before.q, found.lam * (1.0 - share), NONE, options=NEWTON)
        point = continuation.evaluate(arch.problem, state, Tangent(np.zeros(arch.q.size), 1.0))
        eigenvalues.append(abs(float(point.eigenvalues[0])))
        load, at_fold = fold_load(r) * (1.0 - share), -((r - 1.0) ** 0.5) / 3.0
        w = brentq(lambda w, load=load: (1.0 - r) * w + 3.0 * w**3 - load, 2.0 * at_fold, at_fold, xtol=1e-14)
        slopes.append(1.0 - r + 9.0 * w**2)
    ratio, truth = eigenvalues[0] / eigenvalues[1], slopes[0] / slopes[1]
    # The bracket of lambda_c, 1e-7 h, is a share of the smaller distance from the fold.
    return Finding(ratio, truth, 0.5 * truth * 1e-7 / (shares[1] * fold_load(r)), REMAINDER * truth)


def beyond_the_fold() -> None:
    """The load a little larger than the arch can bear: no state is near."""
    arch = Arch.of(2.0)
    found = arch.critical()
    options = replace(NEWTON, max_iterations=200, max_distance=0.5 * THICKNESS)
    newton.solve(arch.problem, found.before.q, found.lam * (1.0 + 1e-4), NONE, options=options)

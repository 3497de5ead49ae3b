"""A shallow arch with critical points of every kind, all of them known in closed form.

A straight rod between two hinges that are moved together by ``r`` times what makes it buckle, and pressed down by a
load of the shape of a half sine.  With the mid-height w, thickness h and the load in units of Euler's force times the
squared wave number, one wave solves von Karman's equations exactly (Fung and Kaplan, 1952)::

    lambda = (1 - r) w + 3 w^3 / h^2          (lambda and w in the same direction)

* r < 1: no fold.  r = 1: a cusp, where two folds meet.  r > 1: folds at ``w^2 = (r - 1) h^2 / 9``.
* r > 5.5: before its fold the arch sways to a side, where the force in it is four times Euler's; at r = 5.5 both are
  one.

What is left out is of order h^2 and (w / length)^2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stripfold.arrays import Array, Index
from stripfold.models.rod import Rod
from stripfold.solve import continuation, critical, newton
from stripfold.solve.continuation import StepOptions
from stripfold.solve.critical import CriticalPoint
from stripfold.solve.linear import Band
from stripfold.solve.problem import Point
from studies.modes import HeldStrip

LENGTH, THICKNESS = 4.0, 0.02
ELEMENTS = 16
NONE: Index = np.zeros(0, dtype=np.intp)
# The whole of it happens within a few thicknesses.
NEWTON = newton.NewtonOptions(force_tolerance=1e-11, largest_step=THICKNESS)
STEPS = StepOptions(
    first=0.02 * THICKNESS, smallest=1e-8 * THICKNESS, largest=0.2 * THICKNESS, kink=1e-6 * THICKNESS, newton=NEWTON
)
FARTHEST = 20.0 * THICKNESS
"""Arc length within which something must have happened."""


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
    def of(cls, r: float, elements: int = ELEMENTS) -> Arch:
        """An arch of ``r`` times Euler's shortening, on its upper side where it has two."""
        model = Rod.of(LENGTH, THICKNESS, elements=elements)
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
        return cls(problem, newton.solve(problem, q, 0.0, NONE, options=replace(NEWTON, max_iterations=100)).q)

    def height(self, q: Array) -> float:
        """Of its middle."""
        return float(q[self.problem.model.middle[:, 1]][self.problem.model.s.size // 2])

    def points(self, start: float = 0.0, to: float = np.inf) -> list[Point]:
        """Its branch from one load to the first critical point passed, or to another load."""
        patient = replace(STEPS, newton=replace(NEWTON, max_iterations=100))
        first = continuation.start(self.problem, self.q, start, NONE, 1.0, patient)
        out: list[Point] = []
        for point in continuation.follow(self.problem, first, STEPS):
            out.append(point)
            if len(out) > 1 and critical.is_past(point, out[-2]):
                return out
            if point.arc > FARTHEST or point.lam > to:
                break
        return out

    def critical(self) -> tuple[CriticalPoint, int]:
        """Its first critical point, and Newton's iterations on the way; raises SolveError where there is none."""
        points = self.points()
        found = critical.locate(self.problem, points[-2], points[-1], 1e-7 * THICKNESS, STEPS)
        return found, sum(len(p.state.residuals) - 1 for p in points)


def fold_load(r: float) -> float:
    """lambda of the fold."""
    return 2.0 / 9.0 * THICKNESS * (r - 1.0) ** 1.5


def sway_load(r: float) -> float:
    """lambda at which it sways to a side."""
    return float(3.0 * THICKNESS * np.sqrt((r - 4.0) / 3.0))

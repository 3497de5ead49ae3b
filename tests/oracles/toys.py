"""Small problems whose branches, folds and contacts are known in closed form, and what every branch must be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import sqrt

import numpy as np
import pytest
from scipy.linalg import lapack, ldl

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError
from stripfold.solve.linear import Solve
from stripfold.solve.problem import FixedUnknowns, Point, Problem, inner

NONE = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class Dense:
    """A small dense matrix."""

    a: Array

    @property
    def size(self) -> int:
        return int(self.a.shape[0])

    @property
    def block(self) -> Dense:
        return self

    def __matmul__(self, x: Array) -> Array:
        return np.asarray(self.a @ x)

    def with_fixed(self, fixed: Index) -> Dense:
        a = self.a.copy()
        scale = max(float(np.abs(np.diag(a)).max()), 1e-300)
        a[fixed, :] = 0.0
        a[:, fixed] = 0.0
        a[fixed, fixed] = scale
        return Dense(a)

    def factor(self) -> Solve:
        lu, piv, info = lapack.dgetrf(self.a)
        if info > 0:
            raise SolveError("the tangent matrix is exactly singular")
        return lambda b: np.asarray(lapack.dgetrs(lu, piv, b)[0])

    def __abs__(self) -> Dense:
        return Dense(np.abs(self.a))

    def negatives(self) -> int:
        d = ldl(self.a)[1]
        return int(np.sum(np.linalg.eigvalsh(d) < 0.0))


@dataclass(frozen=True)
class Toy(FixedUnknowns):
    """A problem from a function ``(q, lam) -> (r, dr/dq, dr/dlam)``; unit mass, nothing predicted.

    ``moved`` are prescribed unknowns that take the value lambda.
    """

    size: int
    function: Callable[[Array, float], tuple[Array, Array, Array]]
    moved: Index = field(default_factory=lambda: NONE)
    bounded: Index = field(default_factory=lambda: NONE)
    lower: Array = field(default_factory=lambda: np.zeros(0))
    weights: Array | None = None

    @property
    def prescribed(self) -> Index:
        return self.moved

    @property
    def metric(self) -> Array:
        return np.ones(self.size) if self.weights is None else self.weights

    @property
    def mass(self) -> Dense:
        return Dense(np.eye(self.size))

    def residual(self, q: Array, lam: float) -> Array:
        return self.function(q, lam)[0]

    def linearise(self, q: Array, lam: float, predicted_stress: None = None) -> tuple[Array, Dense, Array]:
        r, k, rate = self.function(q, lam)
        return r, Dense(k), rate

    def predict_stress(self, q: Array, dq: Array) -> None:
        return None

    def admissibility(self, q: Array) -> str:
        return ""

    def prescribed_values(self, lam: float) -> Array:
        return np.full(len(self.moved), lam)

    def prescribed_rates(self, lam: float) -> Array:
        return np.ones(len(self.moved))


@dataclass(frozen=True)
class Truss:
    """Von Mises' truss: two bars from (-a, 0) and (a, 0) to an apex at (0, b), loaded downwards by lambda.

    Green strain, axial stiffness ``stiffness``.  Unknowns: the apex's displacement.  On the symmetric path, at apex
    height w, ``lambda = EA w (b^2 - w^2) / L^3``.
    """

    a: float
    b: float
    stiffness: float = 100.0

    @property
    def bar(self) -> float:
        """Length of a bar."""
        return sqrt(self.a**2 + self.b**2)

    def load(self, w: Array | float) -> Array | float:
        """lambda of the symmetric path."""
        return self.stiffness * w * (self.b**2 - w**2) / self.bar**3

    @property
    def limit_load(self) -> float:
        """Its maximum, at w = b / sqrt(3)."""
        return 2.0 * self.stiffness * self.b**3 / (3.0 * sqrt(3.0) * self.bar**3)

    @property
    def pitchfork(self) -> float | None:
        """Apex height at which the truss sways to a side before the load's maximum; None for a shallow one."""
        square = self.b**2 - 2.0 * self.a**2
        return sqrt(square) if square > self.b**2 / 3.0 else None

    def function(self, q: Array, lam: float) -> tuple[Array, Array, Array]:
        r, k = np.array([0.0, lam]), np.zeros((2, 2))
        for foot in (-self.a, self.a):
            d = np.array([q[0] - foot, self.b + q[1]])
            strain = (d @ d - self.bar**2) / (2.0 * self.bar**2)
            r += self.stiffness / self.bar * strain * d
            k += self.stiffness / self.bar * (np.outer(d, d) / self.bar**2 + strain * np.eye(2))
        return r, k, np.array([0.0, 1.0])

    def problem(self) -> Toy:
        return Toy(2, self.function)


def breaking(problem: Toy, at: float) -> Toy:
    """The same problem, whose residual is no number beyond ``lam = at``: Newton fails there for no physical reason."""

    def function(q: Array, lam: float) -> tuple[Array, Array, Array]:
        r, k, rate = problem.function(q, lam)
        return (r if lam <= at else np.full_like(r, np.nan)), k, rate

    return Toy(problem.size, function, bounded=problem.bounded, lower=problem.lower, weights=problem.weights)


def branches(paths: list[list[Callable[[float], float]]]) -> Toy:
    """Unknown i solves ``product over j of (q_i - paths[i][j](lam)) = 0``: branches that are known and never meet."""

    def function(q: Array, lam: float) -> tuple[Array, Array, Array]:
        r, k, rate = np.zeros(len(paths)), np.zeros((len(paths), len(paths))), np.zeros(len(paths))
        for i, path in enumerate(paths):
            gaps = np.array([q[i] - p(lam) for p in path])
            slopes = np.array([(p(lam + 1e-6) - p(lam - 1e-6)) / 2e-6 for p in path])
            others = np.array([np.prod(np.delete(gaps, j)) for j in range(len(path))])
            r[i], k[i, i], rate[i] = np.prod(gaps), others.sum(), -slopes @ others
        return r, k, rate

    return Toy(len(paths), function)


def complementary(k: Array, f: Array, bounded: Index, lower: Array) -> tuple[Array, Index]:
    """Solution of ``k q - f >= 0, q >= lower`` on the bounded unknowns, by trying every set of contacts."""
    n = len(f)
    for choice in product((False, True), repeat=len(bounded)):
        held = bounded[list(choice)]
        q = np.zeros(n)
        q[held] = lower[list(choice)]
        free = np.setdiff1d(np.arange(n), held)
        q[free] = np.linalg.solve(k[np.ix_(free, free)], (f - k @ q)[free])
        r = k @ q - f
        if np.all(q[bounded] >= lower - 1e-12) and np.all(r[held] >= -1e-12):
            return q, held
    raise AssertionError("no solution")


def linear(k: Array, f: Array, bounded: Index, lower: Array) -> Toy:
    """``r = k q - f`` over a floor; no metric, so that no step is capped."""
    return Toy(
        len(f), lambda q, lam: (k @ q - f, k, np.zeros(len(f))), bounded=bounded, lower=lower, weights=np.zeros(len(f))
    )


def check_branch(problem: Problem, points: Sequence[Point], tolerance: float = 1e-6) -> None:
    """Equilibria with unit tangents that go on in one direction; stability changes where lambda or a mode turns."""
    for point in points:
        force = problem.residual(point.q, point.lam)
        free = np.setdiff1d(np.arange(problem.size), problem.prescribed)
        free = np.setdiff1d(free, problem.bounded)  # the floor may push there
        assert np.abs(force[free]).max(initial=0.0) < tolerance
        assert inner(problem.metric, point.tangent, point.tangent) == pytest.approx(1.0, abs=1e-9)
        assert point.negatives >= 0
    for before, after in pairwise(points):
        assert after.arc > before.arc
        assert inner(problem.metric, before.tangent, after.tangent) > 0.0, "it turned round"
        if after.negatives != before.negatives and not len(problem.bounded):
            near = min(np.abs(point.eigenvalues).min() for point in (before, after))
            far = max(np.abs(point.eigenvalues).max() for point in (before, after))
            assert near < 0.5 * far or before.tangent.lam * after.tangent.lam < 0.0

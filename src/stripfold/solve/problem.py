"""The problem protocol of the algorithms and their frozen states; no algorithm knows of strips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.solve.linear import Matrix


class Problem(Protocol):
    """Equilibrium ``r(q, lambda) = 0`` with prescribed and bounded unknowns.

    Of ``size`` n unknowns some are prescribed functions of lambda (a moving gripper), some are bounded from below (a
    floor).  On a bounded unknown ``r >= 0`` is the force that the bound exerts, zero where the bound is not met.
    ``prescribed``: unknowns that follow lambda.  ``bounded``: unknowns with a lower bound, ascending, none of them
    prescribed.  ``lower``: their bounds.  ``metric``: weights of the inner product that measures steps, (n,), >= 0.
    """

    @property
    def size(self) -> int: ...

    @property
    def prescribed(self) -> Index: ...

    @property
    def bounded(self) -> Index: ...

    @property
    def lower(self) -> Array: ...

    @property
    def metric(self) -> Array: ...

    def residual(self, q: Array, lam: float) -> Array:
        """``r``, shape (n,)."""

    def linearise(self, q: Array, lam: float, predicted_stress: Any = None) -> tuple[Array, Matrix, Array]:
        """``r``, ``dr/dq`` and ``dr/dlambda`` at fixed q; ``predicted_stress`` may change the tangent only."""

    def stepped(self, q: Array, dq: Array) -> tuple[Array, Any]:
        """The unknowns after a step, and the stress predicted for the next tangent, None where there is none."""

    def largest_change(self, q: Array, dq: Array) -> float:
        """Size of a step that damping limits."""

    def mass_at(self, q: Array) -> Matrix:
        """Matrix M of the eigenvalue problem ``K v = mu M v``."""

    def admissibility(self, q: Array) -> str:
        """Why ``q`` is inadmissible whatever its forces, in words; empty for an admissible state."""

    def prescribed_values(self, lam: float) -> Array:
        """Values of the prescribed unknowns, shape (len(prescribed),)."""

    def prescribed_rates(self, lam: float) -> Array:
        """Their derivatives by lambda."""


class FixedUnknowns:
    """The methods of a problem whose unknowns mean the same in every state: a step adds to them."""

    def stepped(self: Any, q: Array, dq: Array) -> tuple[Array, Any]:
        """The unknowns after a step, and the stress predicted for them."""
        return q + dq, self.predict_stress(q, dq)

    def predict_stress(self, q: Array, dq: Array) -> Any:
        """None: no stress is predicted."""
        return None

    def largest_change(self: Any, q: Array, dq: Array) -> float:
        """Largest change of an unknown of positive metric."""
        return float(np.abs(dq[self.metric > 0.0]).max(initial=0.0))

    def mass_at(self: Any, q: Array) -> Matrix:
        """The mass matrix, the same in every state."""
        return self.mass


@dataclass(frozen=True, eq=False)
class Tangent:
    """Direction of a branch at a point, of unit length in the problem's metric (with lambda's weight one)."""

    q: Array
    lam: float


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A converged state.

    ``active`` are the bounded unknowns on their bound; ``residuals`` is the history of the largest unbalanced force;
    ``force`` is ``r``, shape (n,), reactions included.
    """

    q: Array
    lam: float
    active: Index
    residuals: tuple[float, ...]
    force: Array


@dataclass(frozen=True, eq=False)
class Point:
    """An accepted point of a branch: an equilibrium with its tangent and stability.

    ``tangent``: unit tangent in the direction of travel.  ``negatives``: number of negative eigenvalues of the tangent
    matrix with prescribed and active unknowns held.  ``solve_eigenvalues``: computes ``eigenvalues`` and ``mode``,
    which most points are never asked for.  ``arc``: arc length from the start of the branch.
    """

    state: Equilibrium
    tangent: Tangent
    negatives: int
    solve_eigenvalues: Callable[[], tuple[Array, Array]] = field(repr=False)
    arc: float = 0.0

    @cached_property
    def _nearest(self) -> tuple[Array, Array]:
        return self.solve_eigenvalues()

    @property
    def eigenvalues(self) -> Array:
        """The eigenvalues mu of ``K v = mu M v`` nearest zero, ascending."""
        return self._nearest[0]

    @property
    def mode(self) -> Array:
        """Eigenvector of the smallest of them, shape (n,), unit mass norm."""
        return self._nearest[1]

    @property
    def lam(self) -> float:
        """The control parameter."""
        return self.state.lam

    @property
    def q(self) -> Array:
        """The unknowns."""
        return self.state.q

    @property
    def active(self) -> Index:
        """The bounded unknowns on their bound."""
        return self.state.active


def inner(metric: Array, a: Tangent, b: Tangent) -> float:
    """Inner product of two directions."""
    return float(np.dot(metric * a.q, b.q)) + a.lam * b.lam

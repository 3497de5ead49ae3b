"""Eigenvalues of the tangent that decide stability.

Near a fold one eigenvalue crosses zero and is a hundred times smaller than the next (``docs/physics.md``, section 5):
inverse iteration about zero finds it, a shifted one may not.
"""

from __future__ import annotations

from math import sqrt
from sys import float_info

import numpy as np

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError
from stripfold.solve.linear import Matrix, Solve

MOST_VECTORS, FIRST_CHECK = 60, 7
"""Largest number of vectors, and how many there are when convergence is first looked at, then after every other one."""
TOLERANCE = 1e-8
"""Largest residual of an eigenvector, as a share; that of the eigenvalue is its square."""


def nearest_eigenvalues(
    mass: Matrix, kept: Matrix, solve: Solve, held: Index, guess: Array | None = None, count: int = 2
) -> tuple[Array, Array]:
    """The ``count`` eigenvalues of ``K v = mu M v`` nearest zero, and the vector of the smallest.

    ``mass``: M, of size n.  ``kept``, ``solve``: the tangent with the unknowns ``held`` taken out, and its
    factorisation.  ``held``: prescribed and active unknowns: they do not move.  ``guess``: start vector, shape (n,).

    Returns ``eigenvalues``, ``mode``: shapes (count,), ascending, and (n,), with unit mass norm.
    """
    n = kept.size
    free = np.ones(n)
    free[held] = 0.0

    def times_mass(x: Array) -> Array:
        return free * (mass @ (free * x))

    count = min(count, int(free.sum()))
    if n <= 20:
        from scipy.linalg import eigh

        dense_k = np.column_stack([kept @ e for e in np.eye(n)])
        dense_m = np.column_stack([times_mass(e) for e in np.eye(n)])
        keep = free > 0.0
        values, vectors = eigh(dense_k[np.ix_(keep, keep)], dense_m[np.ix_(keep, keep)])
        nearest = np.sort(np.argsort(np.abs(values))[:count])
        mode = np.zeros(n)
        mode[keep] = vectors[:, nearest[0]]
        return values[nearest], mode
    return _lanczos(times_mass, lambda x: free * solve(x), free * (guess if guess is not None else np.ones(n)), count)


def _lanczos(times_mass: Solve, solve: Solve, start: Array, count: int) -> tuple[Array, Array]:
    """Largest eigenvalues, in size, of ``K^-1 M``, inverted; by Lanczos with full reorthogonalisation.

    Few steps are needed and all vectors are kept: ARPACK's restarts and callbacks cost several times the solves.
    """
    vectors = np.empty((MOST_VECTORS + 1, len(start)))
    massive = np.empty_like(vectors)  # M times each
    projected = np.zeros((MOST_VECTORS + 1, MOST_VECTORS + 1))
    new = start
    weighed = times_mass(new)
    for k in range(MOST_VECTORS):
        norm = sqrt(max(float(new @ weighed), float_info.min))
        vectors[k], massive[k] = new / norm, weighed / norm
        new = solve(massive[k])
        share = massive[: k + 1] @ new
        new = new - share @ vectors[: k + 1]
        again = massive[: k + 1] @ new
        new = new - again @ vectors[: k + 1]
        weighed = times_mass(new)
        projected[k, k] = share[k] + again[k]
        left = sqrt(max(float(new @ weighed), 0.0))
        if (k >= FIRST_CHECK and (k - FIRST_CHECK) % 2 == 0) or left == 0.0:
            values, ritz = np.linalg.eigh(projected[: k + 1, : k + 1])
            nearest = np.argsort(-np.abs(values))[:count]
            if np.all(left * np.abs(ritz[-1, nearest]) <= TOLERANCE * np.abs(values[nearest])):
                found = 1.0 / values[nearest]
                order = np.argsort(found)
                return found[order], ritz[:, nearest[order[0]]] @ vectors[: k + 1]
        projected[k, k + 1] = projected[k + 1, k] = left
    raise SolveError("the eigenvalues of the tangent did not converge")

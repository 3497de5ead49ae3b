"""Eigenvalues of the tangent that decide stability.

Near a fold of the strip one eigenvalue crosses zero almost flat and stays a hundred times smaller than the next
(``docs/physics.md``, section 5): inverse iteration about zero finds it, a shifted one may not.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..errors import SolveError
from .linear import Matrix, Solve
from .problem import Array, Index, Problem


def nearest_eigenvalues(
    problem: Problem, kept: Matrix, solve: Solve, held: Index, guess: Array | None = None, count: int = 2
) -> tuple[Array, Array]:
    """The ``count`` eigenvalues of ``K v = mu M v`` nearest zero, and the vector of the smallest.

    Parameters
    ----------
    problem
        Supplies the mass matrix.
    kept, solve
        The tangent with the unknowns ``held`` taken out, and its factorisation.
    held
        Prescribed and active unknowns: they do not move.
    guess
        Start vector, shape (n,).

    Returns
    -------
    eigenvalues, mode
        Shapes (count,), ascending, and (n,), with unit mass norm.
    """
    mass, n = problem.mass, problem.size
    free = np.ones(n)
    free[held] = 0.0

    def times_mass(x: Array) -> Array:
        return free * (mass @ (free * x.ravel()))

    count = min(count, int(free.sum()))
    if n <= 20:
        dense_k = np.column_stack([kept @ e for e in np.eye(n)])
        dense_m = np.column_stack([times_mass(e) for e in np.eye(n)])
        keep = free > 0.0
        values, vectors = scipy.linalg.eigh(dense_k[np.ix_(keep, keep)], dense_m[np.ix_(keep, keep)])
        nearest = np.sort(np.argsort(np.abs(values))[:count])
        mode = np.zeros(n)
        mode[keep] = vectors[:, nearest[0]]
        return values[nearest], mode
    start = free * (guess if guess is not None else np.ones(n))
    try:
        values, vectors = eigsh(
            LinearOperator((n, n), matvec=lambda x: kept @ x.ravel(), dtype=float),
            k=count,
            M=LinearOperator((n, n), matvec=times_mass, dtype=float),
            sigma=0.0,
            OPinv=LinearOperator((n, n), matvec=lambda x: free * solve(x.ravel()), dtype=float),
            v0=start,
            ncv=min(n - 1, 8),
            tol=1e-8,
        )
    except ArpackNoConvergence as error:
        raise SolveError("the eigenvalues of the tangent did not converge") from error
    order = np.argsort(values)
    mode = vectors[:, order[0]] * free
    return values[order], mode

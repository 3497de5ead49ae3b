"""Matrices of the algorithms, and the bordered systems of continuation.

Storages with one interface: :class:`Band` for a strip, :class:`Sparse` for a strip in contact with itself,
:class:`Bordered` with contact coordinates.  Bands are factorised by :mod:`.kernels.band`, the others by SuperLU, as are
bands that need pivots; measurements are in ``docs/method.md``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

Solve = Callable[[Array], Array]
NO_UNKNOWNS = np.empty(0, np.int64)


class Matrix(Protocol):
    """The interface that the algorithms use; ``block`` is the part without the border of a bordered matrix."""

    @property
    def size(self) -> int: ...

    @property
    def block(self) -> Matrix: ...

    def __matmul__(self, x: Array) -> Array: ...

    def with_fixed(self, fixed: Index) -> Matrix:
        """A copy whose rows and columns ``fixed`` are those of the identity (scaled by the diagonal)."""

    def factor(self) -> Solve:
        """A solver for this matrix; raises :class:`SolveError` where it is singular."""

    def negatives(self) -> int:
        """Number of negative eigenvalues of this (symmetric) matrix."""

    def __abs__(self) -> Matrix: ...


@dataclass(frozen=True)
class BandPattern:
    """Where the entries of element matrices go in the storage of :class:`Band`; made once per mesh."""

    size: int
    width: int
    position: Index

    @classmethod
    def of(cls, element_unknowns: Index, size: int) -> BandPattern:
        """Pattern of a matrix assembled from elements that touch ``element_unknowns`` (n_elements, n_local)."""
        rows = np.repeat(element_unknowns[:, :, None], element_unknowns.shape[1], axis=2)
        cols = np.swapaxes(rows, 1, 2)
        width = int(np.abs(rows - cols).max())
        lanes = kernels.band.LANES
        position = lanes + cols * (2 * width + lanes) + width + rows - cols
        return cls(size, width, position.ravel())

    def assemble(self, element_matrices: Array) -> Band:
        """Sum element matrices, shape (n_elements, n_local, n_local)."""
        band = Band.zeros(self.size, self.width)
        flat = np.bincount(self.position, element_matrices.ravel(), minlength=len(band.flat))
        return Band(np.asarray(flat, float), self.width)


@dataclass(frozen=True)
class Band:
    """A band matrix as :mod:`.kernels.band` stores it: entry (i, j) at ``columns[j, width + i - j]``."""

    flat: Array
    width: int

    @classmethod
    def zeros(cls, size: int, width: int) -> Band:
        """An empty matrix."""
        lanes = kernels.band.LANES
        return cls(np.zeros(size * (2 * width + lanes) + 2 * lanes), width)

    @cached_property
    def size(self) -> int:
        return len(self.columns)

    @property
    def columns(self) -> Array:
        """Shape (size, 2 width + LANES)."""
        lanes = kernels.band.LANES
        return self.flat[lanes:-lanes].reshape(-1, 2 * self.width + lanes)

    @property
    def block(self) -> Band:
        return self

    def __matmul__(self, x: Array) -> Array:
        # BLAS would start threads, which for bands this narrow take many times longer than the product.
        return np.asarray(kernels.band.product(self.flat, self.width, np.ascontiguousarray(x, np.float64)))

    def diagonal(self) -> Array:
        return self.columns[:, self.width]

    def __add__(self, other: Band) -> Band:
        return Band(self.flat + other.flat, self.width)

    def add(self, other: Band, factor: float) -> None:
        """Add a multiple of another matrix, in place."""
        self.flat[:] += factor * other.flat

    def __abs__(self) -> Band:
        return Band(np.abs(self.flat), self.width)

    def scaled(self, factor: float) -> Band:
        return Band(factor * self.flat, self.width)

    def rows(self, numbers: Index) -> Array:
        """Some rows, shape (len(numbers), size)."""
        return np.asarray(kernels.band.rows(self.flat, self.width, self.size, numbers))

    def add_row(self, to: int, of: int, factor: float) -> None:
        """Add a multiple of a row to another one beside it, in place."""
        j = np.arange(max(to - self.width, 0), min(to + self.width + 1, self.size))
        self.columns[j, self.width + to - j] += factor * self.rows(np.array([of]))[0, j]

    def with_fixed(self, fixed: Index) -> Band:
        kept, held = self.flat.copy(), np.zeros(self.size, bool)
        held[fixed] = True
        kernels.band.hold(kept, self.width, held)
        return Band(kept, self.width)

    @property
    def border(self) -> tuple[Array, Array, Array]:
        """None, as the kernels take it."""
        none = np.empty((0, self.size))
        return none, none, np.empty((0, 0))

    @cached_property
    def factors(self) -> tuple[Array, Index] | None:
        """Those of :func:`.kernels.band.factorise`; None where pivots are needed."""
        factors, reach = self.flat.copy(), np.empty(self.size, np.int64)
        return (factors, reach) if kernels.band.factorise(factors, self.width, reach) else None

    def factor(self) -> Solve:
        if self.factors is None:
            return Sparse(self.to_sparse()).factor()
        factors, reach = self.factors

        def solve(b: Array) -> Array:
            return np.asarray(kernels.band.substitute(factors, self.width, reach, np.ascontiguousarray(b)))

        return solve

    def negatives(self) -> int:
        if self.factors is None:
            return _negatives(self.to_sparse())
        # By Sylvester's law; the pivots are on the diagonal of U.
        lanes = kernels.band.LANES
        pivots = self.factors[0][lanes + self.width :: 2 * self.width + lanes][: self.size]
        return int(np.sum(pivots < 0.0))

    def to_sparse(self) -> csc_matrix:
        """The same matrix as scipy's compressed columns."""
        from scipy.sparse import dia_matrix

        w = self.width
        offsets = np.arange(w, -w - 1, -1)
        # scipy's `dia` storage keeps entry (i, j) in column j as LAPACK does, row by diagonal.
        return dia_matrix((self.columns[:, : 2 * w + 1].T, offsets), shape=(self.size, self.size)).tocsc()


@dataclass(frozen=True)
class Sparse:
    """A matrix in compressed columns, for entries far from the diagonal."""

    a: csc_matrix

    @property
    def size(self) -> int:
        return int(self.a.shape[0])

    @property
    def block(self) -> Sparse:
        return self

    def __matmul__(self, x: Array) -> Array:
        return np.asarray(self.a @ x)

    def __add__(self, other: Band) -> Sparse:
        return Sparse(self.a + other.to_sparse())

    def scaled(self, factor: float) -> Sparse:
        return Sparse(factor * self.a)

    def __abs__(self) -> Sparse:
        return Sparse(abs(self.a))

    def with_fixed(self, fixed: Index) -> Sparse:
        from scipy.sparse import diags

        kept = np.ones(self.a.shape[0])
        kept[fixed] = 0.0
        keep = diags(kept)
        return Sparse((keep @ self.a @ keep + diags((1.0 - kept) * np.abs(self.a.diagonal()))).tocsc())

    def factor(self) -> Solve:
        from scipy.sparse.linalg import splu

        try:
            return splu(self.a).solve
        except RuntimeError as error:
            raise SolveError("the tangent matrix is exactly singular") from error

    def negatives(self) -> int:
        return _negatives(self.a)


@dataclass(frozen=True)
class Bordered:
    """A band matrix with a few more unknowns and equations: ``[[block, columns], [rows, corner]]``."""

    block: Band
    columns: Array
    rows: Array
    corner: Array

    @property
    def size(self) -> int:
        return self.block.size + len(self.corner)

    def __matmul__(self, x: Array) -> Array:
        n = len(self.columns)
        return np.concatenate([self.block @ x[:n] + self.columns @ x[n:], self.rows @ x[:n] + self.corner @ x[n:]])

    def __abs__(self) -> Bordered:
        return Bordered(abs(self.block), np.abs(self.columns), np.abs(self.rows), np.abs(self.corner))

    def with_fixed(self, fixed: Index) -> Bordered:
        columns, rows = self.columns.copy(), self.rows.copy()
        columns[fixed] = 0.0
        rows[:, fixed] = 0.0
        return Bordered(self.block.with_fixed(fixed), columns, rows, self.corner)

    @property
    def border(self) -> tuple[Array, Array, Array]:
        """Columns, shape (k, n), rows and corner, as the kernels take them."""
        return np.ascontiguousarray(self.columns.T), self.rows, self.corner

    def factor(self) -> Solve:
        return Sparse(self.to_sparse()).factor()

    def to_sparse(self) -> csc_matrix:
        """The same matrix as scipy's compressed columns."""
        from scipy.sparse import bmat

        return bmat([[self.block.to_sparse(), self.columns], [self.rows, self.corner]]).tocsc()

    def negatives(self) -> int:
        """Number of negative eigenvalues of the block, corrected by one where its parity is not the determinant's.

        The equations of contact are scaled for a positive Schur complement, so that the determinant has the block's
        sign but for the discretisation: it changes where the branch has its limit point.
        """
        count = self.block.negatives()
        solve = self.block.factor()
        # There may be none: of a strip that is lifted as a whole.
        solved = np.reshape([solve(column) for column in self.columns.T], self.columns.T.shape)
        left = self.corner - self.rows @ solved.T
        if np.linalg.det(left) > 0.0:
            return count
        return count - 1 if count else 1


def _negatives(matrix: csc_matrix) -> int:
    """By Sylvester's law, from a factorisation without pivots."""
    from scipy.sparse.linalg import splu

    try:
        lu = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SolveError("the tangent matrix is exactly singular", advice="shift the step a little") from error
    if not np.array_equal(lu.perm_r, np.arange(matrix.shape[0])):
        raise SolveError("the count of negative eigenvalues needed a pivot", advice="shift the step a little")
    return int(np.sum(lu.U.diagonal() < 0.0))


def solve_bordered(
    matrix: Matrix,
    column: Array,
    row: Array,
    corner: float,
    rhs: Array,
    last: float,
    held: Index | None = None,
    rate: Array | None = None,
) -> tuple[Array, float]:
    """Solve ``[[K, b], [c^T, d]] [x, y] = [f, g]`` by a factorisation of K, also where K is nearly singular.

    Block elimination, then one step of iterative refinement of the whole system: without it all digits along the
    near-null vector are lost (Govaerts and Pryce, 1993).

    ``matrix``: K; ``column``, ``row``: ``b`` and ``c``, shape (n,); ``corner``, ``rhs``, ``last``: ``d``, ``f`` of
    shape (n,), zero on held unknowns, and ``g``.  ``held``: unknowns that only move with y, at their ``rate``, shape
    (n,), zero elsewhere.

    Returns ``x``, ``y``: shape (n,), and a number.  Raises SolveError: the whole is singular.
    """
    held, rate = NO_UNKNOWNS if held is None else held, np.zeros(len(rhs)) if rate is None else rate
    if isinstance(matrix, Band | Bordered):
        block, right = matrix.block, (rate, column, row, corner, rhs, last)
        found, done = kernels.band.solve_bordered(block.flat, block.width, held, *matrix.border, *right)
        if done == 1:
            raise SolveError("the bordered matrix is singular")
        if done:
            return found[:-1] + found[-1] * rate, float(found[-1])
    column, corner = column + matrix @ rate, corner + float(row @ rate)
    if len(held):
        matrix, column, row = matrix.with_fixed(held), column.copy(), row.copy()
        column[held] = row[held] = 0.0
    solve = matrix.factor()
    v = solve(column)
    pivot = corner - float(row @ v)
    if pivot == 0.0:
        raise SolveError("the bordered matrix is singular")

    def eliminate(f: Array, g: float) -> tuple[Array, float]:
        if not f.any():
            return -(g / pivot) * v, g / pivot
        w = solve(f)
        y = (g - float(row @ w)) / pivot
        return w - y * v, y

    x, y = eliminate(rhs, last)
    dx, dy = eliminate(rhs - matrix @ x - y * column, last - float(row @ x) - corner * y)
    return x + dx + (y + dy) * rate, y + dy

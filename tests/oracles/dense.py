"""Dense matrices for problems of a few unknowns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack, ldl

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import SolveError
from stripfold.solve.linear import Solve


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

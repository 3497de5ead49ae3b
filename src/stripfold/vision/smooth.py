"""Smoothing of equally spaced points with a stated cut-off, and how uncertain the smoothed points are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

Array = NDArray[np.float64]

# Rows of the third difference.
_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
VARIANCE_EVERY = 4
"""At every which point the variance is computed."""


def smoothed_values(values: Array, weights: Array, cutoff: float) -> Array:
    """Least squares with a penalty on third differences (Whittaker and Henderson).

    A wave of the length ``cutoff`` is halved, longer ones pass: one of twice that length loses 1.5 %.  Gaps (weight
    zero) are bridged with the least change of curvature.

    Parameters
    ----------
    values
        Shape (n, k), equally spaced, n > 6.
    weights
        Shape (n,), not negative.
    cutoff
        Wave length that is halved, in spacings.
    """
    factor = _factor(weights, cutoff)
    return np.asarray(cho_solve_banded((factor, True), weights[:, None] * values, check_finite=False))


def variances(weights: Array, cutoff: float) -> Array:
    """Variance of the values of :func:`smoothed_values`, shape (n,), in units of that of a value of weight 1.

    The curve is also uncertain where nothing was measured: the variance a posteriori says so.
    """
    n = len(weights)
    # It changes slowly.
    some = np.unique(np.append(np.arange(0, n, VARIANCE_EVERY), n - 1))
    columns = np.zeros((n, len(some)), order="F")
    columns[some, np.arange(len(some))] = 1.0
    inverse = cho_solve_banded((_factor(weights, cutoff), True), columns, overwrite_b=True, check_finite=False)
    return np.asarray(np.interp(np.arange(n), some, inverse[some, np.arange(len(some))]))


def _factor(weights: Array, cutoff: float) -> Array:
    """Cholesky factor of weights + stiffness D^T D, lower form."""
    band = (cutoff / (2.0 * np.pi)) ** 6 * _penalty(len(weights))
    band[0] += weights + 1e-9
    return np.asarray(cholesky_banded(band, overwrite_ab=True, lower=True, check_finite=False))


@lru_cache(maxsize=64)
def _penalty(n: int) -> Array:
    """D^T D of the third differences of n values, lower form; shape (4, n)."""
    band = np.zeros((4, n))
    for i, a in enumerate(_THIRD):
        for j in range(i + 1):
            # Row r of D touches r .. r + 3: its product with itself adds to the diagonal i - j.
            band[i - j, j : j + n - 3] += a * _THIRD[j]
    return band

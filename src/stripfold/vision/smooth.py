"""Smoothing of equally spaced points with a stated cut-off, and how uncertain the smoothed points are."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from stripfold.arrays import Array

# Rows of the third difference.
_THIRD = np.array([-1.0, 3.0, -3.0, 1.0])
VARIANCE_EVERY = 4
"""At every which point the variance is computed."""


def median(values: Array) -> float:
    """The median of finite numbers: of a few hundred numpy's own takes five times as long as finding it."""
    middle = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, middle)[middle])
    pair = np.partition(values, (middle - 1, middle))[middle - 1 : middle + 1]
    return float(pair.mean())


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
    return _solved(_factor(weights, cutoff), weights[:, None] * values)


def variances(weights: Array, cutoff: float) -> Array:
    """Variance of the values of :func:`smoothed_values`, shape (n,), in units of that of a value of weight 1.

    The curve is also uncertain where nothing was measured: the variance a posteriori says so.
    """
    n = len(weights)
    # It changes slowly.
    some = np.unique(np.append(np.arange(0, n, VARIANCE_EVERY), n - 1))
    columns = np.zeros((n, len(some)), order="F")
    columns[some, np.arange(len(some))] = 1.0
    inverse = _solved(_factor(weights, cutoff), columns)
    return np.asarray(np.interp(np.arange(n), some, inverse[some, np.arange(len(some))]))


# LAPACK itself: around systems as small as these, scipy's own solver takes longer than what it calls.
def _factor(weights: Array, cutoff: float) -> Array:
    """Cholesky factor of weights + stiffness D^T D, lower form."""
    band = (cutoff / (2.0 * np.pi)) ** 6 * _penalty(len(weights))
    band[0] += weights + 1e-9
    factor, info = dpbtrf(band, lower=1, overwrite_ab=1)
    if info:
        raise np.linalg.LinAlgError(f"weights and stiffness are not positive definite at point {info}")
    return np.asarray(factor)


def _solved(factor: Array, right: Array) -> Array:
    """Solution of the factored equations; ``right``, shape (n, k), is overwritten where it is stored by columns."""
    return np.asarray(dpbtrs(factor, right, lower=1, overwrite_b=1)[0])


@lru_cache(maxsize=64)
def _penalty(n: int) -> Array:
    """D^T D of the third differences of n values, lower form; shape (4, n)."""
    band = np.zeros((4, n), order="F")
    for i, a in enumerate(_THIRD):
        for j in range(i + 1):
            # Row r of D touches r .. r + 3: its product with itself adds to the diagonal i - j.
            band[i - j, j : j + n - 3] += a * _THIRD[j]
    return band

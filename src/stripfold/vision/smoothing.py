"""Whittaker-Henderson smoothing of equally spaced values with a stated cut-off, and the variance of what it returns."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dpbsv

from stripfold.arrays import Array


def median(values: Array) -> float:
    """Median of some hundred finite numbers; ``numpy.median`` takes several times as long, which adds up in a film."""
    middle = len(values) // 2
    ordered = np.partition(values, (middle - 1, middle))
    return float(ordered[middle] if len(values) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle]))


def smoothed(values: Array, weights: Array, cutoff: float) -> Array:
    """Smoothed ``values``, shape (n,) or (n, k), n > 6: least squares with a penalty on third differences.

    A wave of length ``cutoff`` (in spacings) is halved, one of twice that length loses 1.5 %.  Gaps (``weights``,
    shape (n,), zero) are bridged with the least change of curvature.
    """
    return _solve(weights, cutoff, (weights * values.T).T)


def variances(weights: Array, cutoff: float) -> Array:
    """Posterior variance of smoothed values, shape (n,), in units of the variance of a value of weight 1.

    It grows where nothing was measured.
    """
    return np.diag(_solve(weights, cutoff, np.eye(len(weights))))


def _solve(weights: Array, cutoff: float, right: Array) -> Array:
    band = (cutoff / (2.0 * np.pi)) ** 6 * _penalty(len(weights))
    band[0] += weights + 1e-9
    # LAPACK itself: for systems as small as these the checks of scipy.linalg take as long as the solution.
    _, solution, info = dpbsv(band, right, lower=1, overwrite_ab=1)
    if info:
        raise np.linalg.LinAlgError(f"the smoothing's equations are not positive definite: row {info}")
    return np.asarray(solution).reshape(right.shape)


@lru_cache(maxsize=64)
def _penalty(n: int) -> Array:
    """Lower bands of D^T D, shape (4, n), where D takes the third differences of n values."""
    third = np.array([-1.0, 3.0, -3.0, 1.0])
    band = np.zeros((4, n), order="F")
    for i, j in zip(*np.tril_indices(4), strict=True):
        # Row r of D has its entries in the columns r to r + 3.
        band[i - j, j : j + n - 3] += third[i] * third[j]
    return band

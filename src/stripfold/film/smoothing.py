"""Whittaker-Henderson smoothing of equally spaced values with a stated cut-off, and the variance of what it returns."""

from __future__ import annotations

import numpy as np

from stripfold import kernels
from stripfold.base.arrays import Array


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
    columns = np.ascontiguousarray(values).reshape(len(values), -1)
    return kernels.sections.smoothed(columns, weights, cutoff).reshape(values.shape)


def variances(weights: Array, cutoff: float) -> Array:
    """Posterior variance of smoothed values, shape (n,), in units of the variance of a value of weight 1.

    It grows where nothing was measured.
    """
    inverse = np.eye(len(weights))
    kernels.sections.substitute(kernels.sections.factor(weights, cutoff), inverse)
    return np.diag(inverse)

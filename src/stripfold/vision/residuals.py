"""Residuals of a fit along a strip, which neighbours share."""

from __future__ import annotations

import numpy as np

from stripfold.arrays import Array


def correlation_length(residual: Array) -> int:
    """Number of neighbours that are correlated: twice the summed autocorrelation up to its first zero."""
    n = len(residual)
    centred = residual - residual.mean()
    autocorrelation = np.correlate(centred, centred, "full")[n - 1 : n - 1 + n // 2]
    if autocorrelation[0] == 0.0:
        return 1
    positive = autocorrelation[: np.argmax(np.append(autocorrelation, 0.0) <= 0.0)]
    return int(np.clip(np.ceil(2.0 * positive.sum() / autocorrelation[0] - 1.0), 2, n // 4))

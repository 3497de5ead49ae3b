"""A heavy elastica fitted to a strip in a picture, and its residuals along the strip, which neighbours share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stripfold.base.arrays import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class ShapeFit:
    """A fitted shape; lengths in pixels.

    ``unit``, ``interval``: L* and its 95 % interval.  ``curve``: the middle of the fitted strip, shape (m, 2).
    ``residual``: measured less fitted, normal to it, shape (n,).
    """

    unit: float
    interval: tuple[float, float]
    curve: Array
    residual: Array

    @property
    def rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residual**2)))


def correlation_length(residual: Array) -> int:
    """Number of neighbours that are correlated: twice the summed autocorrelation up to its first zero."""
    n = len(residual)
    centred = residual - residual.mean()
    autocorrelation = np.correlate(centred, centred, "full")[n - 1 : n - 1 + n // 2]
    if autocorrelation[0] == 0.0:
        return 1
    positive = autocorrelation[: np.argmax(np.append(autocorrelation, 0.0) <= 0.0)]
    return int(np.clip(np.ceil(2.0 * positive.sum() / autocorrelation[0] - 1.0), 2, n // 4))

"""Computes the starts of the elastica that are stored with the package: `make starts`."""

from __future__ import annotations

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._continuation import SNAP, TOUCH, at_height, to_event
from stripfold.elastica._system import LENGTH, SCALARS, refine
from stripfold.elastica.branch import points
from stripfold.elastica.critical_point import HEIGHTS, NODES, RANGES, TABLE


def compute() -> Array:
    """The table, shape (2 HEIGHTS, NODES + 3)."""
    rows = []
    for event, (low, high) in zip((TOUCH, SNAP), np.log(RANGES), strict=True):
        for z in np.exp(low + grid(HEIGHTS).nodes * (high - low)).tolist():
            y = refine(to_event(points(z), at_height(z), event)[-1].e.y, NODES)
            y[:-SCALARS] /= y[LENGTH] ** 2
            rows.append(y)
    return np.array(rows)


if __name__ == "__main__":
    np.savetxt(TABLE, compute(), fmt="%.5g", delimiter=",")

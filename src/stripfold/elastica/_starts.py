"""Stored approximations of the critical and touching states, from which Newton's method starts.

``make starts`` computes them anew, by continuation from the state without horizontal force. Results do not depend on
them: Newton's method corrects a start to rounding.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._system import LENGTH, SCALARS, next_count, refine

TABLE = Path(__file__).with_name("starts.csv")
START_OF_SNAPS = 1.586
"""Height up to which contact is expected to come first."""
RANGES = (0.1, 1.7), (1.5, 100.0)
"""Heights of the touching and of the critical states."""
HEIGHTS, NODES = 14, 40
"""Numbers of heights in each range, at Chebyshev nodes of the logarithm, and of nodes of each state."""


def start(z: float, snap: bool) -> Array:
    """Approximate unknowns of the critical state at height ``z``, or of the touching one, with about enough nodes."""
    low, high = np.log(RANGES[snap])
    y = grid(HEIGHTS).interpolate(_table()[int(snap)], (np.log(z) - low) / (high - low))
    y[:-SCALARS] *= y[LENGTH] ** 2
    return refine(y, next_count(int(61.5 + 1.6 * z)))


@lru_cache(maxsize=1)
def _table() -> Array:
    """d^2 theta / ds^2 at the nodes and the three scalars: of each range, height and unknown."""
    return np.loadtxt(TABLE, delimiter=",").reshape(2, HEIGHTS, NODES + SCALARS)

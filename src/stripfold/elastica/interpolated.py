"""The end of the advance at any height, interpolated between solved ones: for sweeps, in a hundredth of the time."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._checks import MAX_HEIGHT, MIN_HEIGHT, height
from stripfold.elastica.critical_point import critical, touch_limit, touch_limit_state

NODES = 64
"""Solved heights on either side of the touch limit: what is between them is within 1e-10 L*, half of them would do for
1e-8 L*."""


class EndOfAdvance(NamedTuple):
    """A snap or, without one, the first touch of the sag; lambda and the length of the free part then, L*."""

    snap: bool
    advance: float
    length: float


def end_of_advance(z: float) -> EndOfAdvance:
    """What :func:`.critical` finds at gripper height ``z`` (0.1 to 100 L*), without its state.

    Raises InvalidInputError: ``z`` outside its range or not a number; SolveError: the elastica could not be solved.

    Examples
    --------
    >>> end = end_of_advance(3.0)
    >>> end.snap, round(end.advance, 9) == round(critical(3.0).advance, 9)
    (True, True)
    """
    z = height(z)
    snap = z > touch_limit()
    low, high = _range(snap)
    advance, length = grid(NODES).interpolate(_solved(snap), np.log(z / low) / np.log(high / low))
    return EndOfAdvance(snap, float(advance), float(length))


def _range(snap: bool) -> tuple[float, float]:
    return (touch_limit(), MAX_HEIGHT) if snap else (MIN_HEIGHT, touch_limit())


@lru_cache(maxsize=2)
def _solved(snap: bool) -> Array:
    """Advance and length at the nodes of the height's logarithm, shape (n, 2)."""
    low, high = _range(snap)
    inner = [critical(float(z)).state for z in low * (high / low) ** grid(NODES).nodes[1:-1]]
    limit, other = touch_limit_state(), critical(high if snap else low).state
    states = [limit, *inner, other] if snap else [other, *inner, limit]
    return np.array([(state.advance, state.length) for state in states])

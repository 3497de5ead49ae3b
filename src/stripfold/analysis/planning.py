"""Meshes graded with the elastica: fine at the lift-off point of the critical state.

Contact is at nodes, so the lift-off point moves by one node at a time and lambda is only piecewise smooth along a
branch (``docs/method.md``).  The elastica predicts the lift-off point at lambda_0 and at the critical point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np

from stripfold import elastica
from stripfold.arrays import Array
from stripfold.paths.curve import GripperPath
from stripfold.roots import root

SCAN = 0.5
"""Spacing of the places on a path at which it is compared with the stability boundary, L*."""
HIGHEST = 60.0
"""Largest height at which lambda_c is used, L*."""
NEAR = 0.1
"""Distance from the stability boundary within which a path is taken to meet it, L*."""
LOWEST = 6.7
"""Lower bound of lambda_c - z at any height, L*."""
FAR = 1e3
"""Stands for a place at a height without snap, L*."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """Element lengths in L* at refinement one; all are multiplied by the refinement."""

    free: float = 0.2
    """In the part that is always free."""
    sweep: float = 0.1
    """Where the lift-off point passes."""
    critical: float = 0.01
    """At the lift-off point of the critical state."""
    lying: float = 0.4
    """In the part that always lies."""
    grasp: float = inf
    """At the grasped end: a lying strip that is pushed bends within a fifth of L*."""
    growth: float = 0.4
    """Growth of the element length per length travelled away from a fine zone."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """Smallest distance of the lift-off point from the grasped end, and that at the critical point, L*."""

    first: float
    critical: float


def lift_off_sweep(height: float) -> Sweep:
    """Lift-off points of the elastica from lambda_0 to the end of its advance, at a height in L*.

    The free length first falls and then grows.
    """
    last = elastica.critical(height).state
    return Sweep(min(state.length for state in elastica.x_axis_branch(height)), last.length)


def sweep_on_path(path: GripperPath, length: float) -> Sweep:
    """Lift-off point of the elastica where a path first crosses the stability boundary lambda_c(z), or comes within
    :data:`NEAR` of it as the R-path does; mid-strip for a path that does neither.
    """
    from scipy.optimize import minimize_scalar  # a quarter of a command's start

    travelled = path.sampled(SCAN)[0]

    def beyond(s: float) -> float:
        x, z = path.position(s)
        if not elastica.touch_limit() < z <= HIGHEST:
            return -FAR
        least = float(x + length / 2.0 - z) - LOWEST
        if least < -1.0:
            # Too far before the boundary to matter below.
            return least
        return float(x + length / 2.0 - elastica.critical(float(z)).advance)

    values = np.array([beyond(float(s)) for s in travelled])
    for i in range(1, len(travelled)):
        s = float(travelled[i])
        if -FAR < values[i - 1] < 0.0 <= values[i]:
            s = root(beyond, float(travelled[i - 1]), s, 1e-3)
        elif i + 1 < len(travelled) and values[i] > max(values[i - 1], -1.0) and values[i] >= values[i + 1]:
            found = minimize_scalar(
                lambda s: -beyond(s),
                bounds=(travelled[i - 1], travelled[i + 1]),
                method="bounded",
                options={"xatol": 1e-3},
            )
            if found.fun > NEAR:
                continue
            s = float(found.x)
        else:
            continue
        free = elastica.critical(float(path.position(s)[1])).length
        if free < length:
            return Sweep(0.0, free)
    return Sweep(0.0, 0.5 * length)


def boundaries(length: float, sweep: Sweep, refinement: float = 1.0, sizes: Sizes | None = None) -> Array:
    """Element boundaries as distances from the grasped end, shape (m,), from 0 to ``length``.

    Parameters
    ----------
    length
        Length of the strip, L*.
    sweep
        Where the lift-off will move.
    refinement
        Factor on every element length: 0.5 has twice the elements of 1.
    sizes
        Element lengths.
    """
    z = sizes or Sizes()
    half_width = 0.25

    def size(s: float) -> float:
        before, after = max(sweep.first - 0.2 - s, 0.0), max(s - sweep.critical - 0.4, 0.0)
        coarse = min(z.free, z.sweep + z.growth * before) if before else min(z.lying, z.sweep + z.growth * after)
        away = max(abs(s - sweep.critical) - half_width, 0.0)
        return refinement * min(coarse, z.critical + z.growth * away, z.grasp + z.growth * s)

    # Outwards from the critical lift-off, which stays where it is; each side is stretched evenly to its length.
    meeting = min(sweep.critical, 0.9 * length)
    left = meeting - _march(lambda s: size(meeting - s), meeting)[::-1]
    right = meeting + _march(lambda s: size(meeting + s), length - meeting)
    return np.concatenate([left, right[1:]])


def _march(size: Callable[[float], float], length: float) -> Array:
    """Element boundaries from 0 to ``length``, each element as long as ``size`` says at its middle."""
    ends = [0.0]
    while ends[-1] < length:
        ends.append(ends[-1] + size(ends[-1] + 0.5 * size(ends[-1])))
    return np.asarray(ends) * (length / ends[-1])

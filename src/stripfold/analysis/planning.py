"""Meshes planned with the elastica: fine where the strip lifts off when it becomes critical.

The floor holds nodes, so the lift-off point moves in steps of one node and lambda of a branch is smooth in pieces
only; the fold must not be lost in those steps (``docs/method.md``).  The elastica says beforehand where along the
strip the lift-off will be at lambda_0 and at the critical point, and the mesh is graded accordingly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from stripfold import elastica
from stripfold.arrays import Array
from stripfold.paths.curve import GripperPath

SCAN = 0.5
"""Spacing at which a path is looked at, L*."""
HIGHEST = 60.0
"""Height up to which lambda_c is asked for, L*."""
NEAR = 0.1
"""How near the stability boundary a path may come without being taken to meet it, L*."""
LOWEST = 6.7
"""Less than lambda_c - z is at any height, L*: a path that is far before that needs no lambda_c (a test holds it)."""
FAR = 1e3
"""Stands for a place at whose height nothing snaps, L*."""


@dataclass(frozen=True, slots=True)
class Sizes:
    """Element lengths in L* at refinement one; all are multiplied by the refinement."""

    free: float = 0.2
    """In the part that hangs free all the time."""
    sweep: float = 0.1
    """Where the lift-off passes."""
    critical: float = 0.01
    """Where the lift-off is near the critical point."""
    lying: float = 0.4
    """In the part that lies all the time."""
    grasp: float = inf
    """At the grasped end: a strip that lies and is pushed bends within a fifth of L* (docs/method.md)."""
    growth: float = 0.4
    """Growth of the element length per length travelled away from a fine zone."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """Distances from the grasped end: the least that the lift-off point reaches, and that at the critical point; L*."""

    first: float
    critical: float


def lift_off_sweep(height: float) -> Sweep:
    """Where the elastica lifts off on its way from lambda_0 to the end of its advance, at a height in L*.

    The free length first falls, turns, and then grows to the critical point (or to where the sag lands).
    """
    last = elastica.critical(height).state
    return Sweep(min(state.length for state in elastica.x_axis_branch(height)), last.length)


def sweep_on_path(path: GripperPath, length: float) -> Sweep:
    """Where the elastica lifts off when a path first meets the stability boundary lambda_c(z).

    It crosses it, or comes within :data:`NEAR` of it: the R-path touches it only.  Where it does neither, half the
    strip: then no state of the path has to be fine anywhere.
    """
    travelled = path.sampled(SCAN)[0]

    def beyond(s: float) -> float:
        x, z = path.position(s)
        if not elastica.touch_limit() < z <= HIGHEST:
            return -FAR
        least = float(x + length / 2.0 - z) - LOWEST
        if least < -1.0:
            # Farther before the boundary than anything below looks for.
            return least
        return float(x + length / 2.0 - elastica.critical(float(z)).advance)

    values = np.array([beyond(float(s)) for s in travelled])
    for i in range(1, len(travelled)):
        s = float(travelled[i])
        if -FAR < values[i - 1] < 0.0 <= values[i]:
            s = brentq(beyond, float(travelled[i - 1]), s, xtol=1e-3)
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

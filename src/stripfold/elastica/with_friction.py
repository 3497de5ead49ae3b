"""Shapes of a strip with friction in bending whose gripper advances at constant height, to first order in the friction.

From the state without horizontal force on, in which friction has no moment, each section bends on or back as the
gripper advances; its friction moment is that of a spring and a slider.  The branch of states without friction is
corrected to first order in M_0 at right angles to the branch: unlike at a given advance, this is regular at the
critical point, and the corrected branch has its own maximum of the advance (docs/physics.md, section 8).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from math import floor, log

import numpy as np
from scipy.interpolate import CubicSpline

from stripfold.base.arrays import Array
from stripfold.elastica._chebyshev import grid, resample
from stripfold.elastica._continuation import SNAP, Point
from stripfold.elastica._system import (
    LENGTH,
    Evaluation,
    _linearised,
    computed,
    height_of,
    jacobian,
    no_lift_off_moment,
    solved,
)
from stripfold.elastica.branch import points

YIELD_CURVATURE = 0.05
"""Change of curvature after which a section slides, 1/L*: that of the solvers' friction, small against a fold's."""
NODES = 64
"""Nodes of a shape: its curvature turns sharply where friction changes sign."""
MAX_STEP = 0.2
"""Largest step along the branch, in its arc length."""
PAST = 0.15
"""Share of the arc length by which the branch is followed past its critical point: friction delays that."""
SHARES = np.linspace(0.0, 1.0 + PAST, 50)
"""Where a branch is stored, by arc length relative to that of the critical point."""
SPACING = 0.08
"""Spacing of the heights for which branches are computed, as a logarithm."""
CELL = 0.01
"""Spacing of the material points whose friction is followed, L*."""


@dataclass(frozen=True, eq=False)
class Branch:
    """States of one height at :data:`SHARES`, with their derivatives by M_0; angles in rad, lengths in L*.

    ``angle`` and ``angle_by_moment``, shape (m, :data:`NODES`), are those at the Chebyshev nodes from the lift-off to
    the gripper, ``length`` and ``length_by_moment``, shape (m,), those of the free part.
    """

    angle: Array
    angle_by_moment: Array
    length: Array
    length_by_moment: Array

    @cached_property
    def advances(self) -> tuple[float, float]:
        """Without friction the advance without horizontal force, and the largest."""
        reached = self.length * (1.0 - np.cos(self.angle) @ grid(NODES).integral[-1])
        return float(reached[0]), float(reached.max())

    def shapes(self, moment: float, advance: Array, distance: Array) -> Array:
        """Places of material points, shape (k, n, 2), L*: their x from where the free end lay when flat, and z.

        ``moment``: M_0, rho_a g L*^2.  ``advance``: of the gripper, shape (k,), L*; one beyond the largest possible is
        replaced by that.  ``distance``: of the points from the gripper along the strip, shape (n,), L*.
        """
        g, (splines, fine, at_fine) = grid(NODES), _splines()
        angle, length = self.angle + moment * self.angle_by_moment, self.length + moment * self.length_by_moment
        values = at_fine @ (length * (1.0 - np.cos(angle) @ g.integral[-1]))
        rising = slice(0, int(np.argmax(values)) + 1)
        states = splines(np.interp(advance, np.maximum.accumulate(values[rising]), fine[rising]))
        theta, free = states @ angle, (states @ length)[:, None]
        places = free[..., None] * np.stack([np.cos(theta) @ g.integral.T, np.sin(theta) @ g.integral.T], axis=2)
        at = g.interpolate(places, np.clip(1.0 - distance / free, 0.0, 1.0))
        lies = distance >= free
        return np.stack([np.where(lies, distance, free - at[..., 0]), np.where(lies, 0.0, at[..., 1])], axis=2)


@cache
def _splines() -> tuple[CubicSpline, Array, Array]:
    """The splines that are 1 at one of :data:`SHARES` and 0 at the others, shares close together, and their values.

    A spline through values at :data:`SHARES` is their sum.
    """
    splines, fine = CubicSpline(SHARES, np.eye(len(SHARES))), np.linspace(0.0, SHARES[-1], 1000)
    return splines, fine, splines(fine)


def branch(z: float) -> Branch:
    """The branch of a height, L*, by cubic interpolation between those of four heights."""
    place = log(z) / SPACING
    first = floor(place) - 1
    near = [_branch(first + i) for i in range(4)]
    others = [[j for j in range(4) if j != i] for i in range(4)]
    weights = [np.prod([(place - first - j) / (i - j) for j in others[i]]) for i in range(4)]
    names = ("angle", "angle_by_moment", "length", "length_by_moment")
    return Branch(*(sum(w * getattr(one, name) for w, one in zip(weights, near, strict=True)) for name in names))


@lru_cache(maxsize=64)
def _branch(number: int) -> Branch:
    """The branch of the height exp(number * SPACING)."""
    rows, arcs, critical = [], [], np.inf
    friction = _Friction()
    before: Point | None = None
    for point in points(float(np.exp(number * SPACING)), MAX_STEP):
        e = point.e
        moments = friction.at(e)
        angle, length = _by_moment(point, moments)
        rows.append(np.concatenate([resample(v, NODES) for v in (e.theta, angle)] + [[e.length, length]]))
        arcs.append(point.arc)
        if np.isinf(critical) and before is not None and SNAP.sign(e, point.tangent) < 0.0:
            signs = [SNAP.sign(p.e, p.tangent) for p in (before, point)]
            critical = before.arc + (point.arc - before.arc) * signs[0] / (signs[0] - signs[1])
        if point.arc > SHARES[-1] * critical:
            break
        before = point
    values = CubicSpline(arcs, rows)(critical * SHARES)
    return Branch(values[:, :NODES], values[:, NODES:-2], values[:, -2], values[:, -1])


class _Friction:
    """Friction moments over M_0 of material points, as the state changes from one to the next."""

    def __init__(self) -> None:
        self._moment = self._curvature = np.zeros(0)

    def at(self, e: Evaluation) -> Array:
        """Integral of the moments from the lift-off to each node, shape (n,)."""
        g, length = e.grid, e.length
        distance = np.arange(0.0, length + CELL, CELL)
        lifted = distance < length
        curvature = np.zeros(len(distance))
        curvature[lifted] = g.interpolate((g.slope @ e.y[: g.n]) / length, 1.0 - distance[lifted] / length)
        # A point that lies has neither curvature nor, before it is first lifted, friction.
        size = max(len(distance), len(self._moment))
        now, old, moment = (np.pad(v, (0, size - len(v))) for v in (curvature, self._curvature, self._moment))
        first = not len(self._moment)
        self._moment = moment if first else np.clip(moment + (now - old) / YIELD_CURVATURE, -1.0, 1.0)
        self._curvature = now
        total = CELL * np.concatenate([[0.0], np.cumsum(0.5 * (self._moment[1:] + self._moment[:-1]))])
        at = np.interp(length * np.append(1.0 - g.nodes, 1.0), CELL * np.arange(size), total)
        return np.asarray(at[-1] - at[:-1])


def _by_moment(point: Point, integral: Array) -> tuple[Array, float]:
    """Derivatives of the nodal angles, shape (n,), and of the length by M_0, at right angles to the branch.

    The curvature is that of the moment less the friction's: ``integral``, shape (n,), is what the angle lacks.
    """
    e, n = point.e, point.e.grid.n
    weights = e.grid.integral[-1]
    rows = [computed(no_lift_off_moment(e)[1]), height_of(e, weights)[1], point.normal]
    right = np.zeros(e.y.size)
    right[:n] = _linearised(e)[0] * integral
    right[n + 1] = e.length * (weights * e.cos) @ integral
    change = solved(jacobian(e, rows), right)
    return e.grid.angle @ change[:n] - integral, float(change[LENGTH])

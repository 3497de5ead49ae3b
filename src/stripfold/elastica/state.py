"""One equilibrium of the free part of the strip, dimensionless."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stripfold.arrays import Array
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._system import FORCE_0, FORCE_X, Evaluation
from stripfold.errors import InvalidInputError


class Profile(NamedTuple):
    """The free part at chosen arc lengths; arrays of one shape, in units of L* (curvature 1/L*)."""

    s: Array
    x: Array
    z: Array
    theta: Array
    curvature: Array


class Sag(NamedTuple):
    """Lowest point of the sagging part: arc length and height."""

    s: float
    z: float


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium of the heavy elastica (docs/physics.md, section 4).

    Lengths in units of L*, forces per width in units of the weight of a piece of length L*.
    The axis X points from the lying part to the free part; arc length starts at the lift-off point.

    Parameters
    ----------
    s, x, z, theta, curvature
        Shape (n,), at Chebyshev nodes, from s = 0 to s = length: arc length, position,
        tangent angle in rad, its derivative.  Read-only; other nodes will not do.
    force_x
        Horizontal force F_x in the strip, positive for tension at lift-off.
    force_0
        Vertical force at s = 0; at s it is ``force_0 + s``.
    length
        Length l of the free part.

    Examples
    --------
    >>> from stripfold.elastica import state_no_horizontal_force
    >>> state = state_no_horizontal_force(3.0)
    >>> round(state.reaction, 6), state.first_integral_error < 1e-9
    (1.202054, True)
    """

    s: Array
    x: Array
    z: Array
    theta: Array
    curvature: Array
    force_x: float
    force_0: float
    length: float

    @classmethod
    def _from(cls, e: Evaluation) -> State:
        g, y, length = e.grid, e.y, e.length
        curvature = (g.slope @ y[: g.n]) / length
        arrays = (
            length * g.nodes,
            length * (g.integral @ e.cos),
            length * (g.integral @ e.sin),
            e.theta.copy(),
            curvature,
        )
        for array in arrays:
            array.flags.writeable = False
        return cls(*arrays, force_x=float(y[FORCE_X]), force_0=float(y[FORCE_0]), length=length)

    def _unknowns(self) -> Array:
        """The vector of unknowns of this state, from the equilibrium equation at the nodes."""
        vertical = self.force_0 + self.s
        second = self.length**2 * (self.force_x * np.sin(self.theta) - vertical * np.cos(self.theta))
        return np.concatenate([second, [self.force_x, self.force_0, self.length]])

    @property
    def advance(self) -> float:
        """lambda = l - X(l): how far the gripper is past the place of the free end when flat."""
        return self.length - float(self.x[-1])

    @property
    def reaction(self) -> float:
        """Concentrated floor reaction at lift-off, -F_0."""
        return -self.force_0

    @property
    def gripper(self) -> tuple[float, float]:
        """Position (X, Z) of the end s = l."""
        return float(self.x[-1]), float(self.z[-1])

    @property
    def max_curvature(self) -> float:
        """Largest absolute curvature in the free part, 1/L*: a parabola through the largest of 1001 samples."""
        size = np.abs(self.at(np.linspace(0.0, self.length, 1001)).curvature)
        top = min(max(int(np.argmax(size)), 1), size.size - 2)
        before, at, after = size[top - 1 : top + 2]
        bend = before - 2.0 * at + after
        # Largest at an end (a clamp) or constant: there is no parabola with a top.
        return float(size.max() if at < size.max() or bend >= 0.0 else at - (before - after) ** 2 / (8.0 * bend))

    @property
    def droop_angle(self) -> float:
        """Angle, rad, by which the chord from s = 0 to s = l points below the horizontal."""
        return float(np.arctan2(-self.z[-1], self.x[-1]))

    @property
    def first_integral_error(self) -> float:
        """Largest deviation over the nodes of k^2/2 + F_x cos + (F_0 + s) sin - Z from its value at s = 0.

        X, Z and k come from quadratures that the solver does not use for the equation itself,
        so this is a check of the whole state.
        """
        cos, sin = np.cos(self.theta), np.sin(self.theta)
        value = self.curvature**2 / 2 + self.force_x * cos + (self.force_0 + self.s) * sin - self.z
        return float(np.abs(value - value[0]).max())

    @cached_property
    def sag(self) -> Sag | None:
        """Lowest interior point behind the first highest one, or None where nothing sags."""
        rise = np.sin(self.theta)
        # Z has a minimum where sin(theta) turns from negative to positive; at lift-off it starts positive.
        places = np.flatnonzero((rise[:-1] < 0.0) & (rise[1:] >= 0.0))
        if places.size == 0:
            return None
        return min((self._minimum(int(i)) for i in places), key=lambda sag: sag.z)

    def _minimum(self, i: int) -> Sag:
        """Minimum of Z between the nodes i and i + 1: Newton on sin(theta) = 0, kept in the bracket."""
        g = grid(self.s.size)
        low, high = float(g.nodes[i]), float(g.nodes[i + 1])
        values = np.stack([self.theta, self.length * self.curvature, self.z], axis=1)
        a, b = np.sin(self.theta[i]), np.sin(self.theta[i + 1])
        sigma = low + (high - low) * float(a / (a - b))
        for _ in range(20):
            theta, slope, _ = g.value(values, sigma)
            value, gradient = np.sin(theta), np.cos(theta) * slope
            low, high = (sigma, high) if value < 0.0 else (low, sigma)
            step = -value / gradient if gradient > 0.0 else np.inf
            new = sigma + step if low <= sigma + step <= high else (low + high) / 2
            converged = abs(new - sigma) < 1e-13
            sigma = float(new)
            if converged:
                break
        return Sag(self.length * sigma, float(g.value(values, sigma)[2]))

    @property
    def clearance(self) -> float:
        """Height of the sag over the lower layer; ``inf`` where nothing sags, negative below the floor."""
        return np.inf if self.sag is None else self.sag.z

    def at(self, s: ArrayLike) -> Profile:
        """Spectral interpolation.

        Parameters
        ----------
        s
            Arc lengths in [0, length], any shape.

        Returns
        -------
        Profile
            Arrays of the shape of ``s``.

        Raises
        ------
        InvalidInputError
            An arc length outside the free part, or not a number.
        """
        allowed = f"arc lengths in [0, {self.length:.9g}]"
        try:
            points = np.asarray(s, dtype=np.float64)
        except (TypeError, ValueError):
            raise InvalidInputError("s", s, allowed) from None
        slack = 1e-12 * self.length
        if not bool(np.all((points >= -slack) & (points <= self.length + slack))):
            raise InvalidInputError("s", s, allowed)
        values = np.stack([self.x, self.z, self.theta, self.curvature], axis=1)
        x, z, theta, curvature = grid(self.s.size).interpolate(values, points / self.length)
        return Profile(points, x, z, theta, curvature)

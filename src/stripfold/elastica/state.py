"""One equilibrium of the free part of the strip, dimensionless."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.numerics import root
from stripfold.elastica._chebyshev import grid
from stripfold.elastica._system import FORCE_0, FORCE_X, Evaluation


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

    Lengths in L*, forces per width in the weight of a length L*. The X axis points from the lying part to the free
    part; arc length starts at the lift-off point.

    ``s``, ``x``, ``z``, ``theta``, ``curvature``: shape (n,), at the Chebyshev nodes of [0, length]: arc length,
    position, tangent angle in rad, its derivative. Read-only.  ``force_x``: horizontal force F_x, positive for tension
    at lift-off.  ``force_0``: vertical force F_0 at s = 0; at s it is ``force_0 + s``.  ``length``: length l of the
    free part.

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
    def of(
        cls,
        theta: Array,
        curvature: Array,
        force_x: float,
        force_0: float,
        length: float,
        start: tuple[float, float] = (0.0, 0.0),
    ) -> State:
        """From nodal angles and curvatures, each of shape (n,); the position by quadrature from ``start``."""
        g = grid(theta.size)
        x = start[0] + length * (g.integral @ np.cos(theta))
        z = start[1] + length * (g.integral @ np.sin(theta))
        arrays = (length * g.nodes, x, z, theta.copy(), curvature)
        for array in arrays:
            array.flags.writeable = False
        return cls(*arrays, force_x=force_x, force_0=force_0, length=length)

    @classmethod
    def _from(cls, e: Evaluation) -> State:
        curvature = (e.grid.slope @ e.y[: e.grid.n]) / e.length
        return cls.of(e.theta, curvature, float(e.y[FORCE_X]), float(e.y[FORCE_0]), e.length)

    def _unknowns(self) -> Array:
        """The vector of unknowns of this state, from the equilibrium equation at the nodes."""
        vertical = self.force_0 + self.s
        second = self.length**2 * (self.force_x * np.sin(self.theta) - vertical * np.cos(self.theta))
        return np.concatenate([second, [self.force_x, self.force_0, self.length]])

    @property
    def advance(self) -> float:
        """lambda = l - X(l): the gripper's distance past the place of the free end when flat."""
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
    def energy(self) -> float:
        """Bending and potential energy per width, rho_a g L*^2; zero for the flat strip."""
        return self.length * float(grid(self.s.size).integral[-1] @ (self.curvature**2 / 2 + self.z))

    @property
    def droop_angle(self) -> float:
        """Angle, rad, by which the chord from s = 0 to s = l points below the horizontal."""
        return float(np.arctan2(-self.z[-1], self.x[-1]))

    @property
    def first_integral_error(self) -> float:
        """Largest deviation of k^2/2 + F_x cos(theta) + (F_0 + s) sin(theta) - Z from its value at s = 0.

        An independent check: the solver does not use the quadratures that X, Z and k come from.
        """
        cos, sin = np.cos(self.theta), np.sin(self.theta)
        value = self.curvature**2 / 2 + self.force_x * cos + (self.force_0 + self.s) * sin - self.z
        return float(np.abs(value - value[0]).max())

    @cached_property
    def sag(self) -> Sag | None:
        """Lowest of the interior minima of Z, or None where nothing sags."""
        rise = np.sin(self.theta)
        places = self.zeros(rise, upwards=True)
        if not places:
            return None
        z = self.at(places).z
        lowest = int(np.argmin(z))
        return Sag(places[lowest], float(z[lowest]))

    @property
    def clearance(self) -> float:
        """Height of the sag over the lower layer; ``inf`` where nothing sags, negative below the floor."""
        return np.inf if self.sag is None else self.sag.z

    def zeros(self, values: Array, upwards: bool = False) -> list[float]:
        """Arc lengths where nodal values change sign, or only where they become positive."""
        g, negative = grid(self.s.size), values < 0.0
        crossed = negative[:-1] & ~negative[1:] if upwards else negative[:-1] != negative[1:]
        return [
            self.length * root(lambda at: float(g.interpolate(values, at)), g.nodes.item(i), g.nodes.item(i + 1), 1e-14)
            for i in np.flatnonzero(crossed)
        ]

    def at(self, s: ArrayLike) -> Profile:
        """The profile at the arc lengths ``s`` in [0, length], any shape, by spectral interpolation.

        Raises InvalidInputError: an arc length outside the free part, or not a number.
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
        return Profile(points, *np.moveaxis(grid(self.s.size).interpolate(values, points / self.length), -1, 0))

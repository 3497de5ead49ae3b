"""Boundaries in the plane of the gripper's places, followed from point to point; lengths in L*.

A place is the advance of the gripper past the flat end and its height; the lying part is as long as it must be.  The
snap boundary is the limit point of constant height, continued with the height as second parameter.  It begins where the
sag of the critical state touches the lower layer; there the touch boundary crosses it.  Source: docs/map.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.arguments import number
from stripfold.base.arrays import Array
from stripfold.elastica._continuation import (
    SNAP,
    TOUCH,
    Event,
    Family,
    Point,
    advance_gradient,
    at_length,
    length_gradient,
    march,
    point_at,
    to_event,
)
from stripfold.elastica._system import Condition, end_height, evaluate, height_of, no_lift_off_moment
from stripfold.elastica.critical_point import touch_limit_state
from stripfold.elastica.half_fold import (
    states_drawn_taut,
    states_fixed_lift_off,
    states_no_horizontal_force,
    states_point_contact,
)
from stripfold.elastica.state import State
from stripfold.elastica.textile import folded_loop

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline
    from scipy.spatial import cKDTree

STEP = 0.03
"""Largest step along a boundary, in arc length: the cubics between its points are then within 1e-7 L* of it."""
TAUT = 200.0
"""Horizontal force, rho_a g L*, from which a strip counts as a string without stiffness: within 1e-5 L*."""
FINE = 0.002
"""Difference of height of the places on a boundary among which the nearest one is looked for, L*; Newton's method makes
it exact.  Of two that are about as near coarser ones choose the wrong one."""
NEWTON_STEPS = 4
"""Steps of that Newton's method: the samples are so dense that it converges in two."""
LENGTHS = 7.0, 100.0
"""Tested lengths of the whole strip, L*: longer than the shortest that can be folded in half."""
LOWEST = 1e-3
"""Lowest height of a computed state whose sag touches, L*; at height 0 it is the folded one."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """A boundary with one advance at each height.

    ``states``: in the order of their heights, ascending.  ``slope``: shape (n,): derivative of the advance over the
    height at each.
    """

    states: tuple[State, ...]
    slope: Array

    @cached_property
    def z(self) -> Array:
        """Heights of the states, shape (n,)."""
        # The folded state has a height of 0 but for rounding.
        return np.array([max(state.gripper[1], 0.0) for state in self.states])

    @cached_property
    def advance(self) -> Array:
        """Advances of the states, shape (n,)."""
        return np.array([state.advance for state in self.states])

    @cached_property
    def _curve(self) -> CubicHermiteSpline:
        """The advance over the fourth root of the height, which is how the length of a slightly lifted part grows."""
        from scipy.interpolate import CubicHermiteSpline

        root = self.z**0.25
        return CubicHermiteSpline(root, self.advance, 4.0 * root**3 * self.slope, extrapolate=False)

    def at(self, z: Array | float) -> Array:
        """The advance at heights of any shape; nan outside."""
        return np.asarray(self._curve(np.asarray(z) ** 0.25))

    def slope_at(self, z: Array) -> Array:
        """Its derivative over the height, greater than 0; nan outside."""
        return np.asarray(self._curve(z**0.25, 1) / (4.0 * z**0.75))

    @cached_property
    def _samples(self) -> tuple[Array, cKDTree]:
        """Heights on it :data:`FINE` apart, and a tree of its places there."""
        from scipy.spatial import cKDTree

        samples = np.linspace(self.z[0], self.z[-1], ceil((self.z[-1] - self.z[0]) / FINE) + 1)
        # Far from a curve the defaults take four times as long: much of it is about as near.
        options = {"leafsize": 64, "compact_nodes": False, "balanced_tree": False}
        return samples, cKDTree(np.column_stack([self.at(samples), samples]), **options)

    def distance(self, advance: Array, z: Array) -> Array:
        """Distance of places, two arrays of one shape, from it; negative behind it, at a larger advance."""
        place, height = np.ravel(advance), np.ravel(z)
        samples, tree = self._samples
        # The tree takes finite numbers; of others the distance is none.
        places = np.nan_to_num(np.column_stack([place, height]), posinf=0.0, neginf=0.0)
        nearest = samples[tree.query(places)[1]]
        for _ in range(NEWTON_STEPS):
            on, slope = self.at(nearest), self.slope_at(nearest)
            nearest = nearest - ((on - place) * slope + nearest - height) / (1.0 + slope**2)
            nearest = np.clip(nearest, samples[0], samples[-1])
        distance = np.hypot(place - self.at(nearest), height - nearest)
        return np.where(place > self.at(height), -distance, distance).reshape(np.shape(advance))


def snap_boundary(length: float) -> Boundary:
    """The critical states from the touch limit up to the height where a strip of ``length``, 7 to 100 L*, is lifted.

    Raises InvalidInputError: ``length`` outside its range or not a number; SolveError: the boundary could not be
    followed.

    Examples
    --------
    >>> round(float(snap_boundary(12.0).at(3.0)), 6)
    9.856908
    """
    return _boundary(_followed(SNAP.condition, at_length(_checked(length)), 1.0))


def touch_boundary(length: float) -> Boundary:
    """The states whose sag touches the lower layer, from the folded one to the one where all of the strip is lifted.

    Below the touch limit a hanging strip lands there; above it a landed one comes off.  Argument and errors are those
    of :func:`snap_boundary`.
    """
    low = Event(lambda e, _: State._from(e).gripper[1] - LOWEST, end_height(LOWEST))
    up = _followed(TOUCH.condition, at_length(_checked(length)), 1.0)
    down = _followed(TOUCH.condition, low, -1.0)
    found = _boundary([*down[:0:-1], *up])
    return Boundary((folded_loop().state, *found.states), np.append(0.0, found.slope))


def lift_boundary(length: float) -> tuple[Array, Array]:
    """Advance and height, two arrays of shape (n, 2), where the last of a strip of ``length`` has left the floor.

    That of the hanging strip goes from the flat one through taut ones and the end of the snap boundary to the one whose
    sag touches, that of the landed strip from there to the gripper on the floor.  Argument and errors are those of
    :func:`snap_boundary`.
    """
    length = _checked(length)
    free = list(states_fixed_lift_off(length))
    taut = list(states_drawn_taut(length, TAUT))
    hanging = [(state.advance, state.gripper[1]) for state in (*taut[:0:-1], *free)]
    force = TAUT * np.geomspace(1e4, 1.0, 50, endpoint=False)
    string = length - force**-0.5  # its stiffness shortens it at lift-off
    taken = np.stack([string - force * np.arcsinh(string / force), np.hypot(force, string) - force], axis=1)
    rolled = [(length - x, z) for x, z in (contact.gripper for contact in states_point_contact(free[-1]))]
    loop = folded_loop()
    upper = length - loop.arc
    states = list(states_no_horizontal_force(upper))
    # The upper layer lies behind the loop, as far as it is not lifted.
    laid = [(length + loop.offset + upper - s.length + s.gripper[0], s.gripper[1]) for s in states[-2::-1]]
    return np.vstack([(0.0, 0.0), taken, hanging]), np.array([*rolled, *laid, (length + loop.offset + upper, 0.0)])


def _checked(length: float) -> float:
    return number("length", length, ", in units of L*", LENGTHS)


def _followed(condition: Condition, end: Event, way: float) -> list[Point]:
    """The points from the touch limit to an end, ``way`` is 1 towards longer free parts and -1 towards shorter ones."""
    family = Family((no_lift_off_moment, condition), "of a boundary")
    e = evaluate(touch_limit_state()._unknowns())
    points = march(point_at(e, family, way * length_gradient(e)), family, step=STEP, max_step=STEP)
    return to_event(points, family, end)


def _boundary(points: list[Point]) -> Boundary:
    slopes = []
    for point in points:
        rise = height_of(point.e, point.e.grid.integral[-1])[1] @ point.tangent
        slopes.append(float(advance_gradient(point.e) @ point.tangent / rise))
    return Boundary(tuple(State._from(point.e) for point in points), np.array(slopes))

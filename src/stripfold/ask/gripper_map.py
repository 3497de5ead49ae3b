"""The places of the gripper that a frictionless strip follows, and how far they are from where it snaps.

On the elastica; lengths in L*, eigenvalues in g/L*, energies per width in rho_a g L*^2.  A place is the advance of the
gripper past the flat end and its height.  At some places the strip can either hang or lie, with its sag on the lower
layer.  Source: docs/map.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stripfold.base.arrays import Array
from stripfold.elastica._continuation import at_height, between, until
from stripfold.elastica._events import SNAP
from stripfold.elastica.barrier import barrier_coefficient
from stripfold.elastica.boundary import TAUT, Boundary, lift_boundary, snap_boundary, touch_boundary
from stripfold.elastica.branch import points
from stripfold.elastica.second_variation import smallest_eigenvalue
from stripfold.elastica.state import State

GRID = 64, 24
"""Numbers of places of the grid along x and z: less than L* apart for a strip of 20 L*."""
MAX_STEP = 0.15
"""Largest step along a branch whose eigenvalues are interpolated, in arc length: they are then within 3e-3."""


@dataclass(frozen=True, eq=False)
class GripperMap:
    """The boundaries of a strip of one length; make it with :func:`gripper_map`.

    ``length``: of the strip.  ``snap``, ``touch``: where hanging strips snap, and where the sag touches.  ``lifted``,
    ``lifted_landed``: rows of advance and height where the last of a hanging and of a landed strip leaves the floor.
    """

    length: float
    snap: Boundary
    touch: Boundary
    lifted: Array
    lifted_landed: Array

    @cached_property
    def coefficient(self) -> Array:
        """C of the law of the energy barrier (:class:`.BistableRange`) at the states of the snap boundary."""
        return np.array([barrier_coefficient(state) for state in self.snap.states])

    @property
    def curves(self) -> dict[str, Array]:
        """The boundaries by name, shape (n, 2) each: x with its origin mid-strip, and z."""
        rows = {
            "snap": np.column_stack([self.snap.advance, self.snap.z]),
            "sag_touch": np.column_stack([self.touch.advance, self.touch.z]),
            "lifted": self.lifted,
            "lifted_landed": self.lifted_landed,
        }
        return {name: row - (self.length / 2.0, 0.0) for name, row in rows.items()}

    @property
    def grid(self) -> tuple[Array, Array]:
        """Advances and heights of a grid of :data:`GRID`: all places of the map but the floor and the highest."""
        columns, rows = GRID
        heights = self.lifted[:, 1].max() * np.arange(1, rows + 1) / (rows + 1)
        return np.linspace(0.0, self.lifted_landed[-1, 0], columns), heights

    def hanging(self, z: Array) -> tuple[Array, Array]:
        """Least and largest advance of a hanging strip at heights of any shape, nan where it cannot hang."""
        top = int(np.argmax(self.lifted[:, 1]))
        rising, falling = self.lifted[: top + 1], self.lifted[: top - 1 : -1]
        least = np.interp(z, rising[:, 1], rising[:, 0], right=np.nan)
        largest = np.where(z < self.snap.z[0], self.touch.at(z), self.snap.at(z))
        above = z > self.snap.z[-1]
        return least, np.where(above, np.interp(z, falling[:, 1], falling[:, 0], right=np.nan), largest)

    def landed(self, z: Array) -> tuple[Array, Array]:
        """Least and largest advance of a landed strip at heights of any shape, nan where it cannot lie."""
        low = self.lifted_landed[::-1]
        return self.touch.at(z), np.interp(z, low[:, 1], low[:, 0], right=np.nan)

    def margin(self, advance: Array, z: Array) -> Array:
        """Distance of places to the snap boundary, arrays of one shape; nan where the strip cannot hang."""
        return np.where(self.hangs(advance, z), self.snap.distance(advance, z), np.nan)

    def hangs(self, advance: Array, z: Array) -> Array:
        """Whether the strip can hang at places."""
        return _within(advance, self.hanging(z))

    def lies(self, advance: Array, z: Array) -> Array:
        """Whether the strip can lie at places, with its sag on the lower layer."""
        return _within(advance, self.landed(z))

    def barrier(self, advance: Array, z: Array) -> Array:
        """Energy that makes a hanging strip fall, by its law; nan where the strip can only hang, or cannot."""
        from scipy.interpolate import make_interp_spline

        coefficient = make_interp_spline(self.snap.z, self.coefficient)(z)
        largest = self.snap.at(z)
        both = _within(advance, (self.touch.at(z), largest))
        return np.where(both, coefficient * np.maximum(largest - advance, 0.0) ** 1.5, np.nan)

    def eigenvalues(self, advance: Array, z: float) -> Array:
        """Smallest eigenvalue at advances, shape (n,), of one height; nan where the strip cannot hang.

        Raises SolveError: the states at this height could not be followed.
        """
        from scipy.interpolate import make_interp_spline

        known = np.array(sorted(dict(self._row(z)).items()))
        # At the largest advance it is zero, and smooth in the root of the distance.
        end = known[-1, 0]
        curve = make_interp_spline(-np.sqrt(end - known[:, 0]), known[:, 1])
        inside = self.hangs(advance, np.full_like(advance, z))
        return np.where(inside, curve(-np.sqrt(np.maximum(end - advance, 0.0))), np.nan)

    def _row(self, z: float) -> Iterator[tuple[float, float]]:
        """Advance and eigenvalue of states at one height, from a taut one to the largest advance."""
        family = at_height(z)
        for point in points(z, MAX_STEP, -1.0):
            state = State._from(point.e)
            yield state.advance, smallest_eigenvalue(state)
            if state.length > self.length or state.force_x > TAUT:
                break
        # Without regard to the floor, which the sag may touch before.
        *free, before, after = until(points(z, MAX_STEP), SNAP)
        for point in (*free[1:], before):
            state = State._from(point.e)
            yield state.advance, smallest_eigenvalue(state)
        yield State._from(between(before, after, family, SNAP).e).advance, 0.0


def gripper_map(length: float) -> GripperMap:
    """The map of a strip of ``length``, 7 to 100 L*.

    Raises
    ------
    InvalidInputError
        ``length`` outside its range or not a number.
    SolveError
        A boundary could not be followed.

    Examples
    --------
    >>> found = gripper_map(20.0)
    >>> float(found.margin(np.array(9.0), np.array(3.0)).round(4))
    0.6155
    """
    snap, touch = snap_boundary(length), touch_boundary(length)
    lifted, lifted_landed = lift_boundary(length)
    # Beyond the end of the snap boundary the lifted strip is not stable.
    stable = np.flatnonzero(lifted[:, 1] > snap.z[-1])[-1] + 1
    end = snap.advance[-1], snap.z[-1]
    return GripperMap(length, snap, touch, np.vstack([lifted[:stable], end]), lifted_landed)


def _within(advance: Array, ends: tuple[Array, Array]) -> Array:
    return np.asarray((advance >= ends[0]) & (advance <= ends[1]))

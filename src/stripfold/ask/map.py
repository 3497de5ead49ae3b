"""The stability map: places of the gripper that a frictionless strip follows, and how far they are from where it snaps.

On the elastica: a place is the advance of the gripper past the flat end and its height.  At some places the strip can
either hang or lie, with its sag on the lower layer.  :class:`GripperMap` is in L*, g/L* (eigenvalues) and rho_a g L*^2
(energies per width), :class:`StabilityMap` in SI.  Source: docs/map.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold.ask.friction import HISTORY, MOST, FrictionBoundary, friction_boundary
from stripfold.ask.inputs import MapInputs
from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.elastica._continuation import SNAP, at_height, between, until
from stripfold.elastica.barrier import barrier_coefficient, smallest_eigenvalue
from stripfold.elastica.boundary import LENGTHS, TAUT, Boundary, lift_boundary, snap_boundary, touch_boundary
from stripfold.elastica.branch import points
from stripfold.elastica.state import State
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

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

    def drawn(self, unit: float, friction: tuple[Array, Mask, str] | None = None, path: Array | None = None) -> Figure:
        """Draw the boundaries and lines of equal margin; ``unit``: L*, m.

        ``friction``: places where a strip with friction ends, which of them snap, and for which history.  ``path``:
        places of the gripper on a path; all in m.
        """
        from stripfold.draw.results import draw_stability

        curves = {name: unit * curve for name, curve in self.curves.items()}
        advance, heights = self.grid
        grid = unit * (advance - self.length / 2.0), unit * heights
        margin = unit * self.margin(*np.meshgrid(advance, heights))
        return draw_stability(curves, grid, margin, unit * self.length, friction, path)

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
    """Make the map of a strip of ``length``, 7 to 100 L*; raises SolveError: a boundary could not be followed."""
    snap, touch = snap_boundary(length), touch_boundary(length)
    lifted, lifted_landed = lift_boundary(length)
    # Beyond the end of the snap boundary the lifted strip is not stable.
    stable = np.flatnonzero(lifted[:, 1] > snap.z[-1])[-1] + 1
    end = snap.advance[-1], snap.z[-1]
    return GripperMap(length, snap, touch, np.vstack([lifted[:stable], end]), lifted_landed)


def _within(advance: Array, ends: tuple[Array, Array]) -> Array:
    return np.asarray((advance >= ends[0]) & (advance <= ends[1]))


@dataclass(frozen=True, eq=False, repr=False)
class StabilityMap(Result):
    """The gripper places that a frictionless strip follows from the flat state; x and z with the origin mid-strip, m.

    The model is the elastica: thickness and stretch do not count.  Source: docs/map.md.

    Attributes
    ----------
    in_star
        The same map in units of L*, over the advance in place of x.
    with_friction
        The ends of the advance with friction, in units of L*; None where no friction is given.
    strip, seconds
        The inputs, and the run time.
    """

    in_star: GripperMap
    with_friction: FrictionBoundary | None
    strip: MapInputs
    seconds: float
    title = "stability map of the gripper's places"
    shown = ("strip", "touch_limit")

    @classmethod
    def of(cls, strip: MapInputs, progress: Progress | None = None) -> Self:
        """Compute it."""
        began = perf_counter()
        low, high = (limit * strip.gravity_length for limit in LENGTHS)
        if not low <= strip.length <= high:
            allowed = f"from {low:.3g} to {high:.3g} m with eta_b = {strip.eta_b:g} m^-4 s^2"
            raise InvalidInputError("length", strip.length, allowed, "a shorter strip cannot be folded in half")
        moment, most = strip.friction_moment, MOST * strip.material.scales["N"]
        if moment is not None and moment > most:
            allowed = f"at most {most:.3g} N with rho_a = {strip.rho_a:g} kg m^-2, {MOST:g} rho_a g L*^2"
            advice = "give rho_a too: friction counts against weight"
            raise InvalidInputError("friction_moment", moment, allowed, advice)
        say = progress or (lambda _: None)
        say("boundaries")
        found = gripper_map(strip.length_star)
        friction = None
        if moment is not None:
            friction = friction_boundary(strip.length_star, moment / strip.material.scales["N"], say)
        return cls(found, friction, strip, perf_counter() - began)

    @cached_property
    def eigenvalues(self) -> Array:
        """Smallest eigenvalue at the places of the grid, g/L*, shape (z, x); nan where the strip cannot hang.

        Seconds, where the map takes one: computed when it is asked for.  Raises SolveError: as in
        :meth:`GripperMap.eigenvalues`.
        """
        advance, heights = self.in_star.grid
        return np.array([self.in_star.eigenvalues(advance, float(z)) for z in heights])

    @property
    def touch_limit(self) -> float:
        """Gripper height below which the sag touches before the strip can snap, m."""
        return float(self.in_star.snap.z[0]) * self.strip.gravity_length

    @property
    def snap_boundary(self) -> Array:
        """Shape (n, 2): x and z on the boundary behind which a hanging strip snaps, upwards from the touch limit."""
        return self._places(self.in_star.snap.advance, self.in_star.snap.z)

    def hangs(self, x: Any, z: Any) -> Any:
        """Whether the strip can hang there, that is stably and off the lower layer; arrays of one shape, m."""
        return self.in_star.hangs(*self._star(x, z))

    def lies(self, x: Any, z: Any) -> Any:
        """Whether the strip can have its sag on the lower layer there; arrays of one shape, m."""
        return self.in_star.lies(*self._star(x, z))

    def margin(self, x: Any, z: Any) -> Any:
        """Distance of places of the gripper to the snap boundary, m; nan where the strip cannot hang."""
        return self.strip.gravity_length * self.in_star.margin(*self._star(x, z))

    def barrier(self, x: Any, z: Any) -> Any:
        """Energy that makes a hanging strip fall, J per m of width; nan where it can only hang, or cannot."""
        return self.strip.material.scales["J m-1"] * self.in_star.barrier(*self._star(x, z))

    def rows(self) -> Rows:
        unit, boundary = self.strip.gravity_length, self.snap_boundary
        (x0, z0), (x1, z1) = boundary[0], boundary[-1]
        return [
            ("L*", f"{unit:.5g} m; length {self.strip.length_star:.4g} L*"),
            ("no snap", metres(self.touch_limit, "below this height the sag touches first")),
            ("boundary", f"x = {x0:.5g} m, z = {z0:.5g} m  to  x = {x1:.5g} m, z = {z1:.5g} m"),
            ("highest", metres(float(self.in_star.lifted[:, 1].max()) * unit, "above this height all is lifted")),
            *self._friction_rows(),
            ("time", f"{self.seconds:.2f} s"),
        ]

    def _friction_rows(self) -> Rows:
        if (found := self.with_friction) is None:
            return []
        unit, ends = self.strip.gravity_length, []
        for what, z in (("the sag touches at heights of", found.z[~found.snaps]), ("snaps at", found.z[found.snaps])):
            if len(z):
                ends.append(f"{what} {unit * z[0]:.4g} to {unit * z[-1]:.4g} m")
        return [("friction", "; ".join(ends)), ("  history", HISTORY)]

    def to_dict(self) -> dict[str, Any]:
        numbers: dict[str, Any] = {"touch_limit": self.touch_limit, "seconds": self.seconds}
        numbers["snap_boundary"] = self.snap_boundary.tolist()
        if (found := self.with_friction) is not None:
            numbers["friction_boundary"] = self._places(found.advance, found.z).tolist()
            numbers |= {"friction_snap": found.snaps.tolist(), "friction_history": HISTORY}
        return numbers

    def to_dataset(self) -> xr.Dataset:
        found, material = self.in_star, self.strip.material
        advance, heights = found.grid
        places = np.meshgrid(advance, heights)
        grid, half = ("map_z", "map_x"), found.length / 2.0
        width = found.snap.advance - found.touch.at(found.snap.z)
        values: dict[str, Any] = {
            "map_x": ("map_x", advance - half),
            "map_z": ("map_z", heights),
            "hangs": (grid, found.hangs(*places).astype(int)),
            "lies": (grid, found.lies(*places).astype(int)),
            "margin": (grid, found.margin(*places)),
            "eigenvalue": (grid, self.eigenvalues),
            "barrier": (grid, found.barrier(*places)),
            "bistable_width": ("snap", width),
            "largest_barrier": ("snap", found.coefficient * np.maximum(width, 0.0) ** 1.5),
        }
        for name, curve in found.curves.items():
            values |= {f"{name}_x": (name, curve[:, 0]), f"{name}_z": (name, curve[:, 1])}
        attrs: dict[str, Any] = {**material.attributes, "length": self.strip.length, "touch_limit": self.touch_limit}
        if (friction := self.with_friction) is not None:
            values |= {"friction_x": ("friction", friction.advance - half), "friction_z": ("friction", friction.z)}
            values |= {"friction_snap": ("friction", friction.snaps.astype(int))}
            attrs |= {"friction_moment": self.strip.friction_moment, "friction_history": HISTORY}
        return schema.dataset(values, attrs, material.scales)

    def plot(self) -> Figure:
        """The boundaries, and lines of equal margin."""
        found, friction = self.with_friction, None
        if found is not None:
            text = f"friction {self.strip.friction_moment:.3g} N: {HISTORY}"
            friction = self._places(found.advance, found.z), found.snaps, text
        return self.in_star.drawn(self.strip.gravity_length, friction)

    def config(self) -> dict[str, Any]:
        return self.strip.model_dump()

    def _star(self, x: Any, z: Any) -> tuple[Array, Array]:
        """Advance and height, L*."""
        unit = self.strip.gravity_length
        given = {"x": np.asarray(x), "z": np.asarray(z)}
        for key, values in given.items():
            if values.dtype.kind not in "iuf":
                raise InvalidInputError(key, values.tolist(), "a number, or an array of numbers, m")
        try:
            places, heights = np.broadcast_arrays(*given.values())
        except ValueError:
            allowed = f"an array of the shape of x, {given['x'].shape}"
            raise InvalidInputError("z", f"an array of the shape {given['z'].shape}", allowed) from None
        return places / unit + self.in_star.length / 2.0, heights / unit

    def _places(self, advance: Array, z: Array) -> Array:
        """Rows of x and z, m."""
        return self.strip.gravity_length * np.column_stack([advance - self.in_star.length / 2.0, z])

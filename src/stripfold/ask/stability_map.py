"""Result of :meth:`.Strip.map`: the stability map of the gripper's places, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from stripfold.ask.friction_boundary import HISTORY, MOST, FrictionBoundary, friction_boundary
from stripfold.ask.gripper_map import GripperMap, gripper_map
from stripfold.ask.inputs import StabilityMap as Asked
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.percent import Percent
from stripfold.elastica.boundary import LENGTHS
from stripfold.files import schema
from stripfold.files.reporting import Progress, Result, Rows, metres

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class StabilityMap(Result):
    """The gripper places that a frictionless strip follows from the flat state; x and z with the origin mid-strip, m.

    The model is the elastica: thickness and stretch do not count.  Source: docs/map.md.

    Attributes
    ----------
    in_star
        The same map in units of L*, over the advance in place of x.
    eigenvalues
        Shape (z, x): smallest eigenvalue at the places of the grid, g/L*; nan where the strip cannot hang.
    with_friction
        The ends of the advance with friction, in units of L*; None where no friction is given.
    strip, seconds
        The inputs, and the run time.
    """

    in_star: GripperMap
    eigenvalues: Array
    with_friction: FrictionBoundary | None
    strip: Asked
    seconds: float
    title = "stability map of the gripper's places"
    shown = ("strip", "touch_limit")

    @classmethod
    def of(cls, strip: Asked, progress: Progress | None = None) -> Self:
        """Compute it."""
        began = perf_counter()
        low, high = (limit * strip.gravity_length for limit in LENGTHS)
        if not low <= strip.length <= high:
            allowed = f"from {low:.3g} to {high:.3g} m with eta_b = {strip.eta_b:g} m^-4 s^2"
            raise InvalidInputError("length", strip.length, allowed, "a shorter strip cannot be folded in half")
        moment, most = strip.friction_moment, MOST * strip.material.scales["N"]
        if moment is not None and moment > most:
            allowed = f"at most {most:.3g} N with rho_a = {strip.rho_a:g} kg m^-2, {MOST:g} rho_a g L*^2"
            raise InvalidInputError(
                "friction_moment", moment, allowed, "give rho_a too: friction counts against weight"
            )
        say = progress or (lambda _: None)
        say("boundaries")
        found = gripper_map(strip.length_star)
        advance, heights = found.grid
        rows = []
        for z in Percent(say, "eigenvalues").each(heights, len(heights)):
            rows.append(found.eigenvalues(advance, float(z)))
        friction = None
        if moment is not None:
            friction = friction_boundary(strip.length_star, moment / strip.material.scales["N"], say)
        return cls(found, np.array(rows), friction, strip, perf_counter() - began)

    @property
    def touch_limit(self) -> float:
        """Gripper height below which the sag touches before the strip can snap, m."""
        return float(self.in_star.snap.z[0]) * self.strip.gravity_length

    @property
    def snap_boundary(self) -> Array:
        """Shape (n, 2): x and z on the boundary behind which a hanging strip snaps, upwards from the touch limit."""
        snap = self.in_star.snap
        return self._places(np.stack([snap.advance, snap.z], axis=1))

    def hangs(self, x: Any, z: Any) -> Any:
        """Whether the strip can hang there, that is stably and off the lower layer; arrays of one shape, m."""
        return self.in_star.hangs(*self._star(x, z))

    def lies(self, x: Any, z: Any) -> Any:
        """Whether the strip can have its sag on the lower layer there; arrays of one shape, m."""
        return self.in_star.lies(*self._star(x, z))

    def margin(self, x: Any, z: Any) -> Any:
        """Distance of places of the gripper to the snap boundary, m; nan where the strip cannot hang.

        Examples
        --------
        >>> import stripfold as sf
        >>> found = sf.Strip(length=0.5, eta_b=3780).map()
        >>> round(float(found.margin(0.0, 0.1)), 4)
        0.0404
        """
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
        unit = self.strip.gravity_length
        ends = [
            f"{what} {unit * z[0]:.4g} to {unit * z[-1]:.4g} m"
            for what, z in (
                ("the sag touches at heights of", found.z[~found.snaps]),
                ("snaps at", found.z[found.snaps]),
            )
            if len(z)
        ]
        return [("friction", "; ".join(ends)), ("  history", HISTORY)]

    def to_dict(self) -> dict[str, Any]:
        names = ("touch_limit", "seconds")
        numbers = {name: getattr(self, name) for name in names} | {"snap_boundary": self.snap_boundary.tolist()}
        if (found := self.with_friction) is None:
            return numbers
        places = self._places(np.stack([found.advance, found.z], axis=1)).tolist()
        friction = {"friction_boundary": places, "friction_snap": found.snaps.tolist()}
        return numbers | friction | {"friction_history": HISTORY}

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
        from stripfold.draw.stability_map import draw

        return draw(self.to_dataset())

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

    def _places(self, rows: Array) -> Array:
        return (rows - (self.in_star.length / 2.0, 0.0)) * self.strip.gravity_length

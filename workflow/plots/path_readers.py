"""Stored states on folding paths as figures need them, checked; lengths in m."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.interpolate import RegularGridInterpolator

from plots.readers import chosen, evenly, travel
from stripfold.base.arrays import Array
from stripfold.base.errors import InvalidInputError
from stripfold.base.progress import FALL
from stripfold.draw.collapse_curve import require, states_of
from tasks.assess_data import STATIC

_NAMES = ("pseudo_time", "x", "z", "arc")
_ALLOWED = "states of a strip on a folding path, static or in a fall"


@dataclass(frozen=True, eq=False)
class Part:
    """Consecutive states on a folding path, all static or all in a fall: shape (m, n, 2), x and z.

    ``arc``, shape (n,), is the distance along the strip from the grasped end.
    """

    phase: str
    pseudo_time: Array
    states: Array
    arc: Array

    def evenly(self, count: int) -> list[int]:
        """At most ``count`` indices, the first and the last among them, even in :func:`travel`."""
        return evenly(travel(self.states, self.arc), 0, len(self.states) - 1, count)

    def displacement(self) -> Array:
        """Root mean square displacement of the mid-surface from the flat strip, shape (m,), m."""
        flat = np.stack([self.arc - 0.5 * self.arc[-1], np.zeros_like(self.arc)], axis=1)
        return np.asarray(np.sqrt(self._mean(np.sum((self.states - flat) ** 2, axis=2))))

    def above(self, plan: Part) -> Array:
        """Mean height of the mid-surface over the states of ``plan`` at the same pseudo times, shape (m,), m."""
        planned = RegularGridInterpolator(
            (plan.pseudo_time, plan.arc), plan.states[..., 1], bounds_error=False, fill_value=None
        )
        return self._mean(self.states[..., 1] - planned(tuple(np.meshgrid(self.pseudo_time, self.arc, indexing="ij"))))

    def at(self, times: Array) -> Array:
        """States at pseudo times, shape (m,), linear between those that are known; shape (m, n, 2)."""
        known = RegularGridInterpolator((self.pseudo_time,), self.states, bounds_error=False, fill_value=None)
        return np.asarray(known(times))

    def _mean(self, values: Array) -> Array:
        return np.asarray(np.trapezoid(values, self.arc, axis=1) / self.arc[-1])


@dataclass(frozen=True, eq=False)
class PostCriticalBranch:
    """A fall from the unstable planned state and the static states after it; x of the touch, m, or nan."""

    fall: Part
    after: Part
    touch_x: float

    @property
    def touches(self) -> bool:
        """True where the strip comes down on the lower layer."""
        return bool(np.isfinite(self.touch_x))


def parts(data: xr.Dataset) -> list[Part]:
    """The parts, in order, of a dataset with the layout of :func:`tasks.assess_data.states`.

    Raises InvalidInputError: it holds something else, or no states.
    """
    require(data, ("phase", "part", *_NAMES), _ALLOWED)
    phase, number = data["phase"].values.astype(str), data["part"].values
    if not set(phase) <= {STATIC, FALL}:
        raise InvalidInputError("data", f"phases {', '.join(sorted(set(phase)))}", _ALLOWED)
    found = []
    for i in np.unique(number):
        own = number == i
        if len(kinds := sorted(set(phase[own]))) > 1:
            raise InvalidInputError("data", f"part {i:g} both static and in a fall", _ALLOWED)
        found.append(_part(data.isel(state=np.flatnonzero(own)), kinds[0]))
    return found


def post_critical(data: xr.Dataset) -> list[PostCriticalBranch]:
    """The post-critical branches of an R-path, the one that touches first; none without an unstable planned state.

    ``data`` is from :func:`tasks.post_critical.two_ways`.

    Raises InvalidInputError: it holds something else.
    """
    if data.attrs.get("reason"):
        return []
    require(data, ("way", "phase", "part", *_NAMES), _ALLOWED)
    found = []
    for i, touch in enumerate(np.atleast_1d(data.attrs["touch_x"])):
        own = parts(data.isel(state=np.flatnonzero(data["way"].values == i)))
        if [part.phase for part in own] != [FALL, STATIC]:
            raise InvalidInputError("data", f"branch {i} without one fall and one static part after it", _ALLOWED)
        found.append(PostCriticalBranch(own[0], own[1], float(touch)))
    return sorted(found, key=lambda branch: not branch.touches)


def planned(data: xr.Dataset, path: str) -> Part:
    """The states assumed on one of the paper's paths, from :func:`tasks.folding.plans`."""
    return _part(chosen(data, "path", path), STATIC)


def with_friction(data: xr.Dataset, law: str = "pull") -> tuple[Part, Array]:
    """States on a path with a law of friction, and the smallest eigenvalue without it, 1/s^2.

    ``data`` is from :func:`tasks.friction.run`.
    """
    require(data, ("eigenvalue",), _ALLOWED)
    one = chosen(data, "law", law)
    return _part(one, STATIC), np.asarray(one["eigenvalue"].values)


def _part(data: xr.Dataset, phase: str) -> Part:
    require(data, _NAMES, _ALLOWED)
    states, times = states_of(data), data["pseudo_time"].values
    if not len(states) or not np.isfinite(states).all() or not np.isfinite(times).all():
        raise InvalidInputError("data", "no states, or states that are not finite", _ALLOWED)
    return Part(phase, times, states, data["arc"].values)

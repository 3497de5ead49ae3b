"""A path followed, from its dataset: static parts and falls in turn; and what was planned for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stripfold.analysis.states import FALL, PHASES, STATIC
from stripfold.arrays import Array
from stripfold.errors import InvalidInputError
from stripfold.plots.phases import way_of

REQUIRED = ("phase", "part", "pseudo_time", "x", "z", "arc")


@dataclass(frozen=True, eq=False)
class Part:
    """Neighbouring states of one kind; SI units.

    Parameters
    ----------
    phase
        :data:`.STATIC` or :data:`.FALL`.
    pseudo_time
        Shape (m,).
    states
        Mid-surfaces, shape (m, n, 2): x and z from the grasped end, m.
    arc
        Shape (n,): distance along the strip from there, m.
    """

    phase: str
    pseudo_time: Array
    states: Array
    arc: Array

    def evenly(self, count: int) -> list[int]:
        """At most ``count`` indices, the first and the last among them, even in how far the strip moved."""
        way = way_of(self.states, self.arc)
        wanted = np.linspace(0.0, way[-1], count)
        return sorted({int(np.abs(way - w).argmin()) for w in wanted})

    def displacement(self) -> Array:
        """Root mean square displacement of the mid-surface from the flat strip, shape (m,), m."""
        flat = np.stack([self.arc - 0.5 * self.arc[-1], np.zeros_like(self.arc)], axis=1)
        squares = np.sum((self.states - flat) ** 2, axis=2)
        return np.asarray(np.sqrt(np.trapezoid(squares, self.arc, axis=1) / self.arc[-1]))

    def above(self, plan: Part) -> Array:
        """Mean height of the mid-surface over the states of ``plan`` at the same pseudo times, shape (m,), m."""
        higher = (self.states - plan.at(self.pseudo_time, self.arc))[..., 1]
        return np.asarray(np.trapezoid(higher, self.arc, axis=1) / self.arc[-1])

    def at(self, times: Array, arc: Array) -> Array:
        """States, shape (k, n, 2), at pseudo times, shape (k,), and distances, shape (n,); linear in between."""
        nodes = np.stack([[np.interp(arc, self.arc, row) for row in self.states[..., i]] for i in range(2)], axis=2)
        after = np.clip(np.searchsorted(self.pseudo_time, times), 1, len(self.pseudo_time) - 1)
        begin, end = self.pseudo_time[after - 1], self.pseudo_time[after]
        share = ((times - begin) / (end - begin))[:, None, None]
        return np.asarray((1.0 - share) * nodes[after - 1] + share * nodes[after])


def parts(data: xr.Dataset) -> list[Part]:
    """The parts of a motion, in order.

    Parameters
    ----------
    data
        With the layout of :func:`stripfold.analysis.states.dataset`.

    Raises
    ------
    InvalidInputError
        It holds something else, or no states.
    """
    _check(data, REQUIRED)
    phase, number = data["phase"].values.astype(str), data["part"].values
    if not set(phase) <= set(PHASES):
        raise _refused(f"phases {', '.join(sorted(set(phase)))}")
    found = []
    for i in np.unique(number):
        chosen = data.isel(state=np.flatnonzero(number == i))
        kinds = set(chosen["phase"].values.astype(str))
        if len(kinds) > 1:
            raise _refused(f"part {i:g} both {STATIC} and in a {FALL}")
        found.append(_part(chosen, kinds.pop()))
    return found


@dataclass(frozen=True, eq=False)
class Way:
    """One way out of the planned state: the fall, the static states after it, and x of the touch, m, or nan."""

    fall: Part
    after: Part
    touch_x: float

    @property
    def touches(self) -> bool:
        """Whether the strip comes down on the lower layer."""
        return bool(np.isfinite(self.touch_x))


def ways_out(data: xr.Dataset) -> list[Way]:
    """The ways out of an R-path, those that touch first; none where there is no unstable planned state.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.friction_data.two_ways`.

    Raises
    ------
    InvalidInputError
        It holds something else.
    """
    if data.attrs.get("reason"):
        return []
    _check(data, (*REQUIRED, "way"))
    found = []
    for i, touch in enumerate(np.atleast_1d(data.attrs["touch_x"])):
        own = parts(data.isel(state=np.flatnonzero(data["way"].values == i)))
        if [part.phase for part in own] != [FALL, STATIC]:
            raise _refused(f"way {i} without one fall and one static part after it")
        found.append(Way(own[0], own[1], float(touch)))
    return sorted(found, key=lambda way: not way.touches)


def planned(data: xr.Dataset, path: str) -> Part:
    """The states assumed on one of the paper's paths.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.plans.dataset`.
    path
        Name of the path.

    Raises
    ------
    InvalidInputError
        It holds something else.
    """
    _check(data, ("path", "pseudo_time", "x", "z", "arc"))
    if path not in data["path"].values:
        raise _refused(f"no path {path}")
    return _part(data.sel(path=path), STATIC)


def held(data: xr.Dataset, law: str = "pull") -> tuple[Part, Array]:
    """The states of a path followed with friction, and the smallest eigenvalue without it, 1/s^2.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.friction_data.run`.
    law
        Of friction.

    Raises
    ------
    InvalidInputError
        It holds something else.
    """
    _check(data, ("law", "eigenvalue", "pseudo_time", "x", "z", "arc"))
    if law not in data["law"].values:
        raise _refused(f"no law {law}")
    chosen = data.sel(law=law)
    return _part(chosen, STATIC), np.asarray(chosen["eigenvalue"].values)


def _part(data: xr.Dataset, phase: str) -> Part:
    states = np.stack([data["x"].values, data["z"].values], axis=2)
    if not len(states) or not np.isfinite(states).all() or not np.isfinite(data["pseudo_time"].values).all():
        raise _refused("no states, or states that are not finite")
    return Part(phase, data["pseudo_time"].values, states, data["arc"].values)


def _check(data: xr.Dataset, names: Iterable[str]) -> None:
    missing = [name for name in names if name not in data.variables]
    if missing:
        raise _refused(f"a dataset without {', '.join(missing)}")


def _refused(found: str) -> InvalidInputError:
    return InvalidInputError("data", found, "states of a strip on a folding path, static or in a fall")

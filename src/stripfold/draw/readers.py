"""A stored collapse as figures and films need it, checked; lengths in m."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stripfold.base.arrays import Array, Index
from stripfold.base.errors import InvalidInputError
from stripfold.base.phases import FALL, PHASES

_SCALARS = ("gripper_height", "lambda_0", "lambda_c", "touch_time", "touch_x", "settle_time")
_LAYOUT: dict[str, tuple[str, ...]] = {
    "phase": ("state",),
    **dict.fromkeys(("time", "advance", "deflection"), ("state",)),
    **dict.fromkeys(("x", "z"), ("state", "node")),
    **dict.fromkeys(_SCALARS, ()),
}


@dataclass(frozen=True, eq=False)
class Followed:
    """A strip followed, state by state: m states of shape (n, 2), x and z.

    ``advance`` is the way of the gripper.  Times count from the start of a fall; they are nan in statics.
    """

    phase: NDArray[np.str_]
    time: Array
    advance: Array
    states: Array

    def part(self, phase: str) -> Index:
        """Indices of the states of a phase."""
        return np.flatnonzero(self.phase == phase)

    @property
    def critical(self) -> int:
        """Index of the last state before the first fall; the last of all without one."""
        fall = self.part(FALL)
        return int(fall[0] if len(fall) else len(self.phase)) - 1


@dataclass(frozen=True, eq=False)
class Collapse(Followed):
    """Statics before lambda_c, the fall and statics after it at one gripper height.

    Times are nan where nothing touches or comes to rest.
    """

    gripper_height: float
    lambda_0: float
    lambda_c: float
    touch_time: float
    settle_time: float
    touch_x: float
    deflection: Array

    @property
    def touch(self) -> int:
        """Index of the first state that touches; the last of the fall where none does."""
        fall = self.part(FALL)
        return int(fall[-1] if np.isnan(self.touch_time) else fall[np.abs(self.time[fall] - self.touch_time).argmin()])


def collapse(data: xr.Dataset) -> Collapse:
    """The collapse that a dataset from :func:`stripfold.ask.collapse.run` holds.

    Raises InvalidInputError: it holds something else.
    """
    allowed = f"one collapse: finite states of the phases {', '.join(PHASES)} in this order, the last may be missing"
    advice = "use a result of `stripfold simulate`"
    require(data, (*_LAYOUT, "arc"), allowed, advice)
    for name, dims in _LAYOUT.items():
        kind = data[name].dtype.kind
        if data[name].dims != dims or (kind not in "fiu" and name != "phase"):
            found = f"{name} over {', '.join(map(str, data[name].dims)) or 'nothing'}, of kind {kind}"
            raise InvalidInputError("data", found, allowed, advice)
    phase, time, states = data["phase"].values.astype(str), data["time"].values, states_of(data)
    runs = [str(phase[i]) for i in range(len(phase)) if i == 0 or phase[i] != phase[i - 1]]
    if runs not in (list(PHASES), list(PHASES[:2])):
        raise InvalidInputError("data", f"phases {', '.join(runs) or 'none'}", allowed, advice)
    for name, fine in {
        "x or z": np.isfinite(states).all(),
        "advance or deflection": np.isfinite(data[["advance", "deflection"]].to_array()).all(),
        "times of the fall": np.all(np.diff(time[phase == FALL], prepend=0.0) >= 0.0),
    }.items():
        if not fine:
            raise InvalidInputError("data", f"unusable {name}", allowed, advice)
    return Collapse(
        **{name: float(data[name]) for name in _SCALARS},
        phase=phase,
        time=time,
        advance=data["advance"].values,
        deflection=data["deflection"].values,
        states=states,
    )


def states_of(data: xr.Dataset) -> Array:
    """Mid-surfaces, shape (m, n, 2): x and z, m."""
    return np.stack([data["x"].values, data["z"].values], axis=2)


def require(data: xr.Dataset, names: Iterable[str], allowed: str, advice: str = "") -> None:
    """Raise where the dataset lacks one of the variables ``names``."""
    if missing := [name for name in names if name not in data.variables]:
        raise InvalidInputError("data", f"a dataset without {', '.join(missing)}", allowed, advice)

"""A collapse from its dataset: statics before lambda_c, the fall, statics after it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stripfold.analysis.phases import BEFORE, FALL, PHASES
from stripfold.arrays import Array, Index
from stripfold.errors import InvalidInputError

REQUIRED = ("phase", "time", "lambda", "deflection", "x", "z", "arc")
REQUIRED_ATTRS = ("height", "lambda_0", "lambda_c", "touch_time", "touch_x", "settle_time")


@dataclass(frozen=True, eq=False)
class Collapse:
    """One strip at one gripper height; SI units.

    Parameters
    ----------
    height
        Of the gripper, m.
    lambda_0, lambda_c
        Advance of the gripper at the first state and at the critical point, m.
    touch_time, settle_time
        Since the start of the fall, s; nan where there is none.
    touch_x
        Where the falling part touches, m; nan where it does not.
    phase
        Shape (m,): one of :data:`.PHASES`; the last may be missing.
    time
        Shape (m,): since the start of the fall, s; nan in statics.
    advance, deflection
        Shape (m,), m.
    states
        Mid-surfaces, shape (m, n, 2): x and z from the grasped end, m.
    way
        Shape (m,): how far the mid-surface has moved since the first state, m, as the sum of the root mean square
        displacements from state to state.
    """

    height: float
    lambda_0: float
    lambda_c: float
    touch_time: float
    settle_time: float
    touch_x: float
    phase: NDArray[np.str_]
    time: Array
    advance: Array
    deflection: Array
    states: Array
    way: Array

    def part(self, phase: str) -> Index:
        """Indices of the states of a phase."""
        return np.flatnonzero(self.phase == phase)

    @property
    def critical(self) -> int:
        """Index of the state at lambda_c: the last before the fall."""
        return int(self.part(BEFORE)[-1])

    @property
    def touch(self) -> int:
        """Index of the first state that touches; the last of the fall where none does."""
        fall = self.part(FALL)
        if np.isnan(self.touch_time):
            return int(fall[-1])
        return int(fall[np.abs(self.time[fall] - self.touch_time).argmin()])

    def evenly(self, first: int, last: int, count: int) -> list[int]:
        """At most ``count`` indices from ``first`` to ``last``, both included, even in how far the strip moved."""
        indices = np.arange(first, last + 1)
        wanted = np.linspace(self.way[first], self.way[last], count)
        return sorted({int(indices[np.abs(self.way[indices] - w).argmin()]) for w in wanted})


def collapse(data: xr.Dataset) -> Collapse:
    """The collapse that a dataset holds.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.collapse_data.run`.

    Raises
    ------
    InvalidInputError
        It holds something else.
    """
    missing = [name for name in REQUIRED if name not in data.variables]
    missing += [name for name in REQUIRED_ATTRS if name not in data.attrs]
    if missing:
        raise _refused(f"a dataset without {', '.join(missing)}")
    phase = data["phase"].values.astype(str)
    runs = [str(phase[0]), *(str(b) for a, b in pairwise(phase) if a != b)] if len(phase) else []
    if runs not in (list(PHASES), list(PHASES[:2])):
        raise _refused(f"phases {', '.join(runs) or 'none'}")
    states = np.stack([data["x"].values, data["z"].values], axis=2)
    time = data["time"].values
    for name, bad in (
        ("x or z", not np.isfinite(states).all()),
        ("lambda or deflection", not np.isfinite(data[["lambda", "deflection"]].to_array()).all()),
        ("times of the fall", not np.all(np.diff(time[phase == FALL], prepend=0.0) >= 0.0)),
    ):
        if bad:
            raise _refused(f"unusable {name}")
    numbers = {name: float(data.attrs[name]) for name in REQUIRED_ATTRS}
    return Collapse(
        **numbers,
        phase=phase,
        time=time,
        advance=data["lambda"].values,
        deflection=data["deflection"].values,
        states=states,
        way=way_of(states, data["arc"].values),
    )


def way_of(states: Array, arc: Array) -> Array:
    """How far a strip has moved since the first state: the sum of the rms displacements from state to state, m."""
    squares = np.sum(np.diff(states, axis=0) ** 2, axis=2)
    steps = np.sqrt(np.trapezoid(squares, arc, axis=1) / (arc[-1] - arc[0]))
    return np.concatenate([[0.0], np.cumsum(steps)])


def _refused(found: str) -> InvalidInputError:
    allowed = f"one collapse: finite states of the phases {', '.join(PHASES)} in this order, the last may be missing"
    return InvalidInputError("data", found, allowed, "give what `stripfold simulate` wrote")

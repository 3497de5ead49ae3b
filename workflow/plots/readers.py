"""Stored datasets as figures need them, checked and without padding; lengths in m."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from plots.pieces import Look, look
from stripfold.base.arrays import Array, Mask
from stripfold.base.errors import InvalidInputError
from stripfold.draw.collapse_curve import require, states_of


@dataclass(frozen=True, eq=False)
class Branch:
    """The m equilibria at one gripper height, from lambda_0 on; ``states`` are arrays of shape (n, 2), x and z."""

    height: float
    lambda_0: float
    lambda_c: float
    advance: Array
    deflection: Array
    stable: Mask
    states: tuple[Array, ...]

    @property
    def critical(self) -> int:
        """Index of the stored state nearest the critical point, on its stable side."""
        return int(np.argmax(np.where(self.stable, self.advance, -np.inf)))


def branch(data: xr.Dataset, height: float) -> Branch:
    """The branch of the snap height nearest ``height``, L*, from :func:`tasks.x_axis.run`.

    Raises InvalidInputError: the strip snaps at none of the heights.
    """
    heights = np.where(data["snap"].values > 0, data["gripper_height"].values, np.nan)
    if np.all(np.isnan(heights)):
        raise InvalidInputError("data", "no height with a snap", "one with a height at which the strip snaps")
    one = data.isel(gripper_height=int(np.nanargmin(np.abs(heights - height * data.attrs["gravity_length"]))))
    one = one.isel(step=np.flatnonzero(np.isfinite(one["advance"].values)))
    return Branch(
        height=float(one["gripper_height"]),
        lambda_0=float(one["lambda_0"]),
        lambda_c=float(one["lambda_c"]),
        advance=one["advance"].values,
        deflection=one["deflection"].values,
        stable=one["negatives"].values == 0,
        states=tuple(state[np.isfinite(state[:, 0])] for state in states_of(one)),
    )


def materials(data: xr.Dataset) -> list[tuple[str, Look]]:
    """Name and look of each material, in the dataset's order."""
    return [(str(name), look(i)) for i, name in enumerate(data["material"].values)]


def critical_points(data: xr.Dataset, material: str) -> xr.Dataset:
    """The heights of one material, ascending, of a dataset over ``material`` and ``height_index``, without padding.

    Its ``end`` is lambda_c where ``snap`` is true, elsewhere lambda where the advance ended.

    Raises InvalidInputError: no such material.
    """
    one = chosen(data, "material", material).dropna("height_index", subset=["gripper_height"]).sortby("gripper_height")
    snap = one["snap"] > 0
    return one.assign(snap=snap, end=one["lambda_c"].where(snap, one["lambda_end"]))


def recordings(data: xr.Dataset) -> Iterator[tuple[float, Look, xr.Dataset]]:
    """eta_b, look and recordings, by height, of each material of a dataset over ``recording``."""
    for i, eta in enumerate(np.unique(data["eta_b"].values)):
        yield (
            float(eta),
            look(i),
            data.isel(recording=np.flatnonzero(data["eta_b"].values == eta)).sortby("gripper_height"),
        )


def travel(states: Array, arc: Array) -> Array:
    """Sum of the rms displacements of the mid-surface from state to state, shape (m,), m."""
    squares = np.sum(np.diff(states, axis=0) ** 2, axis=2)
    steps = np.sqrt(np.trapezoid(squares, arc, axis=1) / (arc[-1] - arc[0]))
    return np.concatenate([[0.0], np.cumsum(steps)])


def evenly(values: Array, first: int, last: int, count: int) -> list[int]:
    """At most ``count`` indices from ``first`` to ``last``, both included, even in ``values``."""
    wanted = np.linspace(values[first], values[last], count)
    nearest = np.abs(values[first : last + 1, None] - wanted).argmin(axis=0)
    return sorted({first + int(i) for i in nearest})


def chosen(data: xr.Dataset, kind: str, name: str) -> xr.Dataset:
    """The entry ``name`` of the dimension ``kind``."""
    require(data, (kind,), f"a dataset over {kind}")
    names = [str(one) for one in data[kind].values]
    if name not in names:
        raise InvalidInputError(kind, name, f"one of {', '.join(names)}")
    return data.sel({kind: name})

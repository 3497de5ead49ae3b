"""One branch out of a dataset of :mod:`stripfold.analysis.x_axis`, without its padding."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stripfold.arrays import Array
from stripfold.errors import InvalidInputError

DEFAULT_HEIGHT = 5.0
"""Gripper height drawn where none is asked for, L*."""


@dataclass(frozen=True, eq=False)
class Branch:
    """The equilibria at one gripper height, from lambda_0 on; SI units.

    Parameters
    ----------
    height
        Gripper height, m.
    lambda_0, lambda_c
        Advance of the gripper at the first state and at the critical point, m.
    advance, deflection
        Shape (m,), m.
    stable
        Shape (m,).
    states
        Mid-surfaces, m arrays of shape (n, 2) of x and z, from the grasped end.
    """

    height: float
    lambda_0: float
    lambda_c: float
    advance: Array
    deflection: Array
    stable: NDArray[np.bool_]
    states: tuple[Array, ...]

    @property
    def critical(self) -> int:
        """Index of the stored state nearest the critical point, on its stable side."""
        return int(np.argmax(np.where(self.stable, self.advance, -np.inf)))

    def runs(self) -> list[tuple[slice, bool]]:
        """The branch cut where its stability changes: slice of points, stable or not.

        An unstable run includes the stable points beside it, so that the curve has no gap.
        """
        changes = np.flatnonzero(np.diff(self.stable)) + 1
        cuts = [0, *(int(i) for i in changes), len(self.stable)]
        out = []
        for a, b in pairwise(cuts):
            stable = bool(self.stable[a])
            out.append((slice(a, b) if stable else slice(max(a - 1, 0), b + 1), stable))
        return out

    def evenly(self, first: int, last: int, count: int) -> list[int]:
        """At most ``count`` indices between ``first`` and ``last``, both excluded, even in deflection."""
        wanted = np.linspace(self.deflection[first], self.deflection[last], count + 2)[1:-1]
        inner = np.arange(first + 1, last)
        if not len(inner):
            return []
        nearest = np.abs(self.deflection[inner][:, None] - wanted).argmin(axis=0)
        return sorted({int(inner[i]) for i in nearest})


def branch(data: xr.Dataset, height: float | None = None) -> Branch:
    """The branch of the snap height nearest ``height``.

    Parameters
    ----------
    data
        From :func:`stripfold.analysis.x_axis.run`.
    height
        Gripper height, m; by default 5 L*.

    Raises
    ------
    InvalidInputError
        The strip snaps at none of the heights.
    """
    wanted = DEFAULT_HEIGHT * data.attrs["gravity_length"] if height is None else height
    heights = np.where(data["snap"].values > 0, data["height"].values, np.nan)
    if np.all(np.isnan(heights)):
        raise InvalidInputError("data", "no height with a snap", "one with a height at which the strip snaps")
    one = data.isel(height=int(np.nanargmin(np.abs(heights - wanted))))
    steps = np.flatnonzero(np.isfinite(one["lambda"].values))
    one = one.isel(step=steps)
    x, z = one["x"].values, one["z"].values
    return Branch(
        height=float(one["height"]),
        lambda_0=float(one["lambda_0"]),
        lambda_c=float(one["lambda_c"]),
        advance=one["lambda"].values,
        deflection=one["deflection"].values,
        stable=one["negatives"].values == 0,
        states=tuple(np.stack([a, b], axis=1)[np.isfinite(a)] for a, b in zip(x, z, strict=True)),
    )

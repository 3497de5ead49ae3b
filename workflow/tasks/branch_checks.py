"""Invariants of a stored branch, checked before it is stored."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stripfold.base.errors import StripfoldError

if TYPE_CHECKING:
    import xarray as xr

GAP = 1e-9
"""Largest penetration of the floor, L*."""
FORCE = 1e-4
"""Largest unbalanced force, rho_a g L*; the rounding of a thin strip's unknowns sets it (docs/method.md)."""


def check_branch(run: xr.Dataset) -> None:
    """Refuse a dataset of :func:`tasks.x_axis.run` that breaks what every branch must obey.

    Raises StripfoldError: with the list of what is broken, and at which heights.
    """
    unit = run.attrs["gravity_length"]
    force = run.attrs["rho_a"] * run.attrs["gravity"] * unit
    snap = run["snap"].values > 0
    lam, negatives = run["advance"].values, run["negatives"].values
    exists = np.isfinite(lam)
    before = exists & (np.cumsum(negatives > 0, axis=1) == 0)
    steps = np.where(before[:, 1:], np.diff(lam, axis=1), np.nan)
    lower, found, upper = (run[f"lambda_c{end}"].values for end in ("_lower", "", "_upper"))
    broken = {
        "a value is missing": np.any(exists & ~np.isfinite(run["residual"].values), axis=1),
        "the floor is penetrated": np.any(run["minimal_gap"].values < -GAP * unit, axis=1),
        "a state is not in equilibrium": np.any(run["residual"].values > FORCE * force, axis=1),
        "the branch starts unstable": negatives[:, 0] > 0,
        "there is no unstable point past a snap": snap & ~np.any(negatives > 0, axis=1),
        "lambda_c has no bracket around it": snap
        & ~((lower <= found) & (found <= upper) & (upper - lower <= 2e-6 * unit)),
        "lambda exceeds lambda_c by more than its error": snap
        & (np.nanmax(lam, axis=1) > (run["lambda_end"] + run["lambda_error"]).values),
        "lambda falls by more than a contact step before the end": np.any(steps < -0.05 * unit, axis=1),
        "lambda_c is given without a snap": ~snap & np.isfinite(run["lambda_c"].values),
    }
    failures = [
        f"{what} at z/L* = {', '.join(f'{z:g}' for z in run['gripper_height'].values[where] / unit)}"
        for what, where in broken.items()
        if np.any(where)
    ]
    if failures:
        raise StripfoldError("the branches break what they must obey: " + "; ".join(failures))

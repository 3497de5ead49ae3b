"""The numbers quoted about effects on demand."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stripfold.effects import demand
from studies.summary.entry import Entry, entry

LARGEST_COST = 0.05
"""Allowed relative cost of an effect that is on and not needed."""


def summarise(data: Mapping[str, xr.Dataset], sources: Mapping[str, str]) -> dict[str, Entry]:
    """Entries of ``effects``, read from the file ``sources`` names."""
    effects, source = data["effects"], sources["effects"]
    needed = effects["needed"].values == 1.0
    idle = effects["needed"].values == 0.0
    # An effect's own clock knows better than a difference of two runs, which is mostly the machine's mood.
    clocked = effects["clocked"].values
    cost = np.where(idle, np.where(np.isfinite(clocked), clocked, effects["cost"].values), np.nan)
    matters = int(np.sum(idle & (effects["matters"].values != 0.0)))
    by_effect = ", ".join(
        f"{name} {np.nanmax(values):+.1%}"
        for name, values in zip(effects["effect"].values, cost.T, strict=True)
        if np.isfinite(values).any()
    )
    largest = float(np.nanmax(cost))
    lacking = needed & (effects["matters"].values == 1.0)
    unseen = int(np.sum(lacking & (effects["reported"].values != 1.0)))
    failed = int(np.sum(~(needed | idle)))
    return {
        "effects_overhead": entry(
            largest,
            "1",
            f"largest relative cost of an effect that is on and not needed, {effects.sizes['scene']} scenes "
            f"({by_effect}; the {demand.SOLID} is a model of its own beside the rod); {matters} of {int(idle.sum())} "
            "change the result beyond its tolerance",
            f"< {LARGEST_COST:g}, none changes the result",
            largest < LARGEST_COST and matters == 0,
            source,
            2,
        ),
        "effects_undetected": entry(
            unseen,
            "count",
            f"effects that are off, matter to the result, and are not reported as lacking, of {int(lacking.sum())}; "
            f"{failed} comparisons failed",
            "0, none failed",
            unseen == 0 and failed == 0 and bool(lacking.any()),
            source,
        ),
    }

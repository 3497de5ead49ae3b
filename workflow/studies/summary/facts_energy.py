"""Facts about the energy barrier."""

from __future__ import annotations

import numpy as np
import xarray as xr

from studies.summary.facts import Facts

SHOWN = 3.0
"""Height whose numbers are quoted, L*."""


def barrier(d: xr.Dataset) -> Facts:
    """The law near the fold, its coefficient by several ways, and the end of the bistable range."""
    one = d.sel(height=SHOWN)
    least = d.distance.values.argmin()
    law = d.coefficient * d.distance**1.5
    models = d.model_coefficient.sel(height=SHOWN) / one.coefficient - 1.0
    return {
        "z": SHOWN,
        "measured": one.barrier[least] / one.distance[least] ** 1.5,
        "normal": one.coefficient,
        "apart": np.abs(one.barrier / law.sel(height=SHOWN) - 1.0)[least],
        "curved": np.abs(d.barrier / law - 1.0).max(),
        "work": np.abs(d.work / d.barrier - 1.0).max(),
        "rod": models.sel(model="rod"),
        "solid": models.sel(model="solid"),
        "models": np.abs(models).max(),
        "lowest": d.coefficient.min(),
        "highest": d.coefficient.max(),
        "width": one.width,
        "largest": one.largest,
        "speed": one.speed,
        "first_width": d.width[0],
        "last_width": d.width[-1],
        "first_z": d.height[0],
        "last_z": d.height[-1],
    }

"""Facts about low paths."""

from __future__ import annotations

import numpy as np
import xarray as xr

from studies import low_paths as study
from studies.summary.facts import Facts, seed_of, share

LOWEST = 0.7
"""Heights below which the largest push is compared with that of the elastica, L*: its law there is 2.75 / z^2."""


def low_paths(d: xr.Dataset) -> Facts:
    outcomes = np.stack([d[mesh].values for mesh in study.MESHES])
    inside, compared = study.inside(d), outcomes[1] != study.OMITTED
    limited, both = outcomes == study.LIMITED, inside & compared
    above = d.height.values > float(d.curve_height.max())
    below = ~inside & (d.height.values < float(d.curve_height[d.curve_compliance.values.argmax()]))
    low = inside & (d.height.values < LOWEST)
    push = (d.hold * d.height**2).values[low]
    kinetic = float(d.time_kinetic.max(skipna=False) / d.snap_energy)
    return {
        "cases": d.sizes["case"],
        "seed": seed_of(d),
        "compared": compared.sum(),
        "failed": np.sum(outcomes == study.FAILED),
        "inside": inside.sum(),
        "stable": share(outcomes[0][inside] == study.STABLE),
        "margin": study.MARGIN,
        "above": above.sum(),
        "snapped": (limited[0] & above).sum(),
        "below": below.sum(),
        "squeezed": (limited[0] & below).sum(),
        "compared_inside": both.sum(),
        "agree": np.all(outcomes[:, both] == study.STABLE, axis=0).sum(),
        "limited": limited[:, both].sum(),
        "push": push.max() if push.size else np.nan,
        "law": (d.curve_push * d.curve_height**2).values[d.curve_height.values < LOWEST].max(),
        "lowest": LOWEST,
        "slide": (d.slide / d.length).max(),
        "kinetic": kinetic,
        "least_kinetic": float(d.time_kinetic.min() / d.snap_energy),
        "exponent": float(np.log2(d.time_kinetic[0, -1] / d.slow_kinetic)),
        "speed": d.attrs["speed"],
        "mu": d.mu.max(),
        "moment": d.attrs["moment"],
        "length": d.attrs["length_star"],
        "error": d.time_error.max(skipna=False),
        "grip": d.time_grip.max(),
        "grip_without": d.time_grip.sel(mu=0.0).max(),
    }

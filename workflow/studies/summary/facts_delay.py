"""Facts about motions with friction; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stripfold import elastica
from studies.motion_with_friction import SNAP
from studies.summary.facts import Facts


def friction_delay(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """At the height of the checks, with the fabrics' median M_0."""
    first, real = d.isel(height=0), fabrics.friction
    median = float(real.median())
    rises = [_interpolated(first, float(m)) for m in (median, real.min(), real.max())]
    checks = d.checked_rise.values
    error = np.abs(checks / checks[0] - 1.0)
    law = d.small_rise / (d.coefficient * d.moment[1])
    unit = d.fold_height[-1] / elastica.folded_loop().height
    with_friction = d.sel(moment=d.moment >= float(real.min()))
    return {
        "height": d.height[0],
        "median": median,
        "rise": rises[0],
        "least": rises[1],
        "most": rises[2],
        "error": np.nanmax(error) * rises[0],
        "half_kappa_y": error[list(d.check.values).index("half kappa_y")],
        "law": np.nanmax(np.abs(law.values - 1.0)),
        "coefficients": ", ".join(
            f"{float(c):.2f} at {float(z):g}" for z, c in zip(d.height, d.coefficient, strict=True)
        ),
        "smallest": d.moment[1],
        "no_snap": d.vanishes_below.max(),
        "no_snap_each": ", ".join(
            f"{float(m):.2g} at {float(z):g}" for z, m in zip(d.height, d.vanishes_below, strict=True)
        ),
        "real_least": real.min(),
        "snapping": int((with_friction.outcome == SNAP).sum()),
        "speed": with_friction.sag_speed.max(),
        "fold": unit - 1.0,
        "folded": d.folded[-1],
    }


def _interpolated(one: xr.Dataset, moment: float) -> float:
    """The rise at M_0, from rise over M_0 linearly in the logarithm of M_0."""
    m, rise = one.moment.values[1:], one.rise.values[1:]
    return float(np.interp(np.log(moment), np.log(m), rise / m)) * moment

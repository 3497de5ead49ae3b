"""Facts about motions with friction; see :mod:`.facts`."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stripfold import elastica
from studies.motion_with_friction import SNAP
from studies.summary.facts import Facts

LEAST_OF_FABRICS = 0.2
"""M_0 / rho_a g L*^2 from which on a strip counts as a fabric here: data/fabrics.csv begins at 0.22."""


def friction_delay(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """At the height of the checks, with the fabrics' median M_0."""
    first, real = d.sel(gripper_height=d.attrs["checked_height"]), fabrics.friction
    median = float(real.median())
    rises = [_interpolated(first, float(m)) for m in (median, real.min(), real.max())]
    checks = d.checked_rise.values
    error = np.abs(checks / checks[0] - 1.0)
    law = d.small_rise / (d.coefficient * d.moment[1])
    unit = d.fold_height[-1] / elastica.folded_loop().height
    with_friction = d.sel(moment=d.moment >= float(real.min()))
    return {
        "height": d.attrs["checked_height"],
        "median": median,
        "rise": rises[0],
        "least": rises[1],
        "most": rises[2],
        "error": np.nanmax(error) * rises[0],
        "half_kappa_y": error[list(d.check.values).index("half kappa_y")],
        "law": np.nanmax(np.abs(law.values - 1.0)),
        "coefficients": ", ".join(
            f"{float(c):.2f} at {float(z):g}" for z, c in zip(d.gripper_height, d.coefficient, strict=True)
        ),
        "smallest": d.moment[1],
        "no_snap": d.vanishes_below.max(),
        "no_snap_each": ", ".join(
            f"{float(m):.2g} at {float(z):g}" for z, m in zip(d.gripper_height, d.vanishes_below, strict=True)
        ),
        "real_least": real.min(),
        "snapping": int((with_friction.outcome == SNAP).sum()),
        "speed": with_friction.sag_speed.max(),
        "speeds": ", ".join(
            f"{float(v):.1f} at M_0 = {float(m):g}"
            for m, v in zip(first.moment, first.sag_speed, strict=True)
            if np.isfinite(v)
        ),
        "fold": unit - 1.0,
        "folded": d.folded[-1],
    }


def _interpolated(one: xr.Dataset, moment: float) -> float:
    """The rise at M_0, from rise over M_0 linearly in the logarithm of M_0."""
    m, rise = one.moment.values[1:], one.rise.values[1:]
    return float(np.interp(np.log(moment), np.log(m), rise / m)) * moment


def friction_touch(d: xr.Dataset) -> list[Facts]:
    """First touch less the planned one with the friction of fabrics; one for each path."""
    out = []
    for path in d.path.values:
        one = d.sel(path=path)
        error = one.touch_x - d.planned_x
        real = error.sel(moment=d.moment >= LEAST_OF_FABRICS)
        band = 0.5 * (one.touch_stiffer - one.touch_softer)
        finer = np.abs(one.touch_x.sel(length=float(d.checked_length)) - one.checked_x)
        out.append(
            {
                "path": str(path),
                "least": error.min(),
                "most": error.max(),
                "without": ", ".join(f"{float(x):+.2f}" for x in error.sel(moment=0.0)),
                "change": np.abs(real - error.sel(moment=0.0)).max(),
                "band": band.max(),
                "error": finer.max(),
                "lengths": ", ".join(f"{length:g}" for length in d.length.values),
                "fell": int((one.fell.sel(moment=d.moment >= LEAST_OF_FABRICS) == 1.0).sum()),
            }
        )
    return out


def right_on_triangular(d: xr.Dataset) -> Facts:
    """The friction with which the triangular path first touches where planned."""
    error = d.touch_x.sel(path="triangular") - d.planned_x
    right = {float(length): _right(error.sel(length=length)) for length in d.length.values}
    found = {length: m for length, m in right.items() if np.isfinite(m)}
    return {
        "right": min(found.values(), default=np.nan),
        "each": ", ".join(f"{m:.2f} at {length:g}" for length, m in found.items()) or "none",
        "none": ", ".join(f"{length:g}" for length in right if length not in found) or "no length",
        "largest": d.moment.max(),
    }


def _right(error: xr.DataArray) -> float:
    """The smallest M_0 with which the touch is where planned, linearly in M_0; nan without one."""
    m, e = error.moment.values, error.values
    for i in np.flatnonzero((e[:-1] < 0.0) & (e[1:] >= 0.0)):
        return float(m[i] - e[i] * (m[i + 1] - m[i]) / (e[i + 1] - e[i]))
    return float("nan")


def disturbed_rpath(d: xr.Dataset) -> Facts:
    """The largest error of the first touch for each M_0, the last being that of fabrics."""
    largest = np.abs(d.touch_error).max("disturbance")
    return {
        "fabric": largest[-1],
        "moment": d.moment[-1],
        "free": largest[0],
        "others": ", ".join(f"{float(e):.2f} with {float(e.moment):g}" for e in largest[1:-1]),
        "disturbances": ", ".join(str(name) for name in d.disturbance.values if name != "none"),
    }

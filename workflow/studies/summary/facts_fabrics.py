"""Facts about real fabrics and the measured textile; see :mod:`.facts`."""

from __future__ import annotations

import xarray as xr

from studies.summary.facts import Facts


def fabrics(d: xr.Dataset, friction: xr.Dataset) -> Facts:
    """What fabrics have, over what the R-paths of ``friction`` need at most."""
    needed = friction.suffices.sel(law="hysteresis").max()
    lengths = 100.0 * d.gravity_length  # cm
    return {
        "count": d.sizes["fabric"],
        "shortest": lengths.min(),
        "length": lengths.median(),
        "longest": lengths.max(),
        "bent": d.sizes["bent"],
        "median": d.friction.median(),
        "least": d.friction.min(),
        "most": d.friction.max(),
        "needed": needed,
        "margin": d.friction.median() / needed,
        "least_margin": d.friction.min() / needed,
    }


def textile_law(d: xr.Dataset) -> Facts:
    """The measured law against the secant, over the heights."""
    measured, secant = (d.sel(law=law) for law in ("measured", "secant"))
    ratio = measured.advance / secant.advance
    return {
        "heights": f"{float(d.gripper_height.min()):g} to {float(d.gripper_height.max()):g}",
        "ratio": ratio.max(),
        "least_ratio": ratio.min(),
        "bend": measured.curvature.max() / d.measured_curvature.max(),
        "secant_bend": secant.curvature.max() / d.measured_curvature.max(),
        "leaves": (measured.leaves / measured.advance).max(),
        "lost": measured.path_lost,
        "secant_lost": secant.path_lost,
    }

"""Facts about real fabrics and the measured textile; see :mod:`.facts`."""

from __future__ import annotations

import xarray as xr

from studies.summary.facts import Facts


def fabrics(d: xr.Dataset) -> Facts:
    """L* of fabrics and their friction."""
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
    }


def margins(d: xr.Dataset, fabrics: xr.Dataset) -> Facts:
    """What fabrics have over what R-paths need, with the smallest and the largest uncertainty of eta_b."""
    least, median = float(fabrics.friction.min()), float(fabrics.friction.median())

    def each(needed: xr.DataArray) -> str:
        rows = zip(d.length.values, needed.values, strict=True)
        return ", ".join(f"{least / m:.2g} and {median / m:.2g} at {length:g} L*" for length, m in rows)

    exact, uncertain = (d.suffices.sel(uncertainty=u) for u in (d.uncertainty.min(), d.uncertainty.max()))
    return {
        "bent": fabrics.sizes["bent"],
        "uncertainty": d.uncertainty.max(),
        # A length for which none was found has no margin.
        "exact": (least / exact).fillna(0.0).min(),
        "uncertain": (least / uncertain).fillna(0.0).min(),
        "exact_each": each(exact),
        "uncertain_each": each(uncertain),
    }


HELD = 0.2
"""M_0 / rho_a g L*^2 that the four fabrics with a published loop have at least."""


def laws(d: xr.Dataset) -> Facts:
    """lambda of strips with their fabric's law over that of linear strips, by the way to eta_b."""
    ratio = d.advance / d.predicted

    def within(estimate: str) -> str:
        low, high = ratio.sel(estimate=estimate).quantile([0.05, 0.95])
        return f"{float(low):.2f} to {float(high):.2f}"

    slope = d.gravity_length.sel(estimate="slope", flattest=d.flattest[0]) ** 3
    warp = slope.max("direction") / slope.min("direction")
    decided = d.friction.notnull()
    return {
        "height": d.attrs["height"],
        "strips": ratio.sel(estimate="fold").size,
        "fold": ratio.sel(estimate="fold").median(),
        "fold_range": within("fold"),
        "secant_range": within("secant"),
        "slope_range": within("slope"),
        "mean_range": within("mean slope"),
        "touch": int((d.snap == 0.0).sum()),
        "failed": int(d.advance.isnull().sum()),
        "ratio": warp.median(),
        "most": warp.max(),
        "tried": int(decided.sum()),
        "moment": HELD,
        "held": ((d.friction <= HELD) & decided).sum() / decided.sum(),
        "lost": f"{float(d.followed.min()):.2f} to {float(d.followed.max()):.2f}",
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

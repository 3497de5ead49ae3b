"""Critical points in units of L*: all materials on one curve, that of the elastica, and their distance from it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.interpolate import CubicSpline

from plots.critical_points import draw_points, error_bars, legend_handles
from plots.pieces import ETA_TITLE, entry
from plots.readers import critical_points, materials
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, GREY, SHADE
from stripfold.draw.style import figure, legend_above, styled


@styled
def draw(data: xr.Dataset, curve: xr.Dataset) -> Figure:
    """Draw lambda_c / L* over z / L*, with the difference between solid and elastica below.

    ``data``: critical points of several materials, padded with nan, over ``material`` and ``height_index``.  ``curve``:
    the elastica's critical points from :func:`tasks.x_axis.master_curve`: ``lambda_c`` over ``z``, both in L*, and the
    attribute ``touch_limit``, the height under which the sag touches first.
    """
    limit = float(curve.attrs["touch_limit"])
    fig = figure(4.6)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
    top.plot(curve["z"], curve["lambda_c"], color=BLACK, lw=1.0, zorder=1, label="_elastica")
    bottom.axhline(0.0, color=BLACK, lw=1.0, zorder=1)
    for name, how in materials(data):
        unit = float(data["gravity_length"].sel(material=name))
        p = critical_points(data, name)
        # Hollow: the points of all materials lie on each other.
        draw_points(top, p, 1.0 / unit, how, ls="none", mfc="none", mew=0.8, ms=4.0)
        p = p.isel(height_index=p["snap"].values)
        heights = p["gripper_height"].values / unit
        difference = p["end"].values / unit - elastica_at(curve, heights)
        bottom.errorbar(heights, difference, yerr=p["lambda_error"].values / unit, **error_bars(how))
    for ax in (top, bottom):
        ax.axvspan(0.0, limit, facecolor=SHADE, edgecolor="none", zorder=0, label="_touch")
        ax.axvline(limit, color=GREY, lw=0.6, zorder=0)
    top.text(0.5 * limit, 0.5, "sag touches first", rotation=90, transform=top.get_xaxis_transform(), ha="center")
    top.set_xlim(left=0.0)
    top.set_ylabel(r"$\lambda_c\,/\,L^*$")
    bottom.set(xlabel=r"gripper height $z\,/\,L^*$", ylabel=r"(solid $-$ elastica)$\,/\,L^*$")
    legend_above(fig, [*legend_handles(data), entry("elastica", BLACK, lw=1.0)], title=ETA_TITLE)
    fig.align_ylabels()
    return fig


def elastica_at(curve: xr.Dataset, heights: Array) -> Array:
    """lambda_c / L* of the elastica at ``heights`` in L*; nan beyond the heights of ``curve``."""
    z, lam = curve["z"].values, curve["lambda_c"].values
    known = np.isfinite(lam)
    return np.asarray(CubicSpline(z[known], lam[known], extrapolate=False)(heights))

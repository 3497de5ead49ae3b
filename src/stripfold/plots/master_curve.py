"""Critical points in units of L*: all materials on the elastica's one curve, and how far they are from it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.interpolate import CubicSpline

from stripfold.arrays import Array
from stripfold.plots.critical_points import draw_points, error_bars, legend_handles
from stripfold.plots.materials import ETA_TITLE, looks, points
from stripfold.plots.style import BLACK, GREY, SHADE, figure, styled


@styled
def draw(data: xr.Dataset, curve: xr.Dataset) -> Figure:
    """Draw lambda_c / L* over z / L*, with the difference between solid and elastica below.

    Parameters
    ----------
    data
        Critical points of several materials (:mod:`stripfold.plots.materials`).
    curve
        The elastica's critical points from :func:`stripfold.elastica.master_curve`: ``lambda_c`` over ``z``,
        both in L*, and the attribute ``touch_limit``, the height under which the sag touches first.
    """
    z, lam = curve["z"].values, curve["lambda_c"].values
    limit = float(curve.attrs["touch_limit"])
    fig = figure(4.6)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=[2.0, 1.0])
    line = {"color": BLACK, "lw": 1.0, "zorder": 1}
    top.plot(z, lam, label="_elastica", **line)
    bottom.axhline(0.0, **line)
    for name, how in looks(data):
        unit = float(data["gravity_length"].sel(material=name))
        p = points(data, name)
        # Hollow: the points of all materials lie on each other.
        draw_points(top, p, 1.0 / unit, how, ls="none", mfc="none", mew=0.8, ms=4.0)
        heights = p.height[p.snap] / unit
        difference = p.advance[p.snap] / unit - elastica_at(curve, heights)
        bottom.errorbar(heights, difference, yerr=p.error[p.snap] / unit, **error_bars(how))
    for ax in (top, bottom):
        _shade(ax, limit)
    place = top.get_xaxis_transform()
    top.text(0.5 * limit, 0.5, "sag touches first", rotation=90, transform=place, ha="center")
    top.set_xlim(left=0.0)
    top.set_ylabel(r"$\lambda_c\,/\,L^*$")
    bottom.set(xlabel=r"gripper height $z\,/\,L^*$", ylabel=r"(solid $-$ elastica)$\,/\,L^*$")
    handles = [*legend_handles(data), Line2D([], [], color=BLACK, lw=1.0, label="elastica")]
    fig.legend(handles=handles, title=ETA_TITLE, loc="outside upper center", ncols=2)
    fig.align_ylabels()
    return fig


def elastica_at(curve: xr.Dataset, heights: Array) -> Array:
    """lambda_c / L* of the elastica at ``heights`` in L*; nan beyond the heights of ``curve``."""
    z, lam = curve["z"].values, curve["lambda_c"].values
    known = np.isfinite(lam)
    return np.asarray(CubicSpline(z[known], lam[known], extrapolate=False)(heights))


def _shade(ax: Axes, limit: float) -> None:
    """Shade the heights at which the sag touches first."""
    ax.axvspan(0.0, limit, facecolor=SHADE, edgecolor="none", zorder=0, label="_touch")
    ax.axvline(limit, color=GREY, lw=0.6, zorder=0)

"""Critical points over the gripper's height: the paths that lead to them, in SI and in units of L*."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.interpolate import CubicSpline

from plots.pieces import ETA_TITLE, Look, entry, note
from plots.readers import critical_points, materials
from stripfold.base.arrays import Array
from stripfold.draw.colours import BLACK, CRITICAL, GREY, GRIPPER, SHADE
from stripfold.draw.style import CM, equal_panels, figure, legend_above, styled


@styled
def draw_paths(data: xr.Dataset, material: str) -> Figure:
    """Draw the paths of one material from lambda_0 to where the advance ends, in the paper's frame.

    ``data``: critical points of several materials, padded with nan, over ``material`` and ``height_index``;
    ``material``: name of the one to draw_paths.  Raises InvalidInputError: no such material.
    """
    p = critical_points(data, material)
    half, snap = 0.5 * float(p["length"]), p["snap"].values
    start, end, z = CM * (p["lambda_0"].values - half), CM * (p["end"].values - half), CM * p["gripper_height"].values
    margin = 0.05 * (end.max() - start.min())
    limits = (start.min() - margin, end.max() + margin), (-margin, z.max() + margin)
    fig, (ax,) = equal_panels([limits], above=0.62)
    ax.set(xlabel="gripper $x$ [cm]", ylabel="gripper $z$ [cm]")
    for x0, x1, height, snaps in zip(start, end, z, snap, strict=True):
        ax.plot([x0, x1], [height, height], color=GRIPPER if snaps else GREY, lw=1.0, label="_path")
    ax.plot(start, z, "|", color=GRIPPER, ms=5, label=r"start, $\lambda_0$")
    label = r"critical point, $\lambda_c$"
    ax.plot(end[snap], z[snap], ":o", color=CRITICAL, ms=2.5, label=label, gid="lambda_c", zorder=4)
    if not np.all(snap):
        ax.plot(end[~snap], z[~snap], "x", color=CRITICAL, mew=1.2, label=NO_SNAP, gid="no-snap", zorder=4)
    legend_above(fig, title=f"{ETA_TITLE}: {eta_label(data, material)}")
    return fig


CROWDED = 0.6
"""When all materials but one fill less than this part of the axes, that one gets a panel of its own."""
NO_SNAP = "sag touches first: no snap"


@styled
def draw_critical_points(data: xr.Dataset) -> Figure:
    """Draw lambda_c over the gripper height; where there is no snap, the advance at which the sag touches.

    ``data`` holds critical points over ``material`` and ``height_index``, padded with nan.
    """
    found = [(critical_points(data, name), how) for name, how in materials(data)]
    sizes = sorted((CM * float(p["gripper_height"].max()), CM * float(p["end"].max())) for p, _ in found)
    apart = len(sizes) > 1 and sizes[-2][0] < CROWDED * sizes[-1][0]
    fig = figure(5.0 if apart else 3.2)
    axes = list(fig.subplots(2 if apart else 1, 1, squeeze=False, height_ratios=(2, 1) if apart else (1,)).flat)
    for p, how in found:
        large = apart and CM * float(p["gripper_height"].max()) == sizes[-1][0]
        draw_points(axes[1 if large else 0], p, CM, how)
    for ax in axes:
        ax.set(ylabel=r"critical point $\lambda_c$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    axes[-1].set_xlabel("gripper height $z$ [cm]")
    legend_above(fig, legend_handles(data), title=ETA_TITLE)
    if apart:
        note(axes[0], "(a)")
        note(axes[1], "(b) the longest strip")
    return fig


def legend_handles(data: xr.Dataset) -> list[Line2D]:
    """One entry for each material under the title ``ETA_TITLE``, and one for crosses where there are any."""
    handles = [
        entry(eta_label(data, name), how.color, marker=how.marker, ms=3.0, lw=1.0) for name, how in materials(data)
    ]
    if not all(critical_points(data, name)["snap"].all() for name, _ in materials(data)):
        handles.append(entry(NO_SNAP, BLACK, "none", marker="x"))
    return handles


def draw_points(ax: Axes, p: xr.Dataset, scale: float, how: Look, **options: Any) -> None:
    """Draw one material's points, lengths times ``scale``: markers joined by a line, crosses without snap."""
    z, lam, error = (scale * p[name].values for name in ("gripper_height", "end", "lambda_error"))
    snap = p["snap"].values
    ax.errorbar(z[snap], lam[snap], yerr=error[snap], **error_bars(how) | options)
    ax.plot(z[~snap], lam[~snap], "x", color=how.color, mew=1.2, label="_no-snap")


def error_bars(how: Look) -> dict[str, Any]:
    """Options of ``Axes.errorbar`` for the points of a material."""
    return {"color": how.color, "marker": how.marker, "ms": 3.0, "lw": 1.0, "capsize": 1.5, "elinewidth": 0.8}


def eta_label(data: xr.Dataset, material: str) -> str:
    """``eta_b`` of a material, with its name where it has one."""
    one = data.sel(material=material)
    label = str(one["label"].values)
    number = f"{float(f'{float(one.eta_b):.3g}'):.10g}"
    return number if label.startswith("η_b") else f"{number}: {label}".replace("η_b", r"$\eta_b$")


@styled
def draw_master_curve(data: xr.Dataset, curve: xr.Dataset) -> Figure:
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

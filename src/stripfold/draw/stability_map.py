"""The stability map of the gripper's places."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stripfold.base.arrays import Array
from stripfold.draw.colours import FRICTION, GREY, HANGING, LYING, SHADE, TOUCHING
from stripfold.draw.style import CM, around, equal_panels, legend_above, styled

LEVELS = (0.1, 0.2, 0.3)
"""Margins that are drawn, over the length of the strip."""
CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    "snap": ("snap", {"color": TOUCHING, "lw": 1.8}),
    "sag_touch": ("sag touches or comes off", {"color": LYING, "lw": 1.0, "ls": "--"}),
    "lifted": ("hanging, all lifted", {"color": GREY, "lw": 1.0}),
    "lifted_landed": ("landed, all lifted", {"color": GREY, "lw": 1.0, "ls": ":"}),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw the boundaries and lines of equal margin; ``data`` is from :meth:`.StabilityMap.to_dataset`."""
    curves = {name: CM * np.stack([data[f"{name}_x"].values, data[f"{name}_z"].values], axis=1) for name in CURVES}
    fig, (ax,) = equal_panels([around(np.vstack(list(curves.values())))], above=0.55)
    ax.set(xlabel="gripper $x$ [cm]", ylabel="gripper $z$ [cm]")
    levels = [CM * data.attrs["length"] * share for share in LEVELS]
    draw_map(ax, curves, CM * data["map_x"].values, CM * data["map_z"].values, CM * data["margin"].values, levels, "cm")
    if "friction_x" in data:
        _draw_friction(ax, data)
    legend_above(fig, ax.get_legend_handles_labels()[0], fontsize=7)
    return fig


def _draw_friction(ax: Axes, data: xr.Dataset) -> None:
    """The ends of the advance with friction, and for which history they are."""
    x, z, snaps = CM * data["friction_x"].values, CM * data["friction_z"].values, data["friction_snap"].values == 1
    ax.plot(x, z, "-o", color=FRICTION, lw=1.2, ms=3.0, zorder=4, label="with friction (open: sag touches)")
    ax.plot(x[~snaps], z[~snaps], "o", color=FRICTION, mfc="white", ms=3.0, zorder=4)
    text = f"friction {data.attrs['friction_moment']:.3g} N: {data.attrs['friction_history']}"
    ax.text(0.6, 0.07, fill(text, 30), transform=ax.transAxes, ha="center", fontsize=6.5)


def draw_map(
    ax: Axes, curves: Mapping[str, Array], x: Array, z: Array, margin: Array, levels: list[float], unit: str
) -> None:
    """Draw the curves of :data:`CURVES`, shape (n, 2) each, and lines of equal margin, shape (z, x), labelled."""
    low = curves["sag_touch"][:, 1] <= curves["snap"][0, 1]
    region = np.vstack([curves["lifted"], curves["snap"][::-1], curves["sag_touch"][low][::-1]])
    ax.fill(*region.T, color=SHADE, lw=0.0, zorder=0)
    for name, (label, style) in CURVES.items():
        ax.plot(*curves[name].T, label=label, zorder=3, **style)
    lines = ax.contour(x, z, margin, levels, colors=HANGING, linewidths=0.6)
    ax.clabel(lines, fmt="%.2g", fontsize=6)
    ax.plot([], [], color=HANGING, lw=0.6, label=f"distance from the snap [{unit}]")

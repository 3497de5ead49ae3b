"""The map of the gripper's places in units of L*, with four paths on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, PATH_STYLES, note
from stripfold.draw.colours import CRITICAL, GREEN, HANGING
from stripfold.draw.stability_map import CURVES, draw_map
from stripfold.draw.style import figure, legend_above, styled

LEVELS = [1.0, 3.0, 5.0]
"""Margins that are drawn, L*."""
STYLES: dict[str, tuple[str, dict[str, Any]]] = {
    name: (label, {"color": look.color, "ls": PATH_STYLES[name]}) for name, (label, look) in PATH_LOOKS.items()
} | {"low": ("low path", {"color": GREEN, "ls": "-."})}
THERE = {
    "margin_there": ("margin$\\,/\\,L^*$", {"color": HANGING, "ls": "-"}),
    "eigenvalue_there": ("eigenvalue$\\,/\\,(g/L^*)$", {"color": CRITICAL, "ls": "--"}),
    "barrier_there": ("barrier$\\,/\\,\\rho_a g{L^*}^2$", {"color": CRITICAL, "ls": ":"}),
}


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) the map with the paths, (b) the margin along the paths, (c) three margins over the distance along x.

    ``data`` is from :func:`verification.stability_map.run`.
    """
    fig = figure(6.5)
    plane, along, there = fig.subplots(3, 1, height_ratios=(1.75, 1.0, 1.0))
    curves = {name: data[name].values for name in CURVES}
    draw_map(plane, curves, data["advance"].values, data["z"].values, data["margin"].values, LEVELS, "$L^*$")
    travelled = np.linspace(0.0, 1.0, data.sizes["point"])
    for path, (label, style) in STYLES.items():
        one = data.sel(path=path)
        plane.plot(*one["places"].values.T, lw=1.1, zorder=4, label=label, **style)
        along.plot(travelled, one["path_margin"].values, label=f"_{path}", **style)
    plane.set(aspect="equal", xlabel="advance of the gripper$\\,/\\,L^*$", ylabel="gripper height$\\,/\\,L^*$")
    plane.set(xlim=(-0.5, 1.3 * data.attrs["length_star"]), ylim=(0.0, None))
    plane.grid(visible=False)
    handles = plane.get_legend_handles_labels()[0]
    legend_above(fig, handles[: -len(STYLES)], fontsize=7)
    along.legend(handles=handles[-len(STYLES) :], fontsize=7, loc="upper right")
    highest = 1.25 * float(data["path_margin"].max())  # room for the letter
    along.set(xlabel="part of the path", ylabel="margin$\\,/\\,L^*$", xlim=(0.0, 1.0), ylim=(0.0, highest))
    for name, (label, style) in THERE.items():
        there.plot(data["distance"], data[name], label=label, **style)
    there.set(xscale="log", yscale="log", xlabel="$(\\lambda_c-\\lambda)\\,/\\,L^*$")
    there.set_xlim(right=10.0 * float(data["distance"].max()))  # room for the legend
    there.legend(fontsize=7, loc="lower right")
    for ax, text in ((plane, "(a)"), (along, "(b)"), (there, f"(c) at $z={data.attrs['height']:g}\\,L^*$")):
        note(ax, text)
    return fig

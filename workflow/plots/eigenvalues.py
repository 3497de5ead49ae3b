"""The smallest eigenvalue of (K, M) down to zero, and the critical modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from plots.pieces import PATH_LOOKS, entry, look, note
from stripfold.draw.colours import BLACK, CRITICAL, GREY, GRIPPER, HANGING, TOUCHING
from stripfold.draw.style import figure, styled, text_at

LOOKS = {"x": ("along $x$", look(2)), **PATH_LOOKS}
SHOWN = {"x": "(b) along $x$", "r-path": "(c) R-path"}
STYLES = ("-", "--", "-.", ":")
NEAREST = 1e-6
"""Smallest distance drawn, L*."""
WIDE = 7.5
"""Part of the strip drawn, from the bulge on, L*."""
SIZE = 0.5
"""Largest displacement drawn of a mode, L*."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw (a) both eigenvalues over the distance to the critical point, (b, c) the critical state and its mode.

    ``data`` is from :func:`verification.eigenvalues.run`.
    """
    fig = figure(5.0)
    axes = fig.subplot_mosaic([["a", "a"], ["b", "c"]], height_ratios=(1.0, 1.0))
    top, below = axes["a"], [axes["b"], axes["c"]]
    for i, (motion, (label, how)) in enumerate(LOOKS.items()):
        one = data.sel(motion=motion)
        distance = one["distance"].values
        shown = distance > NEAREST
        line: dict[str, Any] = {"color": how.color, "ls": STYLES[i]}
        top.plot(distance[shown], one["eigenvalue_1"].values[shown], **line, lw=1.2, label=label)
        top.plot(distance[shown], one["eigenvalue_2"].values[shown], **line, lw=0.6, label="_second")
    for power, factor, text, place in ((0.5, 0.025, "1/2", 1e-4), (1.0, 0.45, "1", 0.9)):
        x = place * np.array([0.3, 3.0])
        top.plot(x, factor * x**power, color=GREY, lw=0.8, label="_guide")
        text_at(top, (x[0], factor * x[0] ** power), text, (2, 0), ha="left", va="center", fontsize=7, color=GREY)
    top.set(xscale="log", yscale="log", xlabel=r"distance to the critical point$\,/\,L^*$")
    top.set_ylabel("eigenvalues [$g/L^*$]")
    top.invert_xaxis()
    top.legend(loc="lower left", fontsize=7)
    note(top, "(a)", loc="upper right")
    for ax, (motion, title) in zip(below, SHOWN.items(), strict=True):
        _draw_mode(ax, data.sel(motion=motion), title)
    below[0].set_ylabel("$z\\,/\\,L^*$")
    below[1].tick_params(labelleft=False)
    high = float(data.sel(motion=list(SHOWN))["z"].max()) + 1.5
    for ax in below:
        ax.set_ylim(-0.5, high)
    handles = [
        entry("critical state", CRITICAL, lw=1.4),
        entry("mode, down", TOUCHING, "--", lw=0.8),
        entry("mode, up", HANGING, "-.", lw=0.8),
    ]
    below[0].legend(handles=handles, loc="center right", fontsize=7, bbox_to_anchor=(1.0, 0.65))
    return fig


def _draw_mode(ax: Axes, one: xr.Dataset, title: str) -> None:
    shape = np.stack([one["x"].values, one["z"].values])
    mode = SIZE * np.stack([one["mode_x"].values, one["mode_z"].values])
    ax.plot(*(shape + mode), color=TOUCHING, lw=0.8, ls="--", label="_down")
    ax.plot(*(shape - mode), color=HANGING, lw=0.8, ls="-.", label="_up")
    ax.plot(*shape, color=CRITICAL, lw=1.4, label="_critical")
    ax.plot(*shape[:, 0], "o", color=GRIPPER, ms=4, zorder=5)
    ax.axhline(0.0, color=BLACK, lw=0.6, zorder=1)
    left = float(shape[0].min()) - 1.0
    ax.set(aspect="equal", xlim=(left, left + WIDE), xlabel="$x\\,/\\,L^*$")
    note(ax, title)

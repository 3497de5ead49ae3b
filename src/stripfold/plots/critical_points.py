"""Critical points over the gripper height, in SI units, for all materials."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from stripfold.plots.materials import ETA_TITLE, NO_SNAP, Points, eta, looks, names, points
from stripfold.plots.style import BLACK, CM, Look, figure, note, styled

CROWDED = 0.6
"""When all materials but one fill less than this part of the axes, a second panel enlarges them."""


@styled
def draw(data: xr.Dataset) -> Figure:
    """Draw lambda_c over the gripper height; where there is no snap, the advance at which the sag touches.

    Parameters
    ----------
    data
        Critical points of several materials (:mod:`stripfold.plots.materials`).
    """
    extents = [points(data, name) for name in names(data)]
    sizes = sorted((CM * p.height.max(), CM * p.advance.max()) for p in extents)
    enlarge = len(sizes) > 1 and sizes[-2][0] < CROWDED * sizes[-1][0]
    fig = figure(5.0 if enlarge else 3.2)
    axes = list(fig.subplots(2 if enlarge else 1, 1, squeeze=False).flat)
    for ax in axes:
        for name, how in looks(data):
            draw_points(ax, points(data, name), CM, how)
        ax.set(ylabel=r"critical point $\lambda_c$ [cm]", xlim=(0.0, None), ylim=(0.0, None))
    axes[-1].set_xlabel("gripper height $z$ [cm]")
    fig.legend(handles=legend_handles(data), title=ETA_TITLE, loc="outside upper center", ncols=2)
    if enlarge:
        axes[1].set_xlim(0.0, 1.05 * sizes[-2][0])
        axes[1].set_ylim(0.0, 1.05 * max(lam for _, lam in sizes[:-1]))
        note(axes[0], "(a)")
        note(axes[1], "(b) lower left part of (a)")
    return fig


def legend_handles(data: xr.Dataset) -> list[Line2D]:
    """One entry for each material, and one for crosses where there are any."""
    handles = [
        Line2D([], [], color=how.colour, marker=how.marker, ms=3.0, lw=1.0, label=eta(data, name))
        for name, how in looks(data)
    ]
    if not all(np.all(points(data, name).snap) for name in names(data)):
        handles.append(Line2D([], [], color=BLACK, marker="x", ls="none", label=NO_SNAP))
    return handles


def draw_points(ax: Axes, p: Points, scale: float, how: Look, **options: Any) -> None:
    """Draw one material's points, lengths times ``scale``: markers joined by a line, crosses without snap."""
    z, lam, error = scale * p.height, scale * p.advance, scale * p.error
    ax.errorbar(z[p.snap], lam[p.snap], yerr=error[p.snap], **error_bars(how) | options)
    ax.plot(z[~p.snap], lam[~p.snap], "x", color=how.colour, mew=1.2, label="_no-snap")


def error_bars(how: Look) -> dict[str, Any]:
    """Options of ``Axes.errorbar`` for the points of a material."""
    return {
        "color": how.colour,
        "marker": how.marker,
        "ms": 3.0,
        "lw": 1.0,
        "capsize": 1.5,
        "elinewidth": 0.8,
    }
